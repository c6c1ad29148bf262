//! Reads the header of a PLY file.

use super::Body;
use crate::mesh::fault::{Fault, Place};
use crate::mesh::lines::{Lines, shown};

/// A number type of the PLY format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
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

    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// Decodes a value from exactly [`Scalar::size`] bytes.
    pub(super) fn value(self, bytes: &[u8], big_endian: bool) -> f64 {
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

pub(super) struct Property {
    pub(super) name: Vec<u8>,
    /// The type of the length, if the property is a list.
    pub(super) length: Option<Scalar>,
    pub(super) item: Scalar,
}

pub(super) struct Element {
    pub(super) name: Vec<u8>,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

/// Reads the header; returns the elements that it declares, and the rest of the file.
pub(super) fn read_header(bytes: &[u8]) -> Result<(Vec<Element>, Body<'_>), Fault> {
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

/// Returns `Some(big_endian)` for a binary format and `None` for ASCII.
fn read_format(kind: &[u8], version: &[u8], place: Place) -> Result<Option<bool>, Fault> {
    if version != b"1.0" {
        let what = format!("PLY version {} is not supported, only 1.0; export the mesh again", shown(version));
        return Err(Fault::unsupported(place, what));
    }
    match kind {
        b"ascii" => Ok(None),
        b"binary_little_endian" => Ok(Some(false)),
        b"binary_big_endian" => Ok(Some(true)),
        _ => Err(Fault::unsupported(
            place,
            format!("PLY format {} is not supported; export the mesh again", shown(kind)),
        )),
    }
}

/// Parses a property from the words after `property`; `None` if these words are invalid.
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

/// Returns the bytes after the header. If lines end in a lone `\r`, a `\n` at the start of these
/// bytes is data.
fn body_bytes<'a>(bytes: &'a [u8], lines: &Lines<'_>) -> &'a [u8] {
    let mut start = bytes.len() - lines.remaining() as usize;
    let lone_return = bytes.get(3) == Some(&b'\r') && bytes.get(4) != Some(&b'\n');
    if lone_return && start > 0 && bytes[start - 1] == b'\n' {
        start -= 1;
    }
    &bytes[start..]
}
