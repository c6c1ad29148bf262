//! A closed surface of triangles within the CSO, grown about the origin: what a proof of a depth rests on.
//!
//! Its corners are differences of vertices of the two bodies, so the CSO holds them and their hull, whatever the surface
//! looks like. If no triangle comes nearer to the origin than u and the surface winds around the origin, it winds around
//! every point of the ball of radius u; so the CSO holds that ball, and no direction has h(n) < u. The surface
//! need not be convex for that, nor need it be one sheet: it only has to be closed, with every edge run through
//! once in each direction, which all that is done here preserves. It winds around the origin if every triangle sees the origin on
//! its inner side.
//!
//! 1. Begin with a tetrahedron of supports (cold), or with what an earlier proof left, its corners moved along with the bodies.
//! 2. Judge each triangle: its unit normal and the least height of its corners along it, by which the triangle keeps off
//!    the origin even where rounding tilts the normal.
//! 3. Grow it from a triangle to a further corner: take away the triangles around that face the corner, and close
//!    the hole with a fan about it. A triangle that already has the corner is taken away with them; that flips an edge
//!    when motion has folded the surface.
//!
//! A triangle of no height lies, as far as the proof can tell, on edges that others have too, and those are judged. It counts as seen from
//! everywhere, so that it goes together with its neighbours.

use glam::DVec3;

use super::HubPair;
use super::cso::Cso;
use crate::algebra::tolerance::{PROOF_CORNERS, PROOF_HOLE, PROOF_TRIANGLES};

/// A point of the CSO.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tip {
    pub(super) hub: HubPair,
    pub(super) at: DVec3,
}

/// A triangle of the surface, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) tips: [u16; 3],
    /// The triangle across the edge from tip k to tip k + 1.
    pub(super) across: [u16; 3],
    alive: bool,
    /// Outward and unit; zero for a triangle of no height.
    pub(super) normal: DVec3,
    /// The least height of its tips along the normal; infinite for a triangle of no height.
    pub(super) offset: f64,
}

/// An edge around a hole: from one tip to the next, and edge `side` of triangle `outer`, which runs the other way.
#[derive(Clone, Copy, Debug)]
struct Rim {
    from: u16,
    to: u16,
    outer: u16,
    side: u8,
}

/// Edge `side` of triangle `triangle`.
#[derive(Clone, Copy, Debug)]
struct Half {
    triangle: u16,
    side: u8,
}

/// Why a surface could not be grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// No room for more tips or triangles.
    Full,
    /// The hole had no rim: rounding has torn the surface.
    Torn,
}

/// The surface. Vectors of fixed capacity.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    pub(super) tips: Vec<Tip>,
    pub(super) triangles: Vec<Triangle>,
    /// Lengths below this are rounding.
    slack: f64,
    /// Motion may have folded it, so that a support can be a tip that it has. One grown from nothing is convex.
    folded: bool,
    taken: Vec<u16>,
    rim: Vec<Rim>,
    /// New numbers of tips when the unused are dropped.
    renumbered: Vec<u16>,
}

impl Surface {
    pub(super) fn new() -> Self {
        Self {
            tips: Vec::with_capacity(PROOF_CORNERS),
            triangles: Vec::with_capacity(PROOF_TRIANGLES),
            slack: 0.0,
            folded: false,
            taken: Vec::with_capacity(PROOF_HOLE),
            rim: Vec::with_capacity(PROOF_HOLE),
            renumbered: Vec::with_capacity(PROOF_TRIANGLES),
        }
    }

    /// Empties the surface; `slack` is the length below which a height is rounding, and `folded` tells that what follows
    /// was moved since it was grown.
    pub(super) fn clear(&mut self, slack: f64, folded: bool) {
        self.tips.clear();
        self.triangles.clear();
        self.slack = slack;
        self.folded = folded;
    }

    /// Adds a tip without making it part of the surface.
    #[inline]
    pub(super) fn push_tip(&mut self, cso: &Cso<'_>, hub: HubPair) {
        self.tips.push(Tip { hub, at: cso.vertex(hub) });
    }

    /// Adds a triangle whose neighbours are known.
    #[inline]
    pub(super) fn push_triangle(&mut self, tips: [u16; 3], across: [u16; 3]) {
        let (normal, offset) = judged(tips.map(|tip| self.tips[usize::from(tip)].at), self.slack);
        self.triangles.push(Triangle { tips, across, alive: true, normal, offset });
    }

    /// The surface of the tetrahedron of the four tips present, if it has a volume.
    pub(super) fn close_tetrahedron(&mut self) -> bool {
        let [p, q, r, s] = [0, 1, 2, 3].map(|k| self.tips[k].at);
        let volume = (q - p).cross(r - p).dot(s - p);
        if volume == 0.0 {
            return false;
        }
        if volume > 0.0 {
            self.tips.swap(0, 1);
        }
        // With s below pqr: pqr is counter-clockwise from above.
        self.push_triangle([0, 1, 2], [1, 2, 3]);
        self.push_triangle([1, 0, 3], [0, 3, 2]);
        self.push_triangle([2, 1, 3], [0, 1, 3]);
        self.push_triangle([0, 2, 3], [0, 2, 1]);
        true
    }

    /// The triangle, if it is still part of the surface and comes nearer to the origin than `bar` (or has it outside).
    #[inline]
    pub(super) fn below(&self, triangle: usize, bar: f64) -> Option<Triangle> {
        let t = &self.triangles[triangle];
        (t.offset < bar && t.alive).then_some(*t)
    }

    /// The hub pair from which to climb to the support along the triangle's normal.
    #[inline]
    pub(super) fn hint(&self, cso: &Cso<'_>, triangle: &Triangle) -> HubPair {
        let toward_b = cso.toward_b(triangle.normal);
        let [first, others @ ..] = triangle.tips.map(|tip| self.tips[usize::from(tip)].hub);
        let height = |hub: HubPair| (toward_b.dot(cso.a.vertex(hub.a)), triangle.normal.dot(cso.b.vertex(hub.b)));
        let (mut best, mut highest) = (first, height(first));
        for hub in others {
            let (a, b) = height(hub);
            if a > highest.0 {
                (best.a, highest.0) = (hub.a, a);
            }
            if b > highest.1 {
                (best.b, highest.1) = (hub.b, b);
            }
        }
        best
    }

    /// True if the surface has a triangle that is not degenerate.
    pub(super) fn is_solid(&self) -> bool {
        self.triangles.iter().any(|t| t.alive && t.offset.is_finite())
    }

    /// Grows the surface from `triangle` to the tip of `hub`, which should lie above it.
    pub(super) fn grow(&mut self, cso: &Cso<'_>, triangle: usize, hub: HubPair) -> Result<(), Refusal> {
        let at = cso.vertex(hub);
        let near = self.slack * self.slack;
        let known = match self.folded {
            true => self.tips.iter().position(|tip| tip.at.distance_squared(at) <= near),
            false => None,
        };
        let tip = match known {
            Some(known) => known,
            None if self.tips.len() == PROOF_CORNERS => return Err(Refusal::Full),
            None => {
                self.tips.push(Tip { hub, at });
                self.tips.len() - 1
            }
        };
        self.open(triangle as u16, tip as u16)?;
        if self.triangles.len() + self.rim.len() > PROOF_TRIANGLES {
            return Err(Refusal::Full);
        }
        self.order_rim()?;
        self.fan(tip as u16);
        Ok(())
    }

    /// Takes away the triangles around `seed` that see the tip, and lists the rim of the hole.
    fn open(&mut self, seed: u16, tip: u16) -> Result<(), Refusal> {
        let at = self.tips[usize::from(tip)].at;
        self.taken.clear();
        self.rim.clear();
        self.triangles[usize::from(seed)].alive = false;
        self.taken.push(seed);
        let mut next = 0;
        while let Some(&here) = self.taken.get(next) {
            next += 1;
            let Triangle { tips, across, .. } = self.triangles[usize::from(here)];
            for side in 0..3 {
                let outer = across[side];
                let other = &mut self.triangles[usize::from(outer)];
                if !other.alive {
                    continue;
                }
                let gives_way = other.offset.is_infinite()
                    || other.normal.dot(at) - other.offset > self.slack
                    || other.tips.contains(&tip);
                let (from, to) = (tips[side], tips[(side + 1) % 3]);
                let room = self.taken.len() < PROOF_HOLE && self.rim.len() < PROOF_HOLE;
                if !room {
                    return Err(Refusal::Full);
                }
                if gives_way {
                    other.alive = false;
                    self.taken.push(outer);
                } else {
                    let back = (0..3).find(|&k| other.across[k] == here && other.tips[k] == to).ok_or(Refusal::Torn)?;
                    self.rim.push(Rim { from, to, outer, side: back as u8 });
                }
            }
        }
        Ok(())
    }

    /// Puts the rim's edges head to tail, in one loop or several.
    fn order_rim(&mut self) -> Result<(), Refusal> {
        let mut begin = 0;
        for k in 0..self.rim.len() {
            let end = self.rim[k].to;
            match (k + 1..self.rim.len()).find(|&j| self.rim[j].from == end) {
                Some(j) => self.rim.swap(k + 1, j),
                None if end == self.rim[begin].from => begin = k + 1,
                None => return Err(Refusal::Torn),
            }
        }
        if self.rim.is_empty() { Err(Refusal::Torn) } else { Ok(()) }
    }

    /// Closes the hole with triangles from the rim's edges to the tip.
    fn fan(&mut self, tip: u16) {
        let mut k = 0;
        while k < self.rim.len() {
            k = self.fan_loop(tip, k);
        }
    }

    /// One loop of the rim, which starts at `begin`; returns where the next does.
    fn fan_loop(&mut self, tip: u16, begin: usize) -> usize {
        let home = self.rim[begin].from;
        let mut first: Option<Half> = None;
        let mut leaving: Option<Half> = None;
        let mut k = begin;
        loop {
            let Rim { from, to, outer, side } = self.rim[k];
            let outer = Half { triangle: outer, side };
            // The edges tip → from and to → tip, of the new triangle or, where the rim has the tip itself, of the outer one.
            let (entry, exit) = if to == tip {
                (Some(outer), None)
            } else if from == tip {
                (None, Some(outer))
            } else {
                let new = self.triangles.len() as u16;
                self.push_triangle([from, to, tip], [outer.triangle, new, new]);
                self.triangles[usize::from(outer.triangle)].across[usize::from(outer.side)] = new;
                (Some(Half { triangle: new, side: 2 }), Some(Half { triangle: new, side: 1 }))
            };
            if k == begin {
                first = entry;
            } else {
                self.join(leaving, entry);
            }
            leaving = exit;
            k += 1;
            // A loop may pass its first tip again; it ends where the next edge does not follow.
            if to == home && self.rim.get(k).is_none_or(|next| next.from != to) {
                break;
            }
            if k == self.rim.len() {
                break;
            }
        }
        self.join(leaving, first);
        k
    }

    fn join(&mut self, one: Option<Half>, other: Option<Half>) {
        if let (Some(one), Some(other)) = (one, other) {
            self.triangles[usize::from(one.triangle)].across[usize::from(one.side)] = other.triangle;
            self.triangles[usize::from(other.triangle)].across[usize::from(other.side)] = one.triangle;
        }
    }

    /// Drops what is no part of the surface any more.
    pub(super) fn compact(&mut self) {
        self.renumbered.clear();
        let mut count = 0;
        for k in 0..self.triangles.len() {
            self.renumbered.push(count);
            if self.triangles[k].alive {
                self.triangles[usize::from(count)] = self.triangles[k];
                count += 1;
            }
        }
        self.triangles.truncate(usize::from(count));
        for triangle in &mut self.triangles {
            triangle.across = triangle.across.map(|k| self.renumbered[usize::from(k)]);
        }
        const UNUSED: u16 = u16::MAX;
        self.renumbered.clear();
        self.renumbered.resize(self.tips.len(), UNUSED);
        for tip in self.triangles.iter().flat_map(|triangle| triangle.tips) {
            self.renumbered[usize::from(tip)] = 0;
        }
        let mut count = 0;
        for k in 0..self.tips.len() {
            if self.renumbered[k] != UNUSED {
                self.renumbered[k] = count;
                self.tips[usize::from(count)] = self.tips[k];
                count += 1;
            }
        }
        self.tips.truncate(usize::from(count));
        for triangle in &mut self.triangles {
            triangle.tips = triangle.tips.map(|k| self.renumbered[usize::from(k)]);
        }
    }
}

/// The unit normal of the triangle p, q, r and the least height of its corners along it; zero and infinity if it is lower than
/// `slack`.
#[inline]
pub(super) fn judged([p, q, r]: [DVec3; 3], slack: f64) -> (DVec3, f64) {
    let (u, v) = (q - p, r - p);
    let across = u.cross(v);
    let longest = u.length_squared().max(v.length_squared()).max((v - u).length_squared());
    let square = across.length_squared();
    if square <= slack * slack * longest {
        return (DVec3::ZERO, f64::INFINITY);
    }
    let normal = across / square.sqrt();
    (normal, normal.dot(p).min(normal.dot(q)).min(normal.dot(r)))
}
