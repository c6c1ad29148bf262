//! Warm starts: the searches of a pair of nodes begin where they ended in the last query.
//!
//! Warm starts may be cleared at any time: they affect where searches start, not what they find.

use glam::DVec3;

use crate::body::{Feature, FeaturePair};

/// End of march and depth walk of a pair in the last query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmStart {
    /// The last closest features: where the march starts.
    pub features: FeaturePair,
    /// The normal of the last depth or of the last closest points: unit, from b into a, in b's
    /// frame; zero without one. Without a `facet`, this normal only separated the two.
    pub normal: DVec3,
    /// Vertices of a and b that support that normal.
    pub hub: [u32; 2],
    /// The features of the last depth, or of the last closest points within tolerance: the start of
    /// a depth walk. `None` if there is no start.
    pub facet: Option<FeaturePair>,
    /// The features of the last depth along a normal that both pieces own, where that was not the
    /// least depth.
    pub admissible: Option<FeaturePair>,
    /// The sum of the bodies' turns (rad) up to which no normal is owned by both pieces; minus
    /// infinity when nothing is known.
    pub(crate) barren_until: f64,
}

impl WarmStart {
    /// Warm start of a new pair.
    pub(super) const BLANK: Self = Self {
        features: FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) },
        normal: DVec3::ZERO,
        hub: [0; 2],
        facet: None,
        admissible: None,
        barren_until: f64::NEG_INFINITY,
    };
}
