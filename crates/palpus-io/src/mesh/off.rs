//! Reads OFF: the ASCII variants with three coordinates for each vertex (`OFF`, `COFF`, `NOFF`,
//! `CNOFF`, `STOFF`, …).
//!
//! 1. The header word is optional. The numbers of vertices, faces and edges follow, on the same
//!    line or the next. The number of edges is ignored.
//! 2. Blank lines and comments, which start with `#`, are ignored. A vertex is a line that starts
//!    with the three coordinates; the normals, colours and texture coordinates after them are
//!    ignored.
//! 3. A face is a line with the number of corners, the corners, and a colour, which is ignored.
//!
//! A face with fewer than three corners is an error, as in OBJ. `BINARY`, four-dimensional (`4OFF`)
//! and n-dimensional (`nOFF`) files give an error.

use palpus::body::PolygonSoup;

use super::builder::SoupBuilder;
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use super::lines::{Lines, shown, whole, words};

/// Reads an OFF file. `name` is the name of the file in error messages.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    read(bytes).map_err(|fault| fault.of(name))
}

/// Returns true if a word is a header word of the format.
pub(super) fn is_header(word: &[u8]) -> bool {
    word.ends_with(b"OFF")
        && word[..word.len() - 3].iter().all(|b| matches!(b, b'S' | b'T' | b'C' | b'N' | b'4' | b'n'))
}

fn read(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let mut lines = Lines::new(bytes);
    let [vertices, faces] = read_counts(&mut lines)?;
    check_counts(vertices, faces, lines.remaining())?;
    let mut soup = SoupBuilder::new(0);
    soup.reserve_vertices(vertices);
    for index in 0..vertices {
        let (place, text) = next_line(&mut lines, || format!("after {index} of {vertices} vertices"))?;
        soup.vertex_of_words(words(text), place)?;
    }
    for index in 0..faces {
        let (place, text) = next_line(&mut lines, || format!("after {index} of {faces} faces"))?;
        read_face(text, place, &mut soup)?;
    }
    soup.finish()
}

/// Returns the next line that is neither blank nor a comment.
fn next_line<'a>(lines: &mut Lines<'a>, within: impl Fn() -> String) -> Result<(Place, &'a [u8]), Fault> {
    match lines.find(|(_, line)| words(line).next().is_some()) {
        Some((number, line)) => Ok((Place::Line(number), line)),
        None => Err(Fault::truncated(Place::Line(lines.number()), within())),
    }
}

/// Reads the numbers of vertices and faces.
fn read_counts(lines: &mut Lines<'_>) -> Result<[u64; 2], Fault> {
    let header = || "in its header".to_owned();
    let (mut place, text) = next_line(lines, header)?;
    let mut counts: Vec<&[u8]> = words(text).take(4).collect();
    if is_header(counts[0]) {
        if counts[0].contains(&b'4') || counts[0].contains(&b'n') || counts.get(1) == Some(&b"BINARY".as_slice()) {
            let what = "only ASCII OFF files with three coordinates are supported; export the mesh as ASCII OFF or PLY";
            return Err(Fault::unsupported(place, what));
        }
        counts.remove(0);
        if counts.is_empty() {
            let (next, text) = next_line(lines, header)?;
            place = next;
            counts = words(text).take(4).collect();
        }
    }
    let count = |k: usize| counts.get(k).and_then(|word| whole(word)).and_then(|count| u64::try_from(count).ok());
    match (count(0), count(1)) {
        (Some(vertices), Some(faces)) => Ok([vertices, faces]),
        _ => {
            let what = "the counts of vertices and faces are expected here; is it an OFF file?";
            Err(Fault::malformed(place, what))
        }
    }
}

/// Compares the counts with the number of remaining bytes. A vertex needs at least 6 bytes; a face,
/// even one with too few corners, needs at least 2.
fn check_counts(vertices: u64, faces: u64, bytes: u64) -> Result<(), Fault> {
    for (element, count, least) in [("vertex", vertices, 6), ("face", faces, 2)] {
        if count.saturating_mul(least) > bytes + 1 {
            let problem = MeshProblem::AbsurdCount { element: element.to_owned(), count, bytes };
            return Err(Fault::new(Place::File, problem));
        }
    }
    Ok(())
}

fn read_face(text: &[u8], place: Place, soup: &mut SoupBuilder) -> Result<(), Fault> {
    let mut words = words(text);
    let corners = words.next().and_then(whole).and_then(|corners| u64::try_from(corners).ok());
    let Some(corners) = corners else {
        return Err(Fault::malformed(
            place,
            "a face starts with its number of corners; repair it or export the mesh again",
        ));
    };
    for known in 0..corners {
        let Some(word) = words.next() else {
            let what =
                format!("the face should have {corners} corners but lists {known}; repair it or export the mesh again");
            return Err(Fault::malformed(place, what));
        };
        match whole(word) {
            Some(index) if index >= 0 => soup.corner(index as u64, place),
            Some(index) => {
                let problem =
                    MeshProblem::IndexOutOfRange { index: index.into(), count: soup.vertex_count(), first: 0 };
                return Err(Fault::new(place, problem));
            }
            None => {
                let what =
                    format!("\"{}\" is not the number of a vertex; repair it or export the mesh again", shown(word));
                return Err(Fault::malformed(place, what));
            }
        }
    }
    soup.end_face(place)
}
