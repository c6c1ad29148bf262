//! Names of the features of a polytope.

use crate::body::Polytope;

/// A vertex, edge or face of one polytope, by its index there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Feature {
    /// Index into the polytope's vertices.
    Vertex(u32),
    /// Index into the polytope's edges.
    Edge(u32),
    /// Index into the polytope's faces.
    Face(u32),
}

impl Feature {
    /// A vertex of the feature of this polytope.
    #[inline]
    pub(crate) fn some_vertex(self, polytope: &Polytope) -> u32 {
        match self {
            Self::Vertex(v) => v,
            Self::Edge(e) => polytope.edge(e).tail,
            Self::Face(f) => polytope.face_vertices(f).at(0),
        }
    }
}

/// One feature on each body of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FeaturePair {
    /// On the polytope of body a.
    pub a: Feature,
    /// On the polytope of body b.
    pub b: Feature,
}
