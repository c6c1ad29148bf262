//! Containment at any pose, with a test of whether the surfaces cross.

use glam::DVec3;

use super::containment::{Containment, containment, first_vertices};
use super::surfaces::Surfaces;
use crate::algebra::Pose;
use crate::body::Body;

/// A query for whether one of two bodies lies in the other.
#[derive(Clone, Debug)]
pub struct ContainmentQuery<'a> {
    a: &'a Body,
    b: &'a Body,
    components_a: Vec<DVec3>,
    components_b: Vec<DVec3>,
}

impl<'a> ContainmentQuery<'a> {
    /// Prepares the query for `a` and `b`. A body whose surface is not closed has no inside and
    /// contains nothing.
    pub fn new(a: &'a Body, b: &'a Body) -> Self {
        Self { a, b, components_a: first_vertices(a.mesh()), components_b: first_vertices(b.mesh()) }
    }

    /// Returns the result with body a at `pose_ba` in b's frame. The result is exact for the
    /// rounded positions of the vertices.
    pub fn run(&self, pose_ba: &Pose) -> Containment {
        let answer = containment(self.a, &self.components_a, self.b, &self.components_b, pose_ba, DVec3::ZERO);
        if answer == Containment::Neither {
            return answer;
        }
        let surfaces = Surfaces::new((self.a, &self.components_a), (self.b, &self.components_b), pose_ba);
        if surfaces.crossings(DVec3::ZERO, 1).is_empty() { answer } else { Containment::Neither }
    }
}
