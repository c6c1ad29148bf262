//! The plane between two bodies that are apart.
//!
//! A query with limited work may leave pairs of pieces that it has not examined. If the convex
//! hulls of both bodies are apart, none of these pairs is nearer than the hulls, and the bodies
//! cannot touch while they slide along the plane between the hulls, or part from it. So a tool that
//! is lifted off a face with ten thousand triangles is not held until all of them are examined.

use glam::DVec3;

use super::query_input::QueryInput;
use crate::algebra::Placement;
use crate::body::{FeaturePair, Polytope};
use crate::collision::{Closest, Proximity, TraversalCounters, initial_features, march, support_gap};

/// Two parallel planes; one body lies beyond the first, the other beyond the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeparatingPlane {
    /// Unit normal of the planes, from b into a, in b's frame.
    pub(crate) normal: DVec3,
    /// Distance of the planes, model units.
    pub(crate) gap: f64,
    /// True if the distance has not shrunk since the last query.
    recedes: bool,
}

/// Searches the plane, from the result of the last search.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PlaneSearch {
    features: Option<FeaturePair>,
    /// The plane that this query has found.
    pub(super) found: Option<SeparatingPlane>,
    /// Placement of a in the last query.
    last: Option<Placement>,
}

impl PlaneSearch {
    /// Drops all cached data.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Begins a query, without a plane.
    pub(super) fn begin(&mut self) {
        self.found = None;
    }

    /// Searches a plane between the hulls.
    pub(super) fn search(&mut self, input: &QueryInput<'_>, counters: &mut TraversalCounters) {
        let [hull_a, hull_b] = hulls(input);
        let start = self.features.unwrap_or_else(|| initial_features(hull_a, hull_b, &input.place));
        let answer = march(hull_a, hull_b, &input.place, start);
        self.features = Some(answer.features);
        counters.hull_tests += 1;
        counters.march_steps += answer.steps;
        if let Proximity::Disjoint(Closest { normal, distance: gap, features, .. }) = answer.proximity {
            let hub = [features.a.some_vertex(hull_a), features.b.some_vertex(hull_b)];
            let before = self.last.map(|last| support_gap(hull_a, hull_b, &last, normal, hub).0);
            let recedes = before.is_some_and(|before| before <= gap);
            self.found = Some(SeparatingPlane { normal, gap, recedes });
        }
    }

    /// Returns true if the bodies part from the plane, and their distance from each other is at
    /// least `offset` (model units).
    pub(super) fn is_receding(&self, offset: f64) -> bool {
        self.found.is_some_and(|plane| plane.recedes && plane.gap >= offset)
    }

    /// Ends a query at this placement of a.
    pub(super) fn end(&mut self, place: &Placement) {
        self.last = Some(*place);
    }
}

/// Returns the convex hulls of both bodies.
fn hulls<'q>(input: &QueryInput<'q>) -> [&'q Polytope; 2] {
    [input.a, input.b].map(|body| body.hierarchy().polytope(body.hierarchy().root(), body.polytopes()))
}
