//! Errors of mesh files: each says in one sentence what is wrong, where, and what to do.

use std::fmt;
use std::io;

/// Why a mesh file was not read.
///
/// Shows as `cup.obj, line 12: coordinate "nan" is not a finite number; repair the vertex` and so
/// on.
#[derive(Debug, thiserror::Error)]
#[error("{file}{place}: {problem}")]
pub struct MeshFileError {
    /// The file as the caller named it.
    pub file: String,
    /// Place in the file.
    pub place: Place,
    /// The problem; already part of the sentence, so not a `source`.
    pub problem: Box<MeshProblem>,
}

/// A place in a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line of a text file, counted from 1.
    Line(u64),
    /// An element of a binary file: its kind (`triangle`, `vertex`, `accessor`, …) and its index,
    /// counted from 0.
    Element(&'static str, u64),
    /// An element within an element, both as in [`Place::Element`].
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
    /// There is nothing to touch in the file.
    #[error("there is no face in the file ({vertices} vertices); export the mesh with its faces")]
    NoFaces {
        /// Vertices that the file does have.
        vertices: u64,
    },
    /// A coordinate is NaN or infinite, or too large for a double.
    #[error("coordinate \"{text}\" is not a finite number; repair the vertex or export the mesh again")]
    NotFinite {
        /// The coordinate as written, or its value in a binary file.
        text: String,
    },
    /// A coordinate lies beyond [`MAX_COORDINATE`](super::MAX_COORDINATE).
    #[error("coordinate {text} is absurdly large (the limit is 1e30); repair the vertex or export the mesh again")]
    TooFar {
        /// The coordinate.
        text: String,
    },
    /// A face names a vertex that does not exist.
    #[error(
        "the face names vertex {index}, but the file has {count} vertices, counted from {first}; \
         the file is damaged or cut off: export the mesh again"
    )]
    IndexOutOfRange {
        /// As the file writes it.
        index: i128,
        /// Vertices in the file (or, for a backward index, above the face).
        count: u64,
        /// Number of the first vertex in this format.
        first: u64,
    },
    /// A face has fewer than three corners and so bounds nothing.
    #[error("a face has {corners} corners and needs at least 3; remove the face or export the mesh again")]
    ShortFace {
        /// Corners that it has.
        corners: u64,
    },
    /// The file ends too early.
    #[error("the file ends {within}; it was cut off: copy or export it again")]
    Truncated {
        /// In the middle of what.
        within: String,
    },
    /// The file announces more than it can hold.
    #[error(
        "the file's {element} count is {count}, more than its remaining {bytes} bytes can hold; \
         it is damaged or cut off: copy or export it again"
    )]
    AbsurdCount {
        /// The counted items.
        element: String,
        /// How many are announced.
        count: u64,
        /// Bytes from there to the end of the file.
        bytes: u64,
    },
    /// The text or the structure is not what the format says.
    #[error("{0}")]
    Malformed(String),
    /// The file may be fine, but it is of a kind that is not read.
    #[error("{0}")]
    Unsupported(String),
    /// More than the 32-bit indices of the engine, or the reader's limits, can hold.
    #[error("{0}; simplify the mesh or split it")]
    TooLarge(String),
}

/// A problem and its place, before the file's name is known.
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

    /// The fault in the file called `name`.
    pub(super) fn of(self, name: &str) -> MeshFileError {
        MeshFileError { file: name.to_owned(), place: self.place, problem: self.problem }
    }
}
