//! A closed surface of triangles within the CSO, grown about the origin. It proves a depth.
//!
//! Its corners are differences of vertices of the two bodies, so the CSO holds them and their hull,
//! whatever the surface looks like. If no triangle comes nearer to the origin than u and the
//! surface winds around the origin, it winds around every point of the ball of radius u; so the CSO
//! holds that ball, and no direction has h(n) < u. The surface need be neither convex nor connected
//! for that. It only has to be closed, with every edge used once in each direction, and every
//! operation here preserves that. It winds around the origin if the origin lies on the inner side
//! of every triangle.
//!
//! 1. Begin with a tetrahedron of supports (cold), or with what an earlier proof left, its corners
//!    moved along with the bodies.
//! 2. Measure each triangle: compute its unit normal and the least height of its corners along the
//!    normal. The triangle is at least that far from the origin, even if rounding tilts the normal.
//! 3. Grow the surface from a triangle to a new corner: remove the surrounding triangles that face
//!    the corner, and close the hole with a fan about the corner. Triangles that already have this
//!    corner are also removed; this flips an edge if motion has folded the surface.
//!
//! The list of triangles has no gaps: new triangles take the places of the removed ones.
//!
//! A triangle without height lies, within the proof's precision, on edges that other triangles
//! share, and those are measured. It counts as facing every point, so that it is removed together
//! with its neighbours.

mod grow;
mod validate;

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

/// Edge `side` of a triangle, from its tip `side` to the next. [`PROOF_TRIANGLES`] leaves room for
/// both in one number.
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

/// A triangle's corners, counter-clockwise seen from outside, and what lies across the edge from
/// tip k to the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    pub(super) tips: [u16; 3],
    across: [Half; 3],
    /// False for one that was taken away.
    alive: bool,
}

/// An edge around a hole: from one tip to the next, and the edge of the triangle outside, which
/// runs the other way.
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
    /// Outward unit normal of each triangle; zero without height.
    normals: Vec<DVec3>,
    /// For each triangle, the least height of its tips along the normal; infinite for one of no
    /// height, and for one that was taken away.
    offsets: Vec<f64>,
    /// Lengths below this are rounding.
    slack: f64,
    /// True if motion may have folded the surface, so that a support can be one of its tips. A
    /// surface grown from nothing is convex.
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

    /// Empties the surface; `slack` is the length below which a height is rounding, and `folded`
    /// tells that what follows was moved since it was grown.
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

    /// The triangle that comes nearest to the origin, or whose outer side has the origin at the
    /// largest distance. Its offset is infinite if no triangle has a height.
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

    /// Returns the triangles; [`Self::compact`] must have dropped the removed ones.
    pub(super) fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Parallel to [`Self::joints`].
    pub(super) fn offsets(&self) -> &[f64] {
        &self.offsets
    }

    /// Drops triangles and tips that are no longer part of the surface.
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

/// The unit normal of the triangle p, q, r and the least height of its corners along it; zero and
/// infinity if it is lower than about `slack`.
#[inline]
pub(super) fn judged([p, q, r]: [DVec3; 3], slack: f64) -> (DVec3, f64) {
    judged_from(p, [q, r], [q - p, r - p], slack * slack)
}

/// As [`judged`], for the triangle p, q, r with u = q − p and v = r − p, given the square of the
/// slack.
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

/// The least of some values, no NaN among them; infinity for no value.
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
