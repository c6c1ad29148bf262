//! Features of a polytope: vertices, edges and faces.

use crate::body::Polytope;

/// A vertex, edge or face of a polytope.
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
    /// Returns one vertex of the feature, which belongs to `polytope`.
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
    /// Feature on the polytope of body a.
    pub a: Feature,
    /// Feature on the polytope of body b.
    pub b: Feature,
}
