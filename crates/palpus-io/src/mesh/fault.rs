//! Errors of mesh files. Each message describes in one sentence the problem, its location and how
//! to fix it.

use std::fmt;
use std::io;

/// The reason why a mesh file cannot be read.
///
/// Displayed for example as `cup.obj, line 12: coordinate "nan" is not a finite number; repair the
/// vertex or export the mesh again`.
#[derive(Debug, thiserror::Error)]
#[error("{file}{place}: {problem}")]
pub struct MeshFileError {
    /// Name of the file, as given by the caller.
    pub file: String,
    /// Location in the file.
    pub place: Place,
    /// The problem. The displayed message already contains the problem, so it is not a `source`.
    pub problem: Box<MeshProblem>,
}

/// A location in a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, counted from 1.
    Line(u64),
    /// An element of a binary file: its kind (`triangle`, `vertex`, `accessor`, …) and its index,
    /// counted from 0.
    Element(&'static str, u64),
    /// An element within another element. Both are described as in [`Place::Element`].
    Part(&'static str, u64, &'static str, u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Element(element, index) => write!(f, ", {element} {index}"),
            Self::Part(outer, i, inner, j) => write!(f, ", {outer} {i}, {inner} {j}"),
        }
    }
}

/// A problem of a mesh file.
#[derive(Debug, thiserror::Error)]
pub enum MeshProblem {
    /// The file cannot be opened or read.
    #[error("cannot be read ({0}); check the path and its permissions")]
    Unreadable(io::Error),
    /// The file contains no faces.
    #[error("the file has no faces ({vertices} vertices); export the mesh with its faces")]
    NoFaces {
        /// Number of vertices in the file.
        vertices: u64,
    },
    /// A coordinate is NaN, infinite, or too large for a double.
    #[error("coordinate \"{text}\" is not a finite number; repair the vertex or export the mesh again")]
    NotFinite {
        /// The coordinate as written, or its value if the file is binary.
        text: String,
    },
    /// The absolute value of a coordinate exceeds [`MAX_COORDINATE`](super::MAX_COORDINATE).
    #[error("coordinate {text} is too large (the limit is 1e30); repair the vertex or export the mesh again")]
    TooFar {
        /// The coordinate as written.
        text: String,
    },
    /// A face refers to a vertex that does not exist.
    #[error(
        "the face refers to vertex {index}, but the file has {count} vertices, counted from {first}; \
         the file is damaged or truncated: export the mesh again"
    )]
    IndexOutOfRange {
        /// The index as written in the file.
        index: i128,
        /// Number of vertices in the file; for a relative (negative) index, the number of vertices
        /// before the face.
        count: u64,
        /// Number that the format gives to the first vertex.
        first: u64,
    },
    /// A face has fewer than three corners, so it has no area.
    #[error("a face has {corners} corners and needs at least 3; remove the face or export the mesh again")]
    ShortFace {
        /// Number of corners.
        corners: u64,
    },
    /// The file is truncated.
    #[error("the file ends {within}; it is truncated: copy or export it again")]
    Truncated {
        /// The place at which the file ends, such as "inside a facet".
        within: String,
    },
    /// The file declares more elements than it can contain.
    #[error(
        "the file's {element} count is {count}, more than its remaining {bytes} bytes can contain; \
         it is damaged or truncated: copy or export it again"
    )]
    AbsurdCount {
        /// The counted items.
        element: String,
        /// The declared number of elements.
        count: u64,
        /// Number of bytes from the count to the end of the file.
        bytes: u64,
    },
    /// The text or the structure does not follow the format.
    #[error("{0}")]
    Malformed(String),
    /// The file may be valid, but it uses a feature that is not supported.
    #[error("{0}")]
    Unsupported(String),
    /// The mesh exceeds the engine's 32-bit indices or the limits of the reader.
    #[error("{0}; simplify the mesh or split it")]
    TooLarge(String),
}

/// A problem and its location, while the name of the file is unknown.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) place: Place,
    pub(super) problem: Box<MeshProblem>,
}

impl Fault {
    pub(super) fn new(place: Place, problem: MeshProblem) -> Self {
        Self { place, problem: Box::new(problem) }
    }

    pub(super) fn malformed(place: Place, what: impl Into<String>) -> Self {
        Self::new(place, MeshProblem::Malformed(what.into()))
    }

    pub(super) fn unsupported(place: Place, what: impl Into<String>) -> Self {
        Self::new(place, MeshProblem::Unsupported(what.into()))
    }

    pub(super) fn truncated(place: Place, within: impl Into<String>) -> Self {
        Self::new(place, MeshProblem::Truncated { within: within.into() })
    }

    /// Returns the error for the file called `name`.
    pub(super) fn of(self, name: &str) -> MeshFileError {
        MeshFileError { file: name.to_owned(), place: self.place, problem: self.problem }
    }
}
