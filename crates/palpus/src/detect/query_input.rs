//! The input of a query.

use super::QuerySettings;
use super::sample::Range;
use crate::algebra::{Placement, Pose};
use crate::body::{AdmissibleNormals, Body, Polytope};
use crate::collision::{LeafPair, PlacedPair, Side};

/// Input of a query.
#[derive(Clone, Copy)]
pub(super) struct QueryInput<'q> {
    pub(super) settings: &'q QuerySettings,
    pub(super) a: &'q Body,
    pub(super) b: &'q Body,
    /// a placed in b's frame.
    pub(super) pose_ba: Pose,
    /// `pose_ba` as a matrix.
    pub(super) place: Placement,
    /// Contacts are searched below this separation, in model units.
    pub(super) tolerance: f64,
    /// Contacts press below this separation, in model units.
    offset: f64,
}

impl<'q> QueryInput<'q> {
    /// Returns the input of a query with these settings at a pose.
    pub(super) fn new(a: &'q Body, b: &'q Body, pose_ba: &Pose, settings: &'q QuerySettings) -> Self {
        let QuerySettings { tolerance, contact_offset, .. } = *settings;
        let offset = contact_offset.map_or(tolerance, |offset| offset.min(tolerance));
        Self { settings, a, b, pose_ba: *pose_ba, place: pose_ba.placement(), tolerance, offset }
    }

    /// Returns two separations: contacts are searched below the first, and press below the second.
    pub(super) fn range(&self) -> Range {
        Range { tolerance: self.tolerance, offset: self.offset }
    }

    /// True if a body is open, so that it has no inside.
    pub(super) fn is_open(&self) -> bool {
        !(self.a.mesh().is_closed() && self.b.mesh().is_closed())
    }

    /// Returns the pieces of a and of b at these indices.
    pub(super) fn pieces(&self, piece_a: u32, piece_b: u32) -> (&'q Polytope, &'q Polytope) {
        (&self.a.polytopes()[piece_a as usize], &self.b.polytopes()[piece_b as usize])
    }

    /// Returns the admissible normals of both pieces of a leaf pair.
    pub(super) fn admissible_normals(&self, leaf: &LeafPair) -> [AdmissibleNormals<'q>; 2] {
        [self.a.admissible_normals(leaf.piece_a), self.b.admissible_normals(leaf.piece_b)]
    }

    /// Returns this input in the form that the front needs.
    pub(super) fn placed(&self) -> PlacedPair<'_> {
        PlacedPair { offset: self.offset, ..PlacedPair::new(side(self.a), side(self.b), &self.place, self.tolerance) }
    }

    /// Returns this input at another pose.
    pub(super) fn at(self, pose_ba: &Pose) -> Self {
        Self { pose_ba: *pose_ba, place: pose_ba.placement(), ..self }
    }
}

/// Returns a body in the form that the front needs.
pub(super) fn side(body: &Body) -> Side<'_> {
    Side { hierarchy: body.hierarchy(), pieces: body.polytopes() }
}
