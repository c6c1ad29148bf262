//! Notices to the user about defects and repairs of a mesh.

use std::fmt;

/// A defect or repair of a mesh that the user should know about. Each variant contains a count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Number of boundary edges.
    Open(usize),
    /// Number of triangles that cross or overlap others.
    SelfIntersecting(usize),
    /// Like [`Self::SelfIntersecting`], but only a lower bound, because not all pairs were tested.
    SelfIntersectingAtLeast(usize),
    /// Number of edges of three or more triangles.
    NonManifoldEdges(usize),
    /// Number of edges of two triangles that disagree about the outer side.
    DisagreeingEdges(usize),
    /// Number of components whose orientations cannot agree.
    OneSided(usize),
    /// Number of vertices where parts of the surface touch.
    PinchedVertices(usize),
    /// Number of pairs of triangles that touch.
    Touching(usize),
    /// Number of components that were inside out.
    Inverted(usize),
    /// Number of triangles that were flipped to agree with their component.
    Turned(usize),
    /// Number of duplicate triangles that were dropped.
    Duplicates(usize),
    /// Number of triangles without area that were dropped.
    EmptyTriangles(usize),
    /// Number of triangles without area that were removed by cutting a neighbour.
    ExchangedTriangles(usize),
    /// Number of degenerate faces that were dropped.
    DegenerateFaces(usize),
    /// Number of polygons that cross themselves.
    SelfCrossingFaces(usize),
    /// Number of vertices that were welded.
    Welded(usize),
    /// Number of vertices that no triangle uses.
    Unused(usize),
}

impl Notice {
    /// Returns true if the finding can make the rendered forces wrong or weaker. Returns false if
    /// it only reports a repair or a harmless fact.
    pub fn is_warning(&self) -> bool {
        matches!(
            self,
            Self::Open(_)
                | Self::SelfIntersecting(_)
                | Self::SelfIntersectingAtLeast(_)
                | Self::NonManifoldEdges(_)
                | Self::DisagreeingEdges(_)
                | Self::OneSided(_)
                | Self::SelfCrossingFaces(_)
        )
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (count, one, many, rest) = match *self {
            Self::Open(n) => (
                n,
                "edge",
                "edges",
                "at an open boundary: penetration is detected only up to the thickness of the pieces",
            ),
            Self::SelfIntersecting(n) => (
                n,
                "triangle",
                "triangles",
                "crossing or overlapping others: penetration is detected only up to the thickness of the pieces",
            ),
            Self::SelfIntersectingAtLeast(n) => (
                n,
                "triangle",
                "triangles",
                "or more crossing or overlapping others (not all pairs were tested): penetration is detected only up to the thickness of the pieces",
            ),
            Self::NonManifoldEdges(n) => (n, "edge", "edges", "shared by three or more triangles: treated as a crease"),
            Self::DisagreeingEdges(n) => (n, "edge", "edges", "between triangles that disagree about the outer side"),
            Self::OneSided(n) => {
                (n, "component", "components", "whose triangles cannot agree about the outer side, as on a Möbius band")
            }
            Self::PinchedVertices(n) => (n, "vertex", "vertices", "where separate parts of the surface touch"),
            Self::Touching(n) => (n, "pair", "pairs", "of triangles touching outside their shared corners and edges"),
            Self::Inverted(n) => (n, "closed component", "closed components", "inside out: flipped"),
            Self::Turned(n) => (n, "triangle", "triangles", "facing the wrong way: flipped to agree with the others"),
            Self::Duplicates(n) => {
                (n, "triangle", "triangles", "with the same corners as an earlier triangle: dropped")
            }
            Self::EmptyTriangles(n) => (n, "triangle", "triangles", "without area: dropped"),
            Self::ExchangedTriangles(n) => {
                (n, "triangle", "triangles", "without area: removed by cutting a neighbour, which opens no gap")
            }
            Self::DegenerateFaces(n) => (n, "face", "faces", "with fewer than three different corners: dropped"),
            Self::SelfCrossingFaces(n) => {
                (n, "polygon", "polygons", "with a border that crosses itself: the triangles may cover a wrong region")
            }
            Self::Welded(n) => (n, "vertex", "vertices", "at the same place as an earlier vertex: welded"),
            Self::Unused(n) => (n, "vertex", "vertices", "that no face uses: dropped"),
        };
        write!(f, "{count} {} {rest}", if count == 1 { one } else { many })
    }
}
