//! STL, binary and ASCII: triangles without shared vertices (welding is the engine's business).
//!
//! 1. A file of exactly 84 + 50 n bytes, n being the count at byte 80, is binary, whatever its
//!    first word; many binary files begin with `solid`.
//! 2. Else a file that begins with `solid` and continues as text is ASCII: any number of solids one
//!    after the other, keywords in any case; a facet may have more than three vertices. Every
//!    facet's own normal is ignored: corners run counter-clockwise, and the normal is often zero or
//!    NaN.
//! 3. Else it is a damaged binary file, and the error says by how much its length is off.
//!
//! Our own reader: the crate `stl_io` reads only the first solid of an ASCII file.

use palpus::body::PolygonSoup;

use super::builder::SoupBuilder;
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use super::lines::{Lines, looks_binary, shown, words};

/// Bytes before the first triangle of a binary file.
const HEADER: usize = 84;
/// Bytes of a triangle: normal, three vertices, attribute.
const TRIANGLE: usize = 50;
/// How much of a file that begins with `solid` is looked at to tell text from binary.
const SNIFFED: usize = 1024;

/// Reads an STL file's bytes; `name` is how errors call the file.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    let read = if is_ascii(bytes) { read_ascii(bytes) } else { read_binary(bytes) };
    read.map_err(|fault| fault.of(name))
}

/// True when the bytes are exactly as long as their count of triangles says.
pub(super) fn has_binary_length(bytes: &[u8]) -> bool {
    announced(bytes).is_some_and(|count| bytes.len() as u64 == HEADER as u64 + TRIANGLE as u64 * count)
}

/// True when the bytes are an ASCII file.
pub(super) fn is_ascii(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    let begins = text.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    begins && !has_binary_length(bytes) && !looks_binary(&bytes[..bytes.len().min(SNIFFED)])
}

/// The count of triangles that a binary file announces.
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
            "{extra} bytes follow the {count} triangles that the header announces; several files were joined or the \
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
    format!("\"{}\" stands where {expected} is expected; the file is damaged: export the mesh again", shown(keyword))
}
