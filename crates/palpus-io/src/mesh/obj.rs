//! Reads Wavefront OBJ: the polygons of all objects and groups form one soup.
//!
//! 1. Lines that end in a backslash are joined with the next line. Lines are split into words; `#`
//!    starts a comment. Comments and names may have any encoding.
//! 2. `v x y z …` is a vertex; weights and colours after the coordinates are ignored.
//! 3. `f` is a polygon with corners of the form `v`, `v/vt`, `v//vn` or `v/vt/vn`; only the `v` is
//!    read. A negative index counts back from the last vertex before the face; a positive index may
//!    also refer to a later vertex.
//! 4. All other statements (textures, normals, materials, groups, lines, points) are ignored, and
//!    no `.mtl` file is opened. An unknown word that starts with `v` or `f` is an error, because it
//!    may be a damaged vertex or face. Ignoring a vertex would change the numbers of all later
//!    vertices.
//!
//! A face with fewer than three corners is an error and not just a warning: without the face, the
//! surface would have a hole through which the tool could pass.
//!
//! We do not use the crate `tobj`: it gives no line numbers, rejects Latin-1, and would need a
//! second scan of the file to find the line of a NaN.

use palpus::body::PolygonSoup;

use super::builder::SoupBuilder;
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use super::lines::{Lines, looks_binary, shown, whole, words};

/// Reads an OBJ file. `name` is the name of the file in error messages.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    read(bytes).map_err(|fault| fault.of(name))
}

fn read(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(Fault::unsupported(Place::File, "the text is UTF-16; save it as UTF-8 or ASCII"));
    }
    let mut soup = SoupBuilder::new(1);
    let mut lines = Lines::new(bytes);
    let mut joined = Vec::new();
    while let Some((line, text)) = lines.next() {
        let place = Place::Line(line);
        let statement = match words(text).next() {
            Some(b"v" | b"f" | b"fo") if text.ends_with(b"\\") => join(text, &mut lines, &mut joined),
            _ => text,
        };
        let mut words = words(statement);
        match words.next() {
            None => {}
            Some(b"v") => soup.vertex_of_words(words, place)?,
            Some(b"f" | b"fo") => face(words, place, &mut soup)?,
            Some(keyword) => pass_over(keyword, place)?,
        }
    }
    soup.finish()
}

/// Returns the statement that starts with `text` and continues on the next line as long as a line
/// ends in a backslash.
fn join<'a>(text: &[u8], lines: &mut Lines<'_>, joined: &'a mut Vec<u8>) -> &'a [u8] {
    joined.clear();
    joined.extend_from_slice(text);
    while joined.last() == Some(&b'\\') {
        joined.pop();
        joined.push(b' ');
        match lines.next() {
            Some((_, more)) => joined.extend_from_slice(more),
            None => break,
        }
    }
    joined
}

/// Reads the words after an `f` and appends the face.
fn face<'a>(words: impl Iterator<Item = &'a [u8]>, place: Place, soup: &mut SoupBuilder) -> Result<(), Fault> {
    for word in words {
        let digits = word.split(|&b| b == b'/').next().unwrap_or(word);
        let Some(index) = whole(digits) else {
            let what = format!(
                "\"{}\" is not the corner of a face (v, v/vt, v//vn or v/vt/vn); repair it or export the mesh again",
                shown(word)
            );
            return Err(Fault::malformed(place, what));
        };
        let count = soup.vertex_count();
        let corner = if index > 0 { Some(index as u64 - 1) } else { count.checked_sub(index.unsigned_abs()) };
        match corner {
            Some(corner) if index != 0 => soup.corner(corner, place),
            _ => {
                let problem = MeshProblem::IndexOutOfRange { index: index.into(), count, first: 1 };
                return Err(Fault::new(place, problem));
            }
        }
    }
    soup.end_face(place)
}

/// Checks that an ignored statement is known or starts with neither `v` nor `f`.
fn pass_over(keyword: &[u8], place: Place) -> Result<(), Fault> {
    if looks_binary(keyword) {
        return Err(Fault::malformed(place, "this is not text; is it an OBJ file?"));
    }
    let known = matches!(keyword, b"vt" | b"vn" | b"vp" | b"vc");
    if !known && (keyword.starts_with(b"v") || keyword.starts_with(b"f")) {
        let what = format!("\"{}\" is not an OBJ statement; repair or remove the line", shown(keyword));
        return Err(Fault::malformed(place, what));
    }
    Ok(())
}
