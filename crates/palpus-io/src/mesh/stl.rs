//! Reads STL, binary and ASCII: triangles without shared vertices. The engine welds the vertices.
//!
//! 1. A file of exactly 84 + 50 n bytes, where n is the count at byte 80, is binary. The first
//!    word of the file is ignored, because many binary files begin with `solid`.
//! 2. Otherwise, a file that begins with `solid` and continues as text is ASCII. An ASCII file
//!    contains any number of solids; keywords may be upper or lower case; a facet may have more
//!    than three vertices. The normals of facets are ignored, because they are often zero or NaN.
//!    The corners are counter-clockwise.
//! 3. Any other file is a damaged binary file. The error states the excess or missing bytes.
//!
//! We do not use the crate `stl_io` because it reads only the first solid of an ASCII file.

use palpus::body::PolygonSoup;

use super::builder::SoupBuilder;
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use super::lines::{Lines, looks_binary, shown, words};

/// Size of the part before the first triangle of a binary file, in bytes.
const HEADER: usize = 84;
/// Size of a triangle in bytes: normal, three vertices and attribute.
const TRIANGLE: usize = 50;
/// Number of bytes that are examined to tell text from binary in a file that begins with `solid`.
const SNIFFED: usize = 1024;

/// Reads an STL file. `name` is the name of the file in error messages.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    let read = if is_ascii(bytes) { read_ascii(bytes) } else { read_binary(bytes) };
    read.map_err(|fault| fault.of(name))
}

/// Returns true if the file has exactly the length that its triangle count requires.
pub(super) fn has_binary_length(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|count| bytes.len() as u64 == HEADER as u64 + TRIANGLE as u64 * count)
}

/// Returns true if the bytes are an ASCII file.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    let begins = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    begins && !has_binary_length(bytes) && !looks_binary(&bytes[..bytes.len().min(SNIFFED)])
}

/// Returns the triangle count in the header of a binary file.
fn announced(bytes: &[u8]) -> Option<u64> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u64::from(u32::from_le_bytes(count.try_into().ok()?)))
}

fn read_binary(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let Some(count) = announced(bytes) else {
        let what = format!("in its header, after {} of {HEADER} bytes", bytes.len());
        return Err(Fault::truncated(Place::File, what));
    };
    let body = &bytes[HEADER..];
    let held = (body.len() / TRIANGLE) as u64;
    if count > held {
        let problem = MeshProblem::AbsurdCount { element: "triangle".to_owned(), count, bytes: body.len() as u64 };
        return Err(Fault::new(Place::Element("triangle", held), problem));
    }
    if !has_binary_length(bytes) {
        let extra = body.len() as u64 - count * TRIANGLE as u64;
        let what = format!(
            "{extra} bytes follow the {count} triangles that the header declares; several files were joined or the \
             header is damaged: export the mesh again"
        );
        return Err(Fault::malformed(Place::File, what));
    }
    let mut soup = SoupBuilder::new(0);
    soup.reserve_vertices(3 * count);
    for (index, triangle) in body.chunks_exact(TRIANGLE).enumerate() {
        let place = Place::Element("triangle", index as u64);
        for corner in 0..3 {
            let xyz: [f64; 3] = std::array::from_fn(|axis| {
                let at = 12 + 12 * corner + 4 * axis;
                f64::from(f32::from_le_bytes([triangle[at], triangle[at + 1], triangle[at + 2], triangle[at + 3]]))
            });
            soup.vertex(xyz, place, |axis| format!("{:?}", xyz[axis]))?;
        }
        let first = 3 * index as u64;
        soup.triangle([first, first + 1, first + 2], place)?;
    }
    soup.finish()
}

/// Position of the reader in the nested blocks of an ASCII file.
#[derive(Clone, Copy, PartialEq)]
enum Inside {
    Nothing,
    Solid,
    Facet,
    Loop,
}

fn read_ascii(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut soup = SoupBuilder::new(0);
    let mut inside = Inside::Nothing;
    let mut lines = Lines::new(bytes);
    let mut first = 0;
    for (line, text) in lines.by_ref() {
        let place = Place::Line(line);
        let mut words = words(text);
        let Some(keyword) = words.next() else { continue };
        inside = match (keyword.to_ascii_lowercase().as_slice(), inside) {
            (b"solid", Inside::Nothing) => Inside::Solid,
            (b"facet", Inside::Solid) => Inside::Facet,
            (b"outer", Inside::Facet) => {
                first = soup.vertex_count();
                Inside::Loop
            }
            (b"vertex", Inside::Loop) => {
                soup.vertex_of_words(words, place)?;
                Inside::Loop
            }
            (b"endloop", Inside::Loop) => {
                for corner in first..soup.vertex_count() {
                    soup.corner(corner, place);
                }
                soup.end_face(place)?;
                Inside::Facet
            }
            (b"endfacet", Inside::Facet) => Inside::Solid,
            (b"endsolid", Inside::Solid) => Inside::Nothing,
            (_, inside) => return Err(Fault::malformed(place, unexpected(keyword, inside))),
        };
    }
    match inside {
        Inside::Nothing => soup.finish(),
        Inside::Solid => Err(Fault::truncated(Place::Line(lines.number()), "before `endsolid`")),
        Inside::Facet | Inside::Loop => Err(Fault::truncated(Place::Line(lines.number()), "inside a facet")),
    }
}

fn unexpected(keyword: &[u8], inside: Inside) -> String {
    let expected = match inside {
        Inside::Nothing => "`solid`",
        Inside::Solid => "`facet` or `endsolid`",
        Inside::Facet => "`outer loop` or `endfacet`",
        Inside::Loop => "`vertex` or `endloop`",
    };
    format!("\"{}\" was found where {expected} is expected; the file is damaged: export the mesh again", shown(keyword))
}
