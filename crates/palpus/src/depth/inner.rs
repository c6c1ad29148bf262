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
//! Triangles lie without gaps: those that a growth makes take the places of those that it has taken away.
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

/// Edge `side` of a triangle, from its tip `side` to the next. [`PROOF_TRIANGLES`] leaves room for both in one number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Half(u16);

impl Half {
    #[inline]
    fn new(triangle: u16, side: u16) -> Self {
        Self(triangle << 2 | side)
    }

    #[inline]
    fn triangle(self) -> usize {
        usize::from(self.0 >> 2)
    }

    #[inline]
    fn side(self) -> usize {
        usize::from(self.0 & 3)
    }
}

/// A triangle's corners, counter-clockwise seen from outside, and what lies across the edge from tip k to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    pub(super) tips: [u16; 3],
    pub(super) across: [Half; 3],
}

/// A triangle of the surface.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    joint: Joint,
    alive: bool,
    /// Outward and unit; zero for a triangle of no height.
    normal: DVec3,
}

/// An edge around a hole: from one tip to the next, and the edge of the triangle outside, which runs the other way.
#[derive(Clone, Copy, Debug)]
struct Rim {
    from: u16,
    to: u16,
    outer: Half,
}

/// Why a surface could not be grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// No room for more tips or triangles.
    Full,
    /// The hole had no rim: rounding has torn the surface.
    Torn,
}

/// A triangle that comes nearest to the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) triangle: usize,
    pub(super) normal: DVec3,
    pub(super) offset: f64,
}

/// The surface. Vectors of fixed capacity.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    tips: Vec<Tip>,
    triangles: Vec<Triangle>,
    /// Of each triangle, the least height of its tips along the normal; infinite for one of no height, and for one that was taken away.
    offsets: Vec<f64>,
    /// Lengths below this are rounding.
    slack: f64,
    /// Motion may have folded it, so that a support can be a tip that it has. One grown from nothing is convex.
    folded: bool,
    /// Places of triangles that were taken away.
    free: Vec<u16>,
    /// Edges yet to be crossed, as those of the triangles beyond.
    ahead: Vec<Half>,
    rim: Vec<Rim>,
    /// New numbers of triangles or tips when the unused are dropped.
    renumbered: Vec<u16>,
}

impl Surface {
    pub(super) fn new() -> Self {
        Self {
            tips: Vec::with_capacity(PROOF_CORNERS),
            triangles: Vec::with_capacity(PROOF_TRIANGLES),
            offsets: Vec::with_capacity(PROOF_TRIANGLES),
            slack: 0.0,
            folded: false,
            free: Vec::with_capacity(PROOF_TRIANGLES),
            ahead: Vec::with_capacity(2 * PROOF_HOLE + 3),
            rim: Vec::with_capacity(2 * PROOF_HOLE),
            renumbered: Vec::with_capacity(PROOF_TRIANGLES),
        }
    }

    /// Empties the surface; `slack` is the length below which a height is rounding, and `folded` tells that what follows
    /// was moved since it was grown.
    pub(super) fn clear(&mut self, slack: f64, folded: bool) {
        self.tips.clear();
        self.triangles.clear();
        self.offsets.clear();
        self.free.clear();
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
    pub(super) fn push_triangle(&mut self, joint: Joint) {
        let (normal, offset) = judged(joint.tips.map(|tip| self.tips[usize::from(tip)].at), self.slack);
        self.triangles.push(Triangle { joint, alive: true, normal });
        self.offsets.push(offset);
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
        let faces: [([u16; 3], [(u16, u16); 3]); 4] = [
            ([0, 1, 2], [(1, 0), (2, 0), (3, 0)]),
            ([1, 0, 3], [(0, 0), (3, 2), (2, 1)]),
            ([2, 1, 3], [(0, 1), (1, 2), (3, 1)]),
            ([0, 2, 3], [(0, 2), (2, 2), (1, 1)]),
        ];
        for (tips, across) in faces {
            self.push_triangle(Joint { tips, across: across.map(|(triangle, side)| Half::new(triangle, side)) });
        }
        true
    }

    /// The triangle that comes nearest to the origin, or has it farthest outside. Its offset is infinite if no triangle has a height.
    #[inline]
    pub(super) fn nearest(&self) -> Nearest {
        let (triangle, offset) = least(&self.offsets);
        Nearest { triangle, normal: self.triangles.get(triangle).map_or(DVec3::ZERO, |t| t.normal), offset }
    }

    pub(super) fn tips(&self) -> &[Tip] {
        &self.tips
    }

    /// The triangles and their offsets; before, [`Self::compact`] drops those that are none any more.
    pub(super) fn triangles(&self) -> impl Iterator<Item = (Joint, f64)> {
        self.triangles.iter().zip(&self.offsets).map(|(triangle, &offset)| (triangle.joint, offset))
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
        self.open(triangle, tip as u16)?;
        if self.triangles.len() + self.rim.len() > PROOF_TRIANGLES + self.free.len() {
            return Err(Refusal::Full);
        }
        self.order_rim()?;
        self.fan(tip as u16);
        Ok(())
    }

    /// Takes away the triangles around `seed` that see the tip, and lists the rim of the hole.
    ///
    /// Each is crossed from the edge by which it was reached, counter-clockwise, so that the rim comes in order if the hole
    /// is a disk.
    fn open(&mut self, seed: usize, tip: u16) -> Result<(), Refusal> {
        let Self { tips, triangles, offsets, slack, folded, free, ahead, rim, .. } = self;
        let at = tips[usize::from(tip)].at;
        rim.clear();
        ahead.clear();
        let mut room = 2 * PROOF_HOLE;
        let mut take = |place: usize, triangle: &mut Triangle, offset: &mut f64| {
            triangle.alive = false;
            *offset = f64::INFINITY;
            free.push(place as u16);
        };
        let first = &mut triangles[seed];
        take(seed, first, &mut offsets[seed]);
        let [one, two, three] = first.joint.across;
        ahead.extend([three, two, one]);
        while let Some(half) = ahead.pop() {
            let (place, side) = (half.triangle(), half.side());
            let (next, last) = if side == 0 {
                (1, 2)
            } else if side == 1 {
                (2, 0)
            } else {
                (0, 1)
            };
            let (outer, offset) = (&mut triangles[place], &mut offsets[place]);
            if !outer.alive {
                continue;
            }
            let Joint { tips, across } = outer.joint;
            let gives_way =
                outer.normal.dot(at) - *offset > *slack || offset.is_infinite() || *folded && tips.contains(&tip);
            if room == 0 {
                return Err(Refusal::Full);
            }
            room -= 1;
            if gives_way {
                take(place, outer, offset);
                ahead.extend([across[last], across[next]]);
            } else {
                rim.push(Rim { from: tips[next], to: tips[side], outer: half });
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
            let Rim { from, to, outer } = self.rim[k];
            // The edges tip → from and to → tip, of the new triangle or, where the rim has the tip itself, of the outer one.
            let (entry, exit) = if to == tip {
                (Some(outer), None)
            } else if from == tip {
                (None, Some(outer))
            } else {
                let new = self.place([from, to, tip], outer);
                (Some(Half::new(new, 2)), Some(Half::new(new, 1)))
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

    /// Puts a triangle where one was taken away, or at the end, and joins its first edge to `outer`; the others are yet to be joined.
    #[inline]
    fn place(&mut self, tips: [u16; 3], outer: Half) -> u16 {
        let joint = Joint { tips, across: [outer; 3] };
        let place = match self.free.pop() {
            Some(place) => {
                let (normal, offset) = judged(tips.map(|tip| self.tips[usize::from(tip)].at), self.slack);
                self.triangles[usize::from(place)] = Triangle { joint, alive: true, normal };
                self.offsets[usize::from(place)] = offset;
                place
            }
            None => {
                self.push_triangle(joint);
                self.triangles.len() as u16 - 1
            }
        };
        self.triangles[outer.triangle()].joint.across[outer.side()] = Half::new(place, 0);
        place
    }

    #[inline]
    fn join(&mut self, one: Option<Half>, other: Option<Half>) {
        if let (Some(one), Some(other)) = (one, other) {
            self.triangles[one.triangle()].joint.across[one.side()] = other;
            self.triangles[other.triangle()].joint.across[other.side()] = one;
        }
    }

    /// Drops what is no part of the surface any more.
    pub(super) fn compact(&mut self) {
        if !self.free.is_empty() {
            self.compact_triangles();
        }
        // On a convex surface all tips are in use.
        if self.folded {
            self.compact_tips();
        }
    }

    fn compact_triangles(&mut self) {
        self.renumbered.clear();
        let mut count = 0;
        for k in 0..self.triangles.len() {
            self.renumbered.push(count);
            if self.triangles[k].alive {
                self.triangles[usize::from(count)] = self.triangles[k];
                self.offsets[usize::from(count)] = self.offsets[k];
                count += 1;
            }
        }
        self.triangles.truncate(usize::from(count));
        self.offsets.truncate(usize::from(count));
        self.free.clear();
        for Triangle { joint, .. } in &mut self.triangles {
            joint.across = joint.across.map(|half| Half::new(self.renumbered[half.triangle()], half.side() as u16));
        }
    }

    fn compact_tips(&mut self) {
        const UNUSED: u16 = u16::MAX;
        self.renumbered.clear();
        self.renumbered.resize(self.tips.len(), UNUSED);
        for tip in self.triangles.iter().flat_map(|triangle| triangle.joint.tips) {
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
        for Triangle { joint, .. } in &mut self.triangles {
            joint.tips = joint.tips.map(|k| self.renumbered[usize::from(k)]);
        }
    }
}

/// The unit normal of the triangle p, q, r and the least height of its corners along it; zero and infinity if it is lower than
/// about `slack`.
#[inline]
pub(super) fn judged([p, q, r]: [DVec3; 3], slack: f64) -> (DVec3, f64) {
    let (u, v) = (q - p, r - p);
    let across = u.cross(v);
    let square = across.length_squared();
    // The third side is no longer than the sum of the two.
    if square <= slack * slack * (u.length_squared() + v.length_squared()) {
        return (DVec3::ZERO, f64::INFINITY);
    }
    let normal = across * (1.0 / square.sqrt());
    (normal, normal.dot(p).min(normal.dot(q)).min(normal.dot(r)))
}

/// The least of some values and where it is; infinity if there are none.
#[inline]
fn least(values: &[f64]) -> (usize, f64) {
    let (fours, rest) = values.as_chunks::<4>();
    let mut low = [f64::INFINITY; 4];
    let mut places = [0.0_f64; 4];
    let mut place = 0.0;
    for four in fours {
        for k in 0..4 {
            let lower = four[k] < low[k];
            places[k] = if lower { place } else { places[k] };
            low[k] = if lower { four[k] } else { low[k] };
        }
        place += 4.0;
    }
    let mut best = (0, f64::INFINITY);
    for k in 0..4 {
        if low[k] < best.1 {
            best = (places[k] as usize + k, low[k]);
        }
    }
    for (k, &value) in rest.iter().enumerate() {
        if value < best.1 {
            best = (fours.len() * 4 + k, value);
        }
    }
    best
}
