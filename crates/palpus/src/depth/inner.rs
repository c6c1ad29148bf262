//! A closed surface of triangles inside the CSO that grows around the origin and proves a depth.
//!
//! The corners of the surface are differences of vertices of the two bodies. So the CSO contains
//! the corners and their hull, for every shape of the surface. Suppose that no triangle is nearer
//! to the origin than u, and that the surface winds around the origin. The surface then winds
//! around every point of the ball of radius u. So the CSO contains this ball, and no direction has
//! h(n) < u. The surface need not be convex or connected. The surface must only be closed, with
//! every edge used once in each direction. Every operation in this module keeps the surface closed.
//! The surface winds around the origin if the origin lies on the inner side of every triangle.
//!
//! 1. Start with a tetrahedron of supports, or with the surface of an earlier proof. Compute the
//!    corners of an earlier surface again at the new pose.
//! 2. Measure each triangle: compute its unit normal, and the least height of its corners along the
//!    normal. The triangle is at least that far from the origin, even if rounding tilts the normal.
//! 3. Grow the surface from a triangle to a new corner: remove the surrounding triangles that face
//!    the corner, and close the hole with a fan around the corner. Also remove triangles that
//!    already have this corner. If motion has folded the surface, this removal flips an edge.
//!
//! The list of triangles stays compact: new triangles take the places of removed triangles.
//!
//! A triangle of zero height lies on edges of other triangles, within the proof's precision. These
//! other triangles are measured in its place. A triangle of zero height counts as facing every
//! point, so it is removed together with its neighbours.

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

/// Edge `side` of a triangle, from its tip `side` to the next tip. Both numbers fit in one `u16`,
/// because [`PROOF_TRIANGLES`] is small enough.
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

/// A triangle with its corners, counter-clockwise as seen from outside. For each k, `across[k]` is
/// the neighbour's edge at the edge from tip k to the next tip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    pub(super) tips: [u16; 3],
    across: [Half; 3],
    /// False if the triangle was removed.
    alive: bool,
}

/// An edge on the rim of a hole: its two tips, and the edge of the triangle outside the hole. The
/// outer edge runs in the opposite direction.
#[derive(Clone, Copy, Debug)]
struct Rim {
    from: u16,
    to: u16,
    outer: Half,
}

/// The reason why a surface could not be grown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// No room for more tips or triangles.
    Full,
    /// The hole had no rim, because rounding has torn the surface.
    Torn,
}

/// The triangle that is nearest to the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) triangle: usize,
    pub(super) normal: DVec3,
    pub(super) offset: f64,
}

/// The surface. Its vectors have a fixed capacity.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    tips: Vec<Tip>,
    joints: Vec<Joint>,
    /// Outward unit normal of each triangle. The normal is zero if the triangle has no height.
    normals: Vec<DVec3>,
    /// For each triangle, the least height of its tips along the normal. The value is infinite if
    /// the triangle has no height or was removed.
    offsets: Vec<f64>,
    /// Lengths below this are rounding.
    slack: f64,
    /// True if motion may have folded the surface. A new support can then be an existing tip. A
    /// surface that was grown from a tetrahedron at this pose is convex.
    folded: bool,
    /// Places of removed triangles.
    free: Vec<u16>,
    /// Edges that the search has not crossed yet. Each is stored as an edge of the triangle on its
    /// far side.
    ahead: Vec<Half>,
    rim: Vec<Rim>,
    /// New numbers of the triangles or tips after unused triangles or tips were dropped.
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

    /// Empties the surface. Heights below `slack` are rounding. `folded` is true if the bodies have
    /// moved since the new content was grown.
    pub(super) fn clear(&mut self, slack: f64, folded: bool) {
        self.tips.clear();
        self.joints.clear();
        self.normals.clear();
        self.offsets.clear();
        self.free.clear();
        self.slack = slack;
        self.folded = folded;
    }

    /// Adds a tip to the list, but not to any triangle.
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

    /// Adds the surface of the tetrahedron with the four existing tips. Returns false if the
    /// tetrahedron has no volume.
    pub(super) fn close_tetrahedron(&mut self) -> bool {
        let [p, q, r, s] = [0, 1, 2, 3].map(|k| self.tips[k].at);
        let volume = (q - p).cross(r - p).dot(s - p);
        if volume == 0.0 {
            return false;
        }
        if volume > 0.0 {
            self.tips.swap(0, 1);
        }
        // If s is below the triangle pqr, pqr is counter-clockwise as seen from above.
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

    /// Returns the triangle that is nearest to the origin. If the origin lies outside some
    /// triangles, returns the triangle from which the origin is farthest. The offset is infinite if
    /// all triangles have zero height.
    #[inline]
    pub(super) fn nearest(&self) -> Nearest {
        let offset = least(&self.offsets);
        let triangle = self.offsets.iter().position(|&o| o == offset).unwrap_or(0);
        Nearest { triangle, normal: self.normals.get(triangle).copied().unwrap_or(DVec3::ZERO), offset }
    }

    /// Returns the hub pairs at the corners of a triangle.
    pub(super) fn hubs(&self, triangle: usize) -> [HubPair; 3] {
        self.joints[triangle].tips.map(|tip| self.tips[usize::from(tip)].hub)
    }

    pub(super) fn tips(&self) -> &[Tip] {
        &self.tips
    }

    /// Returns the triangles. Call [`Self::compact`] first to drop removed triangles.
    pub(super) fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Returns the offset of each triangle, in the order of [`Self::joints`].
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

/// Returns the unit normal of the triangle p, q, r, and the least height of its corners along the
/// normal. Returns zero and infinity if the triangle's height is less than about `slack`.
#[inline]
pub(super) fn judged([p, q, r]: [DVec3; 3], slack: f64) -> (DVec3, f64) {
    judged_from(p, [q, r], [q - p, r - p], slack * slack)
}

/// Returns the same as [`judged`], from the vectors u = q − p and v = r − p and the square of the
/// slack.
#[inline]
fn judged_from(p: DVec3, [q, r]: [DVec3; 2], [u, v]: [DVec3; 2], slack_squared: f64) -> (DVec3, f64) {
    let across = u.cross(v);
    let square = across.length_squared();
    // The third side is not longer than the sum of the other two.
    if square <= slack_squared * (u.length_squared() + v.length_squared()) {
        return (DVec3::ZERO, f64::INFINITY);
    }
    let normal = across * (1.0 / square.sqrt());
    (normal, normal.dot(p).min(normal.dot(q)).min(normal.dot(r)))
}

/// Returns the least of `values`; infinity if the list is empty. The values must not contain NaN.
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
