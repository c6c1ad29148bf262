//! The two polytopes of a facet, as seen from the polytope that has the facet's face or edge.

use glam::DVec3;

use super::super::{Antipodal, HubPair};
use crate::algebra::Placement;
use crate::body::Polytope;

/// The two polytopes of a walk. The supporting plane turns about an edge of p until it meets an
/// edge at a vertex of q. With this view, each kind of facet needs only one implementation for both
/// orders of bodies a and b. Normals point out of p and are in p's frame. Their opposites point
/// out of q.
pub(super) struct View<'v> {
    pub(super) p: &'v Polytope,
    pub(super) q: &'v Polytope,
    pub(super) q_in_p: &'v Placement,
    pub(super) p_in_q: &'v Placement,
    pub(super) p_is_a: bool,
}

impl View<'_> {
    /// Returns the direction in q's frame that is opposite to p's `normal`.
    #[inline]
    pub(super) fn facing(&self, normal: DVec3) -> DVec3 {
        -self.p_in_q.vector(normal)
    }

    /// Returns the vertex of the CSO for vertex `v` of p and vertex `w` of q, in p's frame. The
    /// sign is chosen so that p's outward normals point out of the CSO.
    #[inline]
    pub(super) fn vertex(&self, v: u32, w: u32) -> DVec3 {
        self.p.vertex(v) - self.q_in_p.point(self.q.vertex(w))
    }

    #[inline]
    pub(super) fn hub(&self, v: u32, w: u32) -> HubPair {
        if self.p_is_a { HubPair { a: v, b: w } } else { HubPair { a: w, b: v } }
    }

    #[inline]
    pub(super) fn face(&self, face: u32, w: u32) -> Antipodal {
        if self.p_is_a { Antipodal::FaceVertex { a: face, b: w } } else { Antipodal::VertexFace { a: w, b: face } }
    }

    #[inline]
    pub(super) fn edges(&self, edge: u32, other: u32) -> Antipodal {
        if self.p_is_a { Antipodal::EdgeEdge { a: edge, b: other } } else { Antipodal::EdgeEdge { a: other, b: edge } }
    }
}

/// Returns the index of the side of face `f` beyond which `point` lies farthest.
pub(super) fn farthest_side(polytope: &Polytope, f: u32, point: DVec3) -> usize {
    let (corners, normal) = (polytope.face_vertices(f), polytope.plane(f).normal);
    let mut farthest = (f64::NEG_INFINITY, 0);
    for (k, corner) in corners.iter().enumerate() {
        let from = polytope.vertex(corner);
        let side = polytope.vertex(corners.at((k + 1) % corners.len())) - from;
        let outward = side.cross(normal);
        let beyond = outward.dot(point - from) / outward.length();
        if beyond > farthest.0 {
            farthest = (beyond, k);
        }
    }
    farthest.1
}
