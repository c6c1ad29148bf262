//! Where the searches of a pair of nodes start: where they ended in the last query.
//!
//! It may be cleared at any time: it decides where searches start, not what they find.

use glam::DVec3;

use crate::body::{Feature, FeaturePair};

/// Where march and depth walk of a pair ended in the last query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarmStart {
    /// The last closest features: where the march starts.
    pub features: FeaturePair,
    /// The normal of the last depth or of the last closest points: unit, from b into a, in b's
    /// frame; zero when there is none. Without a `facet` it only has separated the two.
    pub normal: DVec3,
    /// Vertices of a and b that support that normal.
    pub hub: [u32; 2],
    /// The features that the last depth, or the last closest points within tolerance, rest on:
    /// where a depth walk starts; none when there are none.
    pub facet: Option<FeaturePair>,
    /// The features of the last depth along a normal that both pieces own, where that was not the
    /// least depth.
    pub admissible: Option<FeaturePair>,
    /// The sum of the bodies' turns (rad) up to which no normal is owned by both pieces; minus
    /// infinity when nothing is known.
    pub(crate) barren_until: f64,
}

impl WarmStart {
    /// Of a pair of which nothing is known.
    pub(super) const BLANK: Self = Self {
        features: FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) },
        normal: DVec3::ZERO,
        hub: [0; 2],
        facet: None,
        admissible: None,
        barren_until: f64::NEG_INFINITY,
    };
}
