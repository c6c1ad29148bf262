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
    across: [Half; 3],
    /// False for one that was taken away.
    alive: bool,
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
    joints: Vec<Joint>,
    /// Of each triangle: outward and unit; zero for one of no height.
    normals: Vec<DVec3>,
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
            joints: Vec::with_capacity(PROOF_TRIANGLES),
            normals: Vec::with_capacity(PROOF_TRIANGLES),
            offsets: Vec::with_capacity(PROOF_TRIANGLES),
            slack: 0.0,
            folded: false,
            free: Vec::with_capacity(PROOF_TRIANGLES),
            ahead: Vec::with_capacity(PROOF_HOLE + 3),
            rim: Vec::with_capacity(PROOF_HOLE),
            renumbered: Vec::with_capacity(PROOF_TRIANGLES),
        }
    }

    /// Empties the surface; `slack` is the length below which a height is rounding, and `folded` tells that what follows
    /// was moved since it was grown.
    pub(super) fn clear(&mut self, slack: f64, folded: bool) {
        self.tips.clear();
        self.joints.clear();
        self.normals.clear();
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
        self.joints.push(joint);
        self.normals.push(normal);
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
        let faces = [
            ([0, 1, 2], [(1, 0), (2, 0), (3, 0)]),
            ([1, 0, 3], [(0, 0), (3, 2), (2, 1)]),
            ([2, 1, 3], [(0, 1), (1, 2), (3, 1)]),
            ([0, 2, 3], [(0, 2), (2, 2), (1, 1)]),
        ];
        for (tips, across) in faces {
            let across = across.map(|(triangle, side)| Half::new(triangle, side));
            self.push_triangle(Joint { tips, across, alive: true });
        }
        true
    }

    /// The triangle that comes nearest to the origin, or has it farthest outside. Its offset is infinite if no triangle has a height.
    #[inline]
    pub(super) fn nearest(&self) -> Nearest {
        let offset = least(&self.offsets);
        let triangle = self.offsets.iter().position(|&o| o == offset).unwrap_or(0);
        Nearest { triangle, normal: self.normals.get(triangle).copied().unwrap_or(DVec3::ZERO), offset }
    }

    /// The hub pairs at the corners of a triangle.
    pub(super) fn hubs(&self, triangle: usize) -> [HubPair; 3] {
        self.joints[triangle].tips.map(|tip| self.tips[usize::from(tip)].hub)
    }

    pub(super) fn tips(&self) -> &[Tip] {
        &self.tips
    }

    /// The triangles, once [`Self::compact`] has dropped those that are none any more.
    pub(super) fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Parallel to [`Self::joints`].
    pub(super) fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// Grows the surface from `triangle` to the tip of `hub`, which should lie above it.
    pub(super) fn grow(&mut self, cso: &Cso<'_>, triangle: usize, hub: HubPair) -> Result<(), Refusal> {
        let at = cso.vertex(hub);
        let known = if self.folded { self.known(at) } else { None };
        self.open(triangle, at, known)?;
        if self.joints.len() + self.rim.len() > PROOF_TRIANGLES + self.free.len() {
            return Err(Refusal::Full);
        }
        if let Some(tip) = known {
            self.order_rim()?;
            self.fan(tip);
            return Ok(());
        }
        if self.tips.len() == PROOF_CORNERS {
            return Err(Refusal::Full);
        }
        let tip = self.tips.len() as u16;
        self.tips.push(Tip { hub, at });
        if self.is_ring() {
            self.fan_ring(tip);
        } else {
            self.order_rim()?;
            self.fan(tip);
        }
        Ok(())
    }

    /// The tip that lies there.
    #[cold]
    fn known(&self, at: DVec3) -> Option<u16> {
        let near = self.slack * self.slack;
        self.tips.iter().position(|tip| tip.at.distance_squared(at) <= near).map(|tip| tip as u16)
    }

    /// Takes away the triangles around `seed` that see the point `at` or have the tip `known` there, and lists the rim of the hole.
    ///
    /// Each is crossed from the edge by which it was reached, counter-clockwise, so that the rim comes in order if the hole
    /// is a disk.
    fn open(&mut self, seed: usize, at: DVec3, known: Option<u16>) -> Result<(), Refusal> {
        const ONWARD: [[usize; 2]; 4] = [[1, 2], [2, 0], [0, 1], [0, 1]];
        let Self { joints, normals, offsets, free, ahead, rim, .. } = self;
        // The tip of a convex surface may lie in a neighbour's plane and beyond the edge to it: unless that gives way too, it is folded
        // under. Moved along with the bodies, what lies in the plane may have the tip already.
        let least = if self.folded { self.slack } else { -self.slack };
        rim.clear();
        ahead.clear();
        joints[seed].alive = false;
        offsets[seed] = f64::INFINITY;
        free.push(seed as u16);
        let [mut half, two, three] = joints[seed].across;
        ahead.push(three);
        ahead.push(two);
        let mut room = PROOF_HOLE;
        loop {
            let place = half.triangle();
            let outer = &mut joints[place];
            if outer.alive {
                if room == 0 {
                    return Err(Refusal::Full);
                }
                room -= 1;
                let [next, last] = ONWARD[half.side()];
                let offset = offsets[place];
                let gives_way = normals[place].dot(at) - offset > least
                    || offset.is_infinite()
                    || known.is_some_and(|tip| outer.tips.contains(&tip));
                if gives_way {
                    outer.alive = false;
                    offsets[place] = f64::INFINITY;
                    free.push(place as u16);
                    ahead.push(outer.across[last]);
                    half = outer.across[next];
                    continue;
                }
                rim.push(Rim { from: outer.tips[next], to: outer.tips[half.side()], outer: half });
            }
            match ahead.pop() {
                Some(next) => half = next,
                None => return Ok(()),
            }
        }
    }

    /// True if the rim runs around once, in order.
    #[inline]
    fn is_ring(&self) -> bool {
        let Some(last) = self.rim.last() else { return false };
        let mut end = last.to;
        self.rim.iter().all(|edge| {
            let follows = edge.from == end;
            end = edge.to;
            follows
        })
    }

    /// Closes a hole whose rim is a ring with a fan about a new tip.
    fn fan_ring(&mut self, tip: u16) {
        let Self { tips, joints, normals, offsets, free, rim, .. } = self;
        // As many places as the rim has edges, at the end of the free ones.
        while free.len() < rim.len() {
            free.push(joints.len() as u16);
            let across = [Half::new(0, 0); 3];
            joints.push(Joint { tips: [0; 3], across, alive: false });
            normals.push(DVec3::ZERO);
            offsets.push(f64::INFINITY);
        }
        let rest = free.len() - rim.len();
        let places = &free[rest..];
        let (Some(&first), Some(&last), Some(edge)) = (places.first(), places.last(), rim.first()) else { return };
        let at = tips[usize::from(tip)].at;
        let mut before = last;
        let mut p = tips[usize::from(edge.from)].at;
        let (mut u, least_height) = (p - at, self.slack * self.slack);
        for (k, (&Rim { from, to, outer }, &here)) in rim.iter().zip(places).enumerate() {
            let after = places.get(k + 1).copied().unwrap_or(first);
            let q = tips[usize::from(to)].at;
            let v = q - at;
            let place = usize::from(here);
            joints[outer.triangle()].across[outer.side()] = Half::new(here, 0);
            let across = [outer, Half::new(after, 2), Half::new(before, 1)];
            joints[place] = Joint { tips: [from, to, tip], across, alive: true };
            (normals[place], offsets[place]) = judged_from(at, [p, q], [u, v], least_height);
            (p, u, before) = (q, v, here);
        }
        free.truncate(rest);
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
    fn place(&mut self, tips: [u16; 3], outer: Half) -> u16 {
        let joint = Joint { tips, across: [outer; 3], alive: true };
        let place = match self.free.pop() {
            Some(place) => {
                let k = usize::from(place);
                (self.normals[k], self.offsets[k]) = judged(tips.map(|tip| self.tips[usize::from(tip)].at), self.slack);
                self.joints[k] = joint;
                place
            }
            None => {
                self.push_triangle(joint);
                self.joints.len() as u16 - 1
            }
        };
        self.joints[outer.triangle()].across[outer.side()] = Half::new(place, 0);
        place
    }

    #[inline]
    fn join(&mut self, one: Option<Half>, other: Option<Half>) {
        if let (Some(one), Some(other)) = (one, other) {
            self.joints[one.triangle()].across[one.side()] = other;
            self.joints[other.triangle()].across[other.side()] = one;
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
        for k in 0..self.joints.len() {
            self.renumbered.push(count as u16);
            if self.joints[k].alive {
                self.joints[count] = self.joints[k];
                self.normals[count] = self.normals[k];
                self.offsets[count] = self.offsets[k];
                count += 1;
            }
        }
        self.joints.truncate(count);
        self.normals.truncate(count);
        self.offsets.truncate(count);
        self.free.clear();
        for joint in &mut self.joints {
            joint.across = joint.across.map(|half| Half::new(self.renumbered[half.triangle()], half.side() as u16));
        }
    }

    fn compact_tips(&mut self) {
        const UNUSED: u16 = u16::MAX;
        self.renumbered.clear();
        self.renumbered.resize(self.tips.len(), UNUSED);
        for tip in self.joints.iter().flat_map(|joint| joint.tips) {
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
        for joint in &mut self.joints {
            joint.tips = joint.tips.map(|k| self.renumbered[usize::from(k)]);
        }
    }
}

/// The unit normal of the triangle p, q, r and the least height of its corners along it; zero and infinity if it is lower than
/// about `slack`.
#[inline]
pub(super) fn judged([p, q, r]: [DVec3; 3], slack: f64) -> (DVec3, f64) {
    judged_from(p, [q, r], [q - p, r - p], slack * slack)
}

/// The same for the triangle p, q, r with u = q − p and v = r − p, and the square of the slack.
#[inline]
fn judged_from(p: DVec3, [q, r]: [DVec3; 2], [u, v]: [DVec3; 2], slack_squared: f64) -> (DVec3, f64) {
    let across = u.cross(v);
    let square = across.length_squared();
    // The third side is no longer than the sum of the two.
    if square <= slack_squared * (u.length_squared() + v.length_squared()) {
        return (DVec3::ZERO, f64::INFINITY);
    }
    let normal = across * (1.0 / square.sqrt());
    (normal, normal.dot(p).min(normal.dot(q)).min(normal.dot(r)))
}

/// The least of some values, none of which is NaN; infinity if there are none.
#[inline]
fn least(values: &[f64]) -> f64 {
    let (fours, rest) = values.as_chunks::<4>();
    let lower = |x: f64, y: f64| if y < x { y } else { x };
    let mut low = [f64::INFINITY; 4];
    for four in fours {
        low = std::array::from_fn(|k| lower(low[k], four[k]));
    }
    rest.iter().fold(lower(lower(low[0], low[1]), lower(low[2], low[3])), |low, &value| lower(low, value))
}
