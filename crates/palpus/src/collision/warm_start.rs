//! Warm starts: the searches of a pair of nodes begin at the results of the last query.
//!
//! Warm starts may be cleared at any time. A warm start changes the start of a search, not its
//! result.

use glam::DVec3;

use crate::body::{Feature, FeaturePair};

/// Results of march and depth walk of a pair in the last query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmStart {
    /// The last closest features, at which the march starts.
    pub features: FeaturePair,
    /// The normal of the last depth or of the last closest points: unit, from b into a, in b's
    /// frame; zero if unknown. If `facet` is `None`, this normal only separates the nodes.
    pub normal: DVec3,
    /// Support vertices of a and b along this normal.
    pub hub: [u32; 2],
    /// The start of a depth walk: the features of the last depth, or of the last closest points
    /// within tolerance.
    pub facet: Option<FeaturePair>,
    /// The features of the last depth along a shared normal, if that was not the least depth.
    pub admissible: Option<FeaturePair>,
    /// Until the sum of relative rotations (rad) exceeds this value, the pieces share no normal.
    /// Minus infinity if unknown.
    pub(crate) inadmissible_until: f64,
}

impl WarmStart {
    /// Warm start of a new pair.
    pub(super) const BLANK: Self = Self {
        features: FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) },
        normal: DVec3::ZERO,
        hub: [0; 2],
        facet: None,
        admissible: None,
        inadmissible_until: f64::NEG_INFINITY,
    };
}
