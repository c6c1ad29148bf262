//! PLY: ASCII and binary of either byte order.
//!
//! 1. The header lists elements, each with a count and its properties.
//! 2. Before an element is read, its count is held against the bytes that are left: a count that cannot be true
//!    reserves nothing.
//! 3. `vertex` gives `x`, `y`, `z`; `face` gives the list `vertex_indices` (or `vertex_index`); `tristrips` gives
//!    triangle strips with −1 between them. Other properties and elements are stepped over.
//! 4. In ASCII every element stands on a line of its own, as the format asks: so a missing value is noticed in its line.
//!
//! Every scalar of PLY fits a double exactly, so values pass as `f64`.
//!
//! Our own reader and not the crate `ply-rs-bw`: that one's errors do not say which element of a binary file is wrong.

use palpus::body::PolygonSoup;

use super::builder::{SoupBuilder, not_a_number};
use super::fault::{Fault, MeshFileError, MeshProblem, Place};
use super::lines::{Lines, number, shown, words};

/// Reads a PLY file's bytes; `name` is how errors call the file.
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

/// A number type of the format.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// The value of exactly [`Scalar::size`] bytes.
    fn value(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut little = [0; 8];
        little[..bytes.len()].copy_from_slice(bytes);
        if big_endian {
            little[..bytes.len()].reverse();
        }
        let [a, b, c, d, ..] = little;
        match self {
            Self::I8 => f64::from(a as i8),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(little),
        }
    }
}

struct Property {
    name: Vec<u8>,
    /// The type of the length, if the property is a list.
    length: Option<Scalar>,
    item: Scalar,
}

struct Element {
    name: Vec<u8>,
    count: u64,
    properties: Vec<Property>,
}

/// What an element is read as; the numbers are indices of properties.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Vertices { axes: [usize; 3] },
    Faces { corners: usize },
    Strips { corners: usize },
    Other,
}

/// The bytes behind the header.
enum Body<'a> {
    Ascii(Lines<'a>),
    Binary { rest: &'a [u8], big_endian: bool },
}

fn read_header(bytes: &[u8]) -> Result<(Vec<Element>, Body<'_>), Fault> {
    let mut lines = Lines::new(bytes);
    if lines.next().map(|(_, line)| line.trim_ascii()) != Some(b"ply") {
        return Err(Fault::malformed(Place::Line(1), "the first line is not `ply`; is it a PLY file?"));
    }
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let Some((line, text)) = lines.next() else {
            return Err(Fault::truncated(Place::Line(lines.number()), "in its header, before `end_header`"));
        };
        let place = Place::Line(line);
        let words: Vec<&[u8]> =
            text.split(|b| b.is_ascii_whitespace()).filter(|word| !word.is_empty()).take(6).collect();
        match words.as_slice() {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"end_header", ..] => break,
            [b"format", kind, version, ..] => format = Some(read_format(kind, version, place)?),
            [b"element", name, count, ..] => {
                let count = std::str::from_utf8(count).ok().and_then(|count| count.parse().ok());
                let count = count.ok_or_else(|| Fault::malformed(place, header_line(text)))?;
                elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            [b"property", rest @ ..] => {
                let property = read_property(rest);
                match (property, elements.last_mut()) {
                    (Some(property), Some(element)) => element.properties.push(property),
                    _ => return Err(Fault::malformed(place, header_line(text))),
                }
            }
            _ => return Err(Fault::malformed(place, header_line(text))),
        }
    }
    let body = match format {
        None => return Err(Fault::malformed(Place::File, "the header has no `format` line; export the mesh again")),
        Some(None) => Body::Ascii(lines),
        Some(Some(big_endian)) => Body::Binary { rest: body_bytes(bytes, &lines), big_endian },
    };
    Ok((elements, body))
}

fn header_line(text: &[u8]) -> String {
    format!("\"{}\" is not a line of a PLY header; repair it or export the mesh again", shown(text))
}

/// `Some(big_endian)` for a binary format, `None` for ASCII.
fn read_format(kind: &[u8], version: &[u8], place: Place) -> Result<Option<bool>, Fault> {
    if version != b"1.0" {
        let what = format!("PLY version {} is not read, only 1.0; export the mesh again", shown(version));
        return Err(Fault::unsupported(place, what));
    }
    match kind {
        b"ascii" => Ok(None),
        b"binary_little_endian" => Ok(Some(false)),
        b"binary_big_endian" => Ok(Some(true)),
        _ => Err(Fault::unsupported(place, format!("PLY format {} is not read; export the mesh again", shown(kind)))),
    }
}

/// The property that the words behind `property` declare.
fn read_property(words: &[&[u8]]) -> Option<Property> {
    match words {
        [b"list", length, item, name, ..] => {
            let length = Scalar::named(length).filter(|length| !length.is_float())?;
            Some(Property { name: name.to_vec(), length: Some(length), item: Scalar::named(item)? })
        }
        [item, name, ..] => Some(Property { name: name.to_vec(), length: None, item: Scalar::named(item)? }),
        _ => None,
    }
}

/// What follows the header. Where lines end in a lone `\r`, a first byte that happens to be `\n` is data.
fn body_bytes<'a>(bytes: &'a [u8], lines: &Lines<'_>) -> &'a [u8] {
    let mut start = bytes.len() - lines.remaining() as usize;
    let lone_return = bytes.get(3) == Some(&b'\r') && bytes.get(4) != Some(&b'\n');
    if lone_return && start > 0 && bytes[start - 1] == b'\n' {
        start -= 1;
    }
    &bytes[start..]
}

/// How an element is to be read.
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

/// Reads (or steps over) all of an element.
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

/// Holds an element's count against the bytes that are left.
fn check_count(element: &Element, body: &Body<'_>) -> Result<(), Fault> {
    let (bytes, least) = match body {
        // A digit and a separator for each value; the last separator may be missing.
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

/// The vertex that a corner's value names.
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

/// Appends the triangles of the strips of one element; every second one is turned.
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

/// One element's values.
struct Row<'r, 'a> {
    place: Place,
    values: Values<'r, 'a>,
}

enum Values<'r, 'a> {
    Ascii { line: &'a [u8], read: usize },
    Binary { rest: &'r mut &'a [u8], big_endian: bool },
}

impl<'a> Body<'a> {
    /// Goes to the next element.
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
    /// The next value.
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

    /// The length of a list of `item`s, held against the bytes that are left.
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

    /// Checks that the line holds no more values.
    fn end(self) -> Result<(), Fault> {
        match self.values {
            Values::Ascii { line, read } if !line.trim_ascii().is_empty() => {
                let what = format!("the line goes on after its {read} values; repair it or export the mesh again");
                Err(Fault::malformed(self.place, what))
            }
            _ => Ok(()),
        }
    }
}
