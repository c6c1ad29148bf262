//! Separation distance by Voronoi marching (in work: answers by GJK for now).

use super::Proximity;
use super::StopReason;
use super::gjk::gjk;
use crate::algebra::Placement;
use crate::body::{Feature, FeaturePair, Polytope};

/// The answer of a distance query and where to start the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct March {
    /// Apart or overlapping, in b's frame.
    pub proximity: Proximity,
    /// Where to start from next time.
    pub features: FeaturePair,
    /// Feature pairs visited, or iterations of the fallback.
    pub steps: u32,
    /// Why the search ended.
    pub stop: StopReason,
}

/// Finds the closest points of a and b; all of the answer is in b's frame. `pose_ba` is the frame of a in b.
pub fn march(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair) -> March {
    gjk(a, b, pose_ba, start)
}

/// A start for a pair without history: the vertices extreme along the line of the centroids.
pub fn initial_features(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> FeaturePair {
    let line = pose_ba.point(a.centroid()) - b.centroid();
    FeaturePair {
        a: Feature::Vertex(a.support_from(0, pose_ba.inverse_vector(-line))),
        b: Feature::Vertex(b.support_from(0, line)),
    }
}
