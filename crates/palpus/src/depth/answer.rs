//! Result of a penetration-depth query between two convex polytopes.

use glam::DVec3;

use crate::body::FeaturePair;
use crate::collision::StopReason;

/// A pair of vertices whose normal cones overlap. The walk examines the CSO locally around a hub
/// pair \[K02 §3.3.1\].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HubPair {
    /// Vertex of body a.
    pub a: u32,
    /// Vertex of b.
    pub b: u32,
}

/// The features of bodies a and b that span one facet of the CSO \[K02 §3.3.1\]. The first word of
/// a variant's name is the feature of body a.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Antipodal {
    /// A vertex of body a against a face of b.
    VertexFace {
        /// Vertex of body a.
        a: u32,
        /// Face of b.
        b: u32,
    },
    /// A face of body a against a vertex of b.
    FaceVertex {
        /// Face of body a.
        a: u32,
        /// Vertex of b.
        b: u32,
    },
    /// An edge of body a against an edge of b.
    EdgeEdge {
        /// Edge of body a.
        a: u32,
        /// Edge of b.
        b: u32,
    },
}

impl Antipodal {
    /// Returns the same pair as a [`FeaturePair`].
    pub fn features(self) -> FeaturePair {
        use crate::body::Feature::{Edge, Face, Vertex};
        match self {
            Self::VertexFace { a, b } => FeaturePair { a: Vertex(a), b: Face(b) },
            Self::FaceVertex { a, b } => FeaturePair { a: Face(a), b: Vertex(b) },
            Self::EdgeEdge { a, b } => FeaturePair { a: Edge(a), b: Edge(b) },
        }
    }

    /// Returns the pair with these features. `None` if the features span no facet.
    pub fn of(features: FeaturePair) -> Option<Self> {
        use crate::body::Feature::{Edge, Face, Vertex};
        match (features.a, features.b) {
            (Vertex(a), Face(b)) => Some(Self::VertexFace { a, b }),
            (Face(a), Vertex(b)) => Some(Self::FaceVertex { a, b }),
            (Edge(a), Edge(b)) => Some(Self::EdgeEdge { a, b }),
            _ => None,
        }
    }
}

/// States whether a depth is proven to be the smallest depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Certainty {
    /// No neighbouring facet of the CSO has a smaller offset. \[K02\] guarantees only this
    /// property.
    LocallyOptimal,
    /// Proven: no shorter motion in any direction separates the pair.
    GloballyOptimal,
}

/// The penetration depth of two overlapping convex polytopes, in b's frame.
///
/// Moving body a by `depth · normal` separates the pair; `point_a − point_b = −depth · normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Depth {
    /// Witness point on the boundary of body a.
    pub point_a: DVec3,
    /// Witness point on the boundary of b.
    pub point_b: DVec3,
    /// Unit vector from body b into body a.
    pub normal: DVec3,
    /// `max_b n·b − min_a n·a` along `normal`, in the length unit of the polytopes. The depth is
    /// not negative if the pair overlaps. If the value is negative, the distance of the pair is at
    /// least its absolute value.
    pub depth: f64,
    /// The features that span the facet of the CSO on which the answer lies.
    pub antipodal: Antipodal,
    /// A hub pair of that facet. The next tick starts from this pair.
    pub hub: HubPair,
    /// States whether this depth is proven to be the smallest depth.
    pub certainty: Certainty,
    /// Number of moves of the walk.
    pub steps: u32,
    /// The reason why the walk ended.
    pub stop: StopReason,
}
