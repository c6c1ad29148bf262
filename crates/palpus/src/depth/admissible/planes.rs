//! Step 2 of the search, for planes: tries face normals and borrowed normals.

use super::Search;
use super::candidates::Kind;
use crate::body::{Feature, FeaturePair};

impl Search<'_> {
    /// Tries every admissible face normal and every borrowed normal of both pieces. Calls
    /// `candidate` with the kind and number of each facet that may be a candidate.
    pub(super) fn planes(&mut self, mut candidate: impl FnMut(Kind, u32)) {
        for own in self.b.faces() {
            if self.plane_of_b(own.face) {
                candidate(Kind::FaceOfB, own.face);
            }
        }
        for own in self.a.faces() {
            if self.plane_of_a(own.face) {
                candidate(Kind::FaceOfA, own.face);
            }
        }
        for k in 0..self.b.borrowed().len() {
            let index = (self.cso.b.face_count() + k) as u32;
            if self.plane_of_b(index) {
                candidate(Kind::BorrowedByB, index);
            }
        }
        for k in 0..self.a.borrowed().len() {
            let index = (self.cso.a.face_count() + k) as u32;
            if self.plane_of_a(index) {
                candidate(Kind::BorrowedByA, index);
            }
        }
    }

    /// Tries a plane of b. Returns false if the facet is not a candidate.
    #[inline]
    pub(super) fn plane_of_b(&mut self, index: u32) -> bool {
        let plane = self.b.plane(index);
        if !self.cap_a.holds(plane.normal) || self.known_a.reject(plane, self.bar + self.reach.path) {
            return false;
        }
        let a = self.cso.a.support_from(self.hub.a, self.cso.toward_b(plane.normal));
        self.look_from_a(a);
        let offset = -plane.height(self.known_a.newest());
        let is_near = offset < self.bar + self.reach.path;
        if offset < self.bar && self.a.vertex_admits(a, self.cso.toward_b(plane.normal)) {
            let features = FeaturePair { a: Feature::Vertex(a), b: self.b.feature(index) };
            self.take(plane.normal, offset, features);
        }
        is_near
    }

    /// Tries a plane of a, like [`Self::plane_of_b`].
    #[inline]
    pub(super) fn plane_of_a(&mut self, index: u32) -> bool {
        let plane = self.a.plane(index);
        if !self.cap_b.holds(plane.normal) || self.known_b.reject(plane, self.bar + self.reach.path) {
            return false;
        }
        let normal = -self.cso.pose_ba.vector(plane.normal);
        let b = self.cso.b.support_from(self.hub.b, normal);
        self.look_from_b(b);
        let offset = -plane.height(self.known_b.newest());
        let is_near = offset < self.bar + self.reach.path;
        if offset < self.bar && self.b.vertex_admits(b, normal) {
            let features = FeaturePair { a: self.a.feature(index), b: Feature::Vertex(b) };
            self.take(normal, offset, features);
        }
        is_near
    }
}
