//! The answer of a distance query between two convex polytopes.

use glam::DVec3;

use crate::body::FeaturePair;

/// Result of a distance search: two convex polytopes are apart or overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Proximity {
    /// They are apart; the closest points.
    Disjoint(Closest),
    /// They touch or overlap, with the place at which the search detected it.
    Overlapping(Overlap),
}

/// The closest points of two disjoint polytopes, in b's frame;
/// `point_a − point_b = distance · normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// On a.
    pub point_a: DVec3,
    /// On b.
    pub point_b: DVec3,
    /// Unit, from b into a.
    pub normal: DVec3,
    /// Greater than zero.
    pub distance: f64,
    /// The features that hold the two points in their relative interiors (within rounding).
    pub features: FeaturePair,
}

/// Result of the distance search for an overlap: a start for the depth walk \[K02 §3.3.2\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    /// The feature pair at which the overlap was detected.
    pub features: FeaturePair,
    /// A direction, from b into a and in b's frame, along which the depth is likely small; need not
    /// be unit.
    pub direction: DVec3,
}

/// How a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StopReason {
    /// It found its result.
    Converged,
    /// It stopped making progress (a repeat or a cycle) and the fallback answered.
    Stalled,
    /// It used up its step budget; the fallback answered, or the best so far was returned.
    Budget,
}

/// The result of a distance query, and the start of the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct March {
    /// Apart or overlapping, in b's frame.
    pub proximity: Proximity,
    /// Features from which the next search starts.
    pub features: FeaturePair,
    /// Feature pairs visited, the fallback's iterations included.
    pub steps: u32,
    /// `Converged` if the result is the march's; otherwise the reason for the fallback.
    pub stop: StopReason,
}

impl March {
    /// The distance; zero for an overlap.
    pub(super) fn distance(&self) -> f64 {
        match self.proximity {
            Proximity::Disjoint(Closest { distance, .. }) => distance,
            Proximity::Overlapping(_) => 0.0,
        }
    }

    /// True if the two overlap or are nearer than the tolerance.
    pub(super) fn is_within(&self, tolerance: f64) -> bool {
        matches!(self.proximity, Proximity::Overlapping(_)) || self.distance() < tolerance
    }
}
