//! Reads PLY: ASCII, and binary in either byte order.
//!
//! 1. The header lists elements, each with a count and its properties.
//! 2. Before an element is read, its count is compared with the number of remaining bytes, so that
//!    an impossible count allocates no memory.
//! 3. `vertex` contains `x`, `y`, `z`; `face` contains the list `vertex_indices` (or
//!    `vertex_index`); `tristrips` contains triangle strips separated by −1. Other properties and
//!    elements are skipped.
//! 4. In ASCII files, each element must be on a separate line, as the format requires. A missing
//!    value can therefore be reported with its line.
//!
//! Every number type of PLY fits a double exactly, so all values are passed as `f64`.
//!
//! We do not use the crate `ply-rs-bw` because its errors do not say which element of a binary file
//! is wrong.

mod header;

use palpus::body::PolygonSoup;

use super::builder::{SoupBuilder, not_a_number};
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use super::lines::{Lines, number, shown, words};
use header::{Element, Scalar, read_header};

/// Reads a PLY file. `name` is the name of the file in error messages.
pub fn parse(bytes: &[u8], name: &str) -> Result<PolygonSoup, MeshFileError> {
    read(bytes).map_err(|fault| fault.of(name))
}

fn read(bytes: &[u8]) -> Result<PolygonSoup, Fault> {
    let (header, mut body) = read_header(bytes)?;
    let mut soup = SoupBuilder::new(0);
    let roles: Vec<Role> = header.iter().map(role).collect::<Result<_, _>>()?;
    let needed = roles.iter().rposition(|role| *role != Role::Other).map_or(0, |last| last + 1);
    for (element, role) in header.iter().zip(&roles).take(needed) {
        read_element(element, *role, &mut body, &mut soup)?;
    }
    soup.finish()
}

/// How an element is used; the numbers are indices of properties.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Vertices { axes: [usize; 3] },
    Faces { corners: usize },
    Strips { corners: usize },
    Other,
}

/// Returns how an element is used; fails if it lacks required properties.
fn role(element: &Element) -> Result<Role, Fault> {
    let list = || {
        let index = element.properties.iter().position(|property| {
            property.length.is_some() && matches!(property.name.as_slice(), b"vertex_indices" | b"vertex_index")
        });
        match index {
            Some(index) if !element.properties[index].item.is_float() => Ok(index),
            _ => Err(Fault::malformed(
                Place::File,
                format!(
                    "element `{}` has no integer list `vertex_indices`; export the mesh with its faces",
                    shown(&element.name)
                ),
            )),
        }
    };
    match element.name.as_slice() {
        b"vertex" => {
            let mut axes = [0; 3];
            for (axis, name) in [b"x", b"y", b"z"].into_iter().enumerate() {
                let found =
                    element.properties.iter().position(|property| property.name == name && property.length.is_none());
                axes[axis] = found.ok_or_else(|| {
                    let what = "element `vertex` has no scalar properties `x`, `y`, `z`; export the mesh again";
                    Fault::malformed(Place::File, what)
                })?;
            }
            Ok(Role::Vertices { axes })
        }
        b"face" if element.count > 0 => Ok(Role::Faces { corners: list()? }),
        b"tristrips" if element.count > 0 => Ok(Role::Strips { corners: list()? }),
        _ => Ok(Role::Other),
    }
}

/// Reads or skips all items of an element.
fn read_element(element: &Element, role: Role, body: &mut Body<'_>, soup: &mut SoupBuilder) -> Result<(), Fault> {
    if element.properties.is_empty() {
        return Ok(());
    }
    check_count(element, body)?;
    if let Role::Vertices { .. } = role {
        soup.reserve_vertices(element.count);
    }
    let mut strip = Vec::new();
    for index in 0..element.count {
        let mut row = body.row(element, index)?;
        let place = row.place;
        let mut xyz = [0.0; 3];
        strip.clear();
        for (p, property) in element.properties.iter().enumerate() {
            let items = match property.length {
                None => 1,
                Some(length) => row.length(length, property.item)?,
            };
            for _ in 0..items {
                let value = row.value(property.item)?;
                match role {
                    Role::Vertices { axes } => {
                        (0..3).filter(|&axis| axes[axis] == p).for_each(|axis| xyz[axis] = value);
                    }
                    Role::Faces { corners } if corners == p => soup.corner(vertex_index(value, place, soup)?, place),
                    Role::Strips { corners } if corners == p => strip.push(value),
                    _ => {}
                }
            }
        }
        row.end()?;
        match role {
            Role::Vertices { .. } => soup.vertex(xyz, place, |axis| format!("{:?}", xyz[axis]))?,
            Role::Faces { .. } => soup.end_face(place)?,
            Role::Strips { .. } => end_strips(&strip, place, soup)?,
            Role::Other => {}
        }
    }
    Ok(())
}

/// Checks an element's count against the number of remaining bytes.
fn check_count(element: &Element, body: &Body<'_>) -> Result<(), Fault> {
    let (bytes, least) = match body {
        // Each value needs a digit and a separator; the last separator may be missing.
        Body::Ascii(lines) => (lines.remaining(), 2 * element.properties.len() as u64),
        Body::Binary { rest, .. } => {
            let least =
                element.properties.iter().map(|property| property.length.unwrap_or(property.item).size() as u64);
            (rest.len() as u64, least.sum())
        }
    };
    if element.count.saturating_mul(least) > bytes + 1 {
        let problem = MeshProblem::AbsurdCount { element: shown(&element.name), count: element.count, bytes };
        return Err(Fault::new(Place::File, problem));
    }
    Ok(())
}

/// Returns the vertex index that a corner's value states. Fails if the index is invalid.
fn vertex_index(value: f64, place: Place, soup: &SoupBuilder) -> Result<u64, Fault> {
    if value < 0.0 {
        let problem = MeshProblem::IndexOutOfRange { index: value as i128, count: soup.vertex_count(), first: 0 };
        return Err(Fault::new(place, problem));
    }
    if value.fract() != 0.0 || !value.is_finite() {
        return Err(Fault::malformed(place, format!("{value} is not the number of a vertex; export the mesh again")));
    }
    Ok(value as u64)
}

/// Appends the triangles of the strips of one element. Every second triangle of a strip is
/// reversed.
fn end_strips(strip: &[f64], place: Place, soup: &mut SoupBuilder) -> Result<(), Fault> {
    for run in strip.split(|&value| value < 0.0) {
        for (k, corners) in run.windows(3).enumerate() {
            let (second, third) = if k % 2 == 0 { (corners[1], corners[2]) } else { (corners[2], corners[1]) };
            let mut triangle = [0; 3];
            for (corner, value) in triangle.iter_mut().zip([corners[0], second, third]) {
                *corner = vertex_index(value, place, soup)?;
            }
            soup.triangle(triangle, place)?;
        }
    }
    Ok(())
}

/// The bytes after the header.
enum Body<'a> {
    Ascii(Lines<'a>),
    Binary { rest: &'a [u8], big_endian: bool },
}

/// The values of one item of an element.
struct Row<'r, 'a> {
    place: Place,
    values: Values<'r, 'a>,
}

enum Values<'r, 'a> {
    Ascii { line: &'a [u8], read: usize },
    Binary { rest: &'r mut &'a [u8], big_endian: bool },
}

impl<'a> Body<'a> {
    /// Starts to read the next item.
    fn row(&mut self, element: &Element, index: u64) -> Result<Row<'_, 'a>, Fault> {
        match self {
            Self::Ascii(lines) => {
                let line = lines.find(|(_, line)| words(line).next().is_some());
                let Some((number, line)) = line else {
                    let within = format!("after {index} of {} lines of `{}`", element.count, shown(&element.name));
                    return Err(Fault::truncated(Place::Line(lines.number()), within));
                };
                Ok(Row { place: Place::Line(number), values: Values::Ascii { line, read: 0 } })
            }
            Self::Binary { rest, big_endian } => {
                let name = match element.name.as_slice() {
                    b"vertex" => "vertex",
                    b"face" => "face",
                    b"tristrips" => "tristrips",
                    _ => "element",
                };
                let values = Values::Binary { rest, big_endian: *big_endian };
                Ok(Row { place: Place::Element(name, index), values })
            }
        }
    }
}

impl Row<'_, '_> {
    /// Returns the next value.
    fn value(&mut self, kind: Scalar) -> Result<f64, Fault> {
        match &mut self.values {
            Values::Ascii { line, read } => {
                let text = line.trim_ascii_start();
                let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
                let (word, rest) = text.split_at(end);
                if word.is_empty() {
                    let what =
                        format!("the line ends after {read} values; add the missing ones or export the mesh again");
                    return Err(Fault::malformed(self.place, what));
                }
                *line = rest;
                *read += 1;
                number(word).ok_or_else(|| not_a_number(word, self.place))
            }
            Values::Binary { rest, big_endian } => {
                let Some((value, after)) = rest.split_at_checked(kind.size()) else {
                    return Err(Fault::truncated(self.place, "inside this element"));
                };
                **rest = after;
                Ok(kind.value(value, *big_endian))
            }
        }
    }

    /// Returns the length of a list of `item`s, checked against the number of remaining bytes.
    fn length(&mut self, kind: Scalar, item: Scalar) -> Result<u64, Fault> {
        let length = self.value(kind)?;
        if !(length >= 0.0 && length.fract() == 0.0 && length.is_finite()) {
            let what = format!("{length} is not the length of a list; the file is damaged: export the mesh again");
            return Err(Fault::malformed(self.place, what));
        }
        let length = length as u64;
        let (bytes, least) = match &self.values {
            Values::Ascii { line, .. } => (line.len(), 2),
            Values::Binary { rest, .. } => (rest.len(), item.size() as u64),
        };
        if length.saturating_mul(least) > bytes as u64 {
            let element = "list item".to_owned();
            let problem = MeshProblem::AbsurdCount { element, count: length, bytes: bytes as u64 };
            return Err(Fault::new(self.place, problem));
        }
        Ok(length)
    }

    /// Checks that the line has no more values.
    fn end(self) -> Result<(), Fault> {
        match self.values {
            Values::Ascii { line, read } if !line.trim_ascii().is_empty() => {
                let what = format!("the line continues after its {read} values; repair it or export the mesh again");
                Err(Fault::malformed(self.place, what))
            }
            _ => Ok(()),
        }
    }
}
