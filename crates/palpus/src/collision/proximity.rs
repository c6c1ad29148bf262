//! The result of a distance query between two convex polytopes.

use glam::DVec3;

use crate::body::FeaturePair;

/// Result of a distance search: two convex polytopes are apart or overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Proximity {
    /// The polytopes are apart. The value contains their closest points.
    Disjoint(Closest),
    /// The polytopes touch or overlap. The value describes where the search detected the overlap.
    Overlapping(Overlap),
}

/// The closest points of two disjoint polytopes, in b's frame;
/// `point_a − point_b = distance · normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Closest point on a.
    pub point_a: DVec3,
    /// Closest point on b.
    pub point_b: DVec3,
    /// Unit vector from b into a.
    pub normal: DVec3,
    /// Distance of the points, model units; greater than zero.
    pub distance: f64,
    /// The features whose relative interiors contain the two points (within rounding).
    pub features: FeaturePair,
}

/// Result of the distance search for an overlap: a start for the depth walk \[K02 §3.3.2\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The feature pair at which the overlap was detected.
    pub features: FeaturePair,
    /// A direction from b into a, in b's frame, along which the depth is likely small. It is not
    /// always unit.
    pub direction: DVec3,
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StopReason {
    /// The search found its result.
    Converged,
    /// The search made no progress or repeated a state; the fallback gave the result.
    Stalled,
    /// The search used up its steps. The fallback gave the result, or the best result so far was
    /// returned.
    Budget,
}

/// The result of a distance query, and the start of the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct March {
    /// The distance and the closest points, or an overlap; vectors are in b's frame.
    pub proximity: Proximity,
    /// Features from which the next search starts.
    pub features: FeaturePair,
    /// Number of visited feature pairs, plus iterations of the fallback.
    pub steps: u32,
    /// `Converged` if the march found the result; otherwise the reason for the fallback.
    pub stop: StopReason,
}

impl March {
    /// Returns the distance; zero for an overlap.
    pub(super) fn distance(&self) -> f64 {
        match self.proximity {
            Proximity::Disjoint(Closest { distance, .. }) => distance,
            Proximity::Overlapping(_) => 0.0,
        }
    }

    /// Returns true if the polytopes overlap or are nearer than the tolerance.
    pub(super) fn is_within(&self, tolerance: f64) -> bool {
        matches!(self.proximity, Proximity::Overlapping(_)) || self.distance() < tolerance
    }
}
