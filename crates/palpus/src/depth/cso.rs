//! A pair of polytopes seen as one convex body: the Minkowski difference (CSO) of \[K02 §3.3\].
//!
//! The CSO is the Minkowski sum of b and the reflected −a: its vertices are `b − a` over hub pairs,
//! and its support offset along a unit n is `h(n) = max_b n·b − min_a n·a`. All of it is in b's
//! frame.

use glam::DVec3;

use super::HubPair;
use crate::algebra::Placement;
use crate::body::Polytope;
use crate::collision::support_gap;

/// The two polytopes and where a lies in b's frame.
#[derive(Clone, Copy)]
pub(super) struct Cso<'p> {
    pub(super) a: &'p Polytope,
    pub(super) b: &'p Polytope,
    /// `p_b = pose_ba.point(p_a)`.
    pub(super) pose_ba: &'p Placement,
}

impl Cso<'_> {
    /// The sum of both radii; relative tolerances are multiplied by it.
    pub(super) fn size(&self) -> f64 {
        self.a.radius() + self.b.radius()
    }

    /// Vertex `v` of a, in b's frame.
    #[inline]
    pub(super) fn point_a(&self, v: u32) -> DVec3 {
        self.pose_ba.point(self.a.vertex(v))
    }

    /// The vertex of the CSO that a hub pair makes.
    #[inline]
    pub(super) fn vertex(&self, hub: HubPair) -> DVec3 {
        self.b.vertex(hub.b) - self.point_a(hub.a)
    }

    /// h along the normal of face `f` of b, where vertex `v` of a supports it.
    #[inline]
    pub(super) fn offset_at_face_of_b(&self, f: u32, v: u32) -> f64 {
        -self.b.plane(f).height(self.point_a(v))
    }

    /// h along the reversed normal of face `f` of a, which is `normal` in b's frame, where vertex
    /// `v` of b supports it.
    #[inline]
    pub(super) fn offset_at_face_of_a(&self, f: u32, v: u32, normal: DVec3) -> f64 {
        normal.dot(self.b.vertex(v) - self.pose_ba.translation) + self.a.plane(f).offset
    }

    /// The direction along which a supports a contact of normal `normal`, in a's frame: into b.
    #[inline]
    pub(super) fn toward_b(&self, normal: DVec3) -> DVec3 {
        -self.pose_ba.inverse_vector(normal)
    }

    /// The hub pair that supports `normal`, climbing from `hint`, and `h(normal)` if that is unit.
    #[inline]
    pub(super) fn support(&self, hint: HubPair, normal: DVec3) -> (HubPair, f64) {
        let (gap, [a, b]) = support_gap(self.a, self.b, self.pose_ba, normal, [hint.a, hint.b]);
        (HubPair { a, b }, -gap)
    }

    /// As [`Self::support`], without a hint.
    #[inline]
    pub(super) fn support_anew(&self, normal: DVec3) -> (HubPair, f64) {
        let hub = HubPair { a: self.a.support(self.toward_b(normal)), b: self.b.support(normal) };
        (hub, normal.dot(self.vertex(hub)))
    }
}

/// `x / √length < bar`, without the root.
#[inline]
pub(super) fn below(x: f64, length: f64, bar: f64) -> bool {
    let (square, bar_square) = (x * x, bar * bar * length);
    if bar >= 0.0 { x < 0.0 || square < bar_square } else { x < 0.0 && square > bar_square }
}
