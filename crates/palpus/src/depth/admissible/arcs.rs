//! Steps 2 and 3 of the search, for arcs: selects arcs of admissible normals, and crosses the
//! arcs of body a with the arcs of b.

use glam::DVec3;

use super::super::cso::below;
use super::super::overlay::{crosses_within, crossing};
use super::Search;
use super::candidates::Motion;
use crate::algebra::Placement;
use crate::algebra::tolerance::{ADMISSIBLE_CROSSINGS, CROSSING_GAIN, PARALLEL_EDGES};
use crate::body::{AdmissibleNormals, Feature, FeaturePair, SurfaceArc};
use crate::collision::StopReason;

/// An arc of admissible normals, in b's frame. An arc of body a belongs to the reflected body −a.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    edge: u32,
    /// The tail of the edge: a point of the body itself, not of its reflection.
    tail: DVec3,
    /// Vector from the tail to the head of the edge.
    along: DVec3,
    left: DVec3,
    right: DVec3,
}

impl Arc {
    pub(super) fn of(normals: &AdmissibleNormals<'_>, arc: &SurfaceArc) -> Self {
        let edge = normals.polytope().edge(arc.edge);
        let (tail, head) = (normals.polytope().vertex(edge.tail), normals.polytope().vertex(edge.head));
        let [left, right] = normals.ends(arc);
        Self { edge: arc.edge, tail, along: head - tail, left, right }
    }

    /// Returns this arc of body a as an arc of the reflected a, in b's frame.
    pub(super) fn reflected(self, pose_ba: &Placement) -> Self {
        let [along, left, right] = [self.along, self.left, self.right].map(|v| -pose_ba.vector(v));
        Self { edge: self.edge, tail: pose_ba.point(self.tail), along, left, right }
    }
}

/// An arc and its place among the arcs of its piece.
pub(super) type Listed = (usize, Arc);

impl Search<'_> {
    /// Tries every crossing of an arc of body a with an arc of b. Calls `candidate` with the places
    /// of two arcs that may cross after a small turn.
    pub(super) fn arcs(&mut self, [arcs_a, arcs_b]: [&mut Vec<Listed>; 2], mut candidate: impl FnMut([usize; 2])) {
        arcs_b.clear();
        for (place, own) in self.b.arcs().iter().enumerate() {
            let ends = [own.left, own.right].map(|plane| self.b.plane(plane));
            let [left, right] = ends.map(|plane| plane.normal);
            let bar = self.bar + self.reach.path;
            // The known supports reject most arcs.
            if !self.cap_a.may_meet(left, right) || self.known_a.reject_arc(ends, bar) {
                continue;
            }
            let a = self.cso.a.support_from(self.hub.a, self.cso.toward_b(left + right));
            self.look_from_a(a);
            if !self.known_a.reject_arc(ends, bar) {
                self.keep(arcs_b, (place, Arc::of(self.b, own)));
            }
        }
        if arcs_b.is_empty() {
            return;
        }
        arcs_a.clear();
        for (place, own) in self.a.arcs().iter().enumerate() {
            let ends = [own.left, own.right].map(|plane| self.a.plane(plane));
            let [left, right] = ends.map(|plane| plane.normal);
            let bar = self.bar + self.reach.path;
            if !self.cap_b.may_meet(left, right) || self.known_b.reject_arc(ends, bar) {
                continue;
            }
            let [left, right] = [left, right].map(|normal| -self.cso.pose_ba.vector(normal));
            let b = self.cso.b.support_from(self.hub.b, left + right);
            self.look_from_b(b);
            if !self.known_b.reject_arc(ends, bar) {
                self.keep(arcs_a, (place, Arc::of(self.a, own).reflected(self.cso.pose_ba)));
            }
        }
        let Motion { turn, .. } = self.reach;
        let mut looks = 0;
        for (place_a, a) in &*arcs_a {
            looks += arcs_b.len();
            if looks > ADMISSIBLE_CROSSINGS {
                self.stop = StopReason::Budget;
                return;
            }
            for (place_b, b) in &*arcs_b {
                if turn > 0.0 && crosses_within([a.left, a.right], a.along, [b.left, b.right], b.along, turn) {
                    candidate([*place_a, *place_b]);
                }
                self.cross(a, b);
            }
        }
    }

    fn keep(&mut self, arcs: &mut Vec<Listed>, arc: Listed) {
        if arcs.len() < arcs.capacity() {
            arcs.push(arc);
        } else {
            self.stop = StopReason::Budget;
        }
    }

    /// Tries the facet of two edges, if their arcs cross.
    #[inline]
    pub(super) fn cross(&mut self, a: &Arc, b: &Arc) {
        let Some(across) = crossing([a.left, a.right], a.along, [b.left, b.right], b.along) else { return };
        // A crossing at the end of an arc is as deep as the plane there, and the plane is
        // preferred.
        let bar = self.bar - CROSSING_GAIN * self.cso.size();
        let length = across.length_squared();
        let nearly = PARALLEL_EDGES * PARALLEL_EDGES * a.along.length_squared() * b.along.length_squared();
        if length <= nearly || !below(across.dot(b.tail - a.tail), length, bar) {
            return;
        }
        let normal = across.normalize_or_zero();
        let (hub, offset) = self.cso.support(self.hub, normal);
        self.look_from_b(hub.b);
        self.look_from_a(hub.a);
        if offset < bar {
            let features = FeaturePair { a: Feature::Edge(a.edge), b: Feature::Edge(b.edge) };
            self.take(normal, offset, features);
        }
    }
}
