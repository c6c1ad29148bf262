//! Notices about a mesh for its user.

use std::fmt;

/// One thing that a user should know about a mesh; each holds a count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// Boundary edges.
    Open(usize),
    /// Triangles that cross or overlap others.
    SelfIntersecting(usize),
    /// Triangles that cross or overlap others, if not all pairs were tested.
    SelfIntersectingAtLeast(usize),
    /// Edges of three or more triangles.
    NonManifoldEdges(usize),
    /// Edges of two triangles that disagree.
    DisagreeingEdges(usize),
    /// Components without an outside.
    OneSided(usize),
    /// Vertices where parts touch.
    PinchedVertices(usize),
    /// Pairs of triangles that touch.
    Touching(usize),
    /// Components that were inside out.
    Inverted(usize),
    /// Triangles turned to agree with the others.
    Turned(usize),
    /// Duplicated triangles dropped.
    Duplicates(usize),
    /// Triangles of no area dropped.
    EmptyTriangles(usize),
    /// Triangles of no area exchanged.
    ExchangedTriangles(usize),
    /// Degenerate faces dropped.
    DegenerateFaces(usize),
    /// Polygons that cross themselves.
    SelfCrossingFaces(usize),
    /// Vertices welded.
    Welded(usize),
    /// Vertices that nothing uses.
    Unused(usize),
}

impl Notice {
    /// True if the finding limits what can be felt, false if it only reports a repair.
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
                "at an open boundary: it is felt as a surface, only as deep as its pieces are thick",
            ),
            Self::SelfIntersecting(n) => (
                n,
                "triangle",
                "triangles",
                "crossing or overlapping others: depth there is only as deep as the pieces are thick",
            ),
            Self::SelfIntersectingAtLeast(n) => (
                n,
                "triangle",
                "triangles",
                "or more crossing or overlapping others (not all were looked at): depth there is only as deep as the pieces are thick",
            ),
            Self::NonManifoldEdges(n) => (n, "edge", "edges", "shared by three or more triangles: treated as a crease"),
            Self::DisagreeingEdges(n) => {
                (n, "edge", "edges", "between triangles that disagree about which side is outside")
            }
            Self::OneSided(n) => (n, "component", "components", "without an outside, like a Möbius band"),
            Self::PinchedVertices(n) => (n, "vertex", "vertices", "where separate parts of the surface touch"),
            Self::Touching(n) => (n, "pair", "pairs", "of triangles touching without sharing that corner or edge"),
            Self::Inverted(n) => (n, "closed component", "closed components", "inside out: turned"),
            Self::Turned(n) => (n, "triangle", "triangles", "facing the wrong way: turned to agree with the others"),
            Self::Duplicates(n) => (n, "triangle", "triangles", "with the same corners as an earlier one: dropped"),
            Self::EmptyTriangles(n) => (n, "triangle", "triangles", "without area: dropped"),
            Self::ExchangedTriangles(n) => {
                (n, "triangle", "triangles", "without area: removed by cutting a neighbour; nothing opened")
            }
            Self::DegenerateFaces(n) => (n, "face", "faces", "with fewer than three different corners: dropped"),
            Self::SelfCrossingFaces(n) => {
                (n, "polygon", "polygons", "crossing itself: cut into triangles as well as can be")
            }
            Self::Welded(n) => (n, "vertex", "vertices", "at the same place as an earlier one: welded"),
            Self::Unused(n) => (n, "vertex", "vertices", "that no face uses: dropped"),
        };
        write!(f, "{count} {} {rest}", if count == 1 { one } else { many })
    }
}
