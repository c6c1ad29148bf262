//! The Minkowski difference (CSO) of a pair of polytopes, as one convex body \[K02 §3.3\].
//!
//! The CSO is the Minkowski sum of b and the reflected body −a. Its vertices are `b − a` over the
//! hub pairs. Its support offset along a unit n is `h(n) = max_b n·b − min_a n·a`. All values are
//! in b's frame.

use glam::DVec3;

use super::HubPair;
use crate::algebra::Placement;
use crate::body::Polytope;
use crate::collision::support_gap;

/// The two polytopes, and the pose of body a in b's frame.
#[derive(Clone, Copy)]
pub(super) struct Cso<'p> {
    pub(super) a: &'p Polytope,
    pub(super) b: &'p Polytope,
    /// `p_b = pose_ba.point(p_a)`.
    pub(super) pose_ba: &'p Placement,
}

impl Cso<'_> {
    /// Returns the sum of both radii. Tolerances relative to the pair's size are multiplied by this
    /// sum.
    pub(super) fn size(&self) -> f64 {
        self.a.radius() + self.b.radius()
    }

    /// Returns vertex `v` of body a in b's frame.
    #[inline]
    pub(super) fn point_a(&self, v: u32) -> DVec3 {
        self.pose_ba.point(self.a.vertex(v))
    }

    /// Returns the vertex of the CSO for a hub pair.
    #[inline]
    pub(super) fn vertex(&self, hub: HubPair) -> DVec3 {
        self.b.vertex(hub.b) - self.point_a(hub.a)
    }

    /// Returns h along the normal of face `f` of b. Vertex `v` of body a must support this normal.
    #[inline]
    pub(super) fn offset_at_face_of_b(&self, f: u32, v: u32) -> f64 {
        -self.b.plane(f).height(self.point_a(v))
    }

    /// Returns h along `normal`, the reversed normal of face `f` of body a in b's frame. Vertex
    /// `v` of b must support this normal.
    #[inline]
    pub(super) fn offset_at_face_of_a(&self, f: u32, v: u32, normal: DVec3) -> f64 {
        normal.dot(self.b.vertex(v) - self.pose_ba.translation) + self.a.plane(f).offset
    }

    /// Returns the direction from a into b, in a's frame, for a contact with normal `normal`.
    #[inline]
    pub(super) fn toward_b(&self, normal: DVec3) -> DVec3 {
        -self.pose_ba.inverse_vector(normal)
    }

    /// Returns the hub pair that supports `normal`, climbing from `hint`. The second value is
    /// `h(normal)` if `normal` has unit length.
    #[inline]
    pub(super) fn support(&self, hint: HubPair, normal: DVec3) -> (HubPair, f64) {
        let (gap, [a, b]) = support_gap(self.a, self.b, self.pose_ba, normal, [hint.a, hint.b]);
        (HubPair { a, b }, -gap)
    }

    /// Returns the same as [`Self::support`], without a hint.
    #[inline]
    pub(super) fn support_anew(&self, normal: DVec3) -> (HubPair, f64) {
        let hub = HubPair { a: self.a.support(self.toward_b(normal)), b: self.b.support(normal) };
        (hub, normal.dot(self.vertex(hub)))
    }
}

/// Returns true if `x / √length < bar`, without computing the root.
#[inline]
pub(super) fn below(x: f64, length: f64, bar: f64) -> bool {
    let (square, bar_square) = (x * x, bar * bar * length);
    if bar >= 0.0 { x < 0.0 || square < bar_square } else { x < 0.0 && square > bar_square }
}
