//! Metadata of a Parquet file: its footer, and the header of each page.

use super::thrift::{self, Fields, Input, Kind as Thrift};

use crate::record::columns::{Kind, column_names, columns_of};
use crate::record::{FORMAT, RecordingHeader};

/// The first and the last bytes of a file.
pub(in crate::record) const MAGIC: &[u8] = b"PAR1";

/// Key of the recording's header in the file's metadata.
const KEY: &str = "palpus";

/// Name and type of a column.
pub(super) struct Column {
    pub(super) name: &'static str,
    /// Kind of the values; `None` for text.
    pub(super) kind: Option<Kind>,
}

/// Returns the columns of a file of version `format`, in their order.
pub(super) fn columns(format: u32) -> Vec<Column> {
    let rows = columns_of(format).iter().map(|(name, kind)| Column { name, kind: Some(*kind) });
    rows.chain([Column { name: crate::record::change::KEY, kind: None }]).collect()
}

impl Column {
    /// Returns Parquet's physical type.
    fn physical(&self) -> i32 {
        match self.kind {
            Some(Kind::Flag) => 0,
            Some(Kind::Whole) => 1,
            Some(Kind::Long) => 2,
            Some(Kind::Double | Kind::Optional) => 5,
            None => 6,
        }
    }

    /// Returns the logical type: text or an unsigned number.
    fn converted(&self) -> Option<i32> {
        match self.kind {
            None => Some(0),
            Some(Kind::Whole) => Some(13),
            Some(Kind::Long) => Some(14),
            _ => None,
        }
    }

    /// Returns true if the value may be missing in a row.
    pub(super) fn is_optional(&self) -> bool {
        matches!(self.kind, None | Some(Kind::Optional))
    }

    /// Returns the number of bytes of each value; `None` if the values have different sizes.
    pub(super) fn width(&self) -> Option<usize> {
        match self.kind {
            Some(Kind::Whole) => Some(4),
            Some(Kind::Long | Kind::Double) => Some(8),
            _ => None,
        }
    }
}

/// The only page of one column in a row group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Chunk {
    /// Offset in the file.
    pub(super) at: u64,
    /// Number of bytes, including the page header.
    pub(super) length: u64,
}

/// Position of a row group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Group {
    pub(super) rows: u64,
    /// Positions of the columns, in their order.
    pub(super) chunks: Vec<Chunk>,
}

impl Group {
    /// Returns the offset of the group in the file.
    pub(super) fn at(&self) -> u64 {
        self.chunks.first().map_or(0, |chunk| chunk.at)
    }

    /// Returns the total number of bytes of all columns.
    pub(super) fn length(&self) -> u64 {
        self.chunks.iter().map(|chunk| chunk.length).sum()
    }

    /// Returns the same group at another offset.
    pub(super) fn moved(&self, to: u64) -> Self {
        let from = self.at();
        let moved = |chunk: &Chunk| Chunk { at: chunk.at - from + to, length: chunk.length };
        Self { rows: self.rows, chunks: self.chunks.iter().map(moved).collect() }
    }
}

/// The content of a footer.
pub(super) struct Footer {
    pub(super) header: RecordingHeader,
    pub(super) groups: Vec<Group>,
}

/// Appends the footer of a recording of version `format`, its length, and the magic number.
pub(super) fn write_footer(out: &mut Vec<u8>, header: &str, format: u32, groups: &[Group]) {
    let begin = out.len();
    let columns = columns(format);
    thrift::write(out, |file| {
        file.int(1, 1);
        // The root, which is not a column, and the columns.
        let schema: Vec<Option<&Column>> = std::iter::once(None).chain(columns.iter().map(Some)).collect();
        file.structures(2, &schema, |column, element| write_element(*column, columns.len(), element));
        file.long(3, groups.iter().map(|group| group.rows).sum());
        file.structures(4, groups, |group, out| write_group(group, &columns, out));
        file.structures(5, &[header], |header, pair| {
            pair.text(1, KEY);
            pair.text(2, header);
        });
        file.text(6, concat!("palpus version ", env!("CARGO_PKG_VERSION")));
    });
    let length = (out.len() - begin) as u32;
    out.extend(length.to_le_bytes());
    out.extend(MAGIC);
}

fn write_element(column: Option<&Column>, width: usize, element: &mut Fields<'_>) {
    let Some(column) = column else {
        element.text(4, "recording");
        element.int(5, width as i32);
        return;
    };
    element.int(1, column.physical());
    element.int(3, i32::from(column.is_optional()));
    element.text(4, column.name);
    if let Some(converted) = column.converted() {
        element.int(6, converted);
    }
}

fn write_group(group: &Group, columns: &[Column], out: &mut Fields<'_>) {
    let chunks: Vec<(&Chunk, &Column)> = group.chunks.iter().zip(columns).collect();
    out.structures(1, &chunks, |(chunk, column), out| {
        out.long(2, chunk.at);
        out.structure(3, |out| {
            out.int(1, column.physical());
            // Encodings: plain for values, run lengths for the definition levels.
            out.ints(2, &[0, 3]);
            out.texts(3, column.name);
            // Codec: not compressed.
            out.int(4, 0);
            out.long(5, group.rows);
            out.long(6, chunk.length);
            out.long(7, chunk.length);
            out.long(9, chunk.at);
        });
    });
    out.long(2, group.length());
    out.long(3, group.rows);
}

/// Parses a footer without its length and the magic number; fails with a description of the
/// problem.
pub(super) fn read_footer(bytes: &[u8]) -> Result<Footer, String> {
    let mut header = None;
    let mut groups = Vec::new();
    let mut schema = Vec::new();
    let mut input = Input(bytes);
    input
        .structure(|number, kind, input| {
            match (number, kind) {
                (2, LIST) => each(input, |input| {
                    schema.push(read_element(input)?);
                    Some(())
                })?,
                (4, LIST) => each(input, |input| {
                    groups.push(read_group(input)?);
                    Some(())
                })?,
                (5, LIST) => each(input, |input| {
                    if let Some(value) = read_pair(input)? {
                        header = Some(value);
                    }
                    Some(())
                })?,
                _ => return Some(false),
            }
            Some(true)
        })
        .ok_or("the footer is damaged")?;
    let header = header.ok_or("it has no header of palpus (metadata `palpus`); is it a recording?")?;
    let header = RecordingHeader::of_text(&header).map_err(|error| error.problem)?;
    let columns = columns(header.format);
    check_schema(&schema, &columns)?;
    if groups.iter().any(|read| read.group.chunks.len() != columns.len()) {
        return Err("the footer is damaged".to_owned());
    }
    if groups.iter().any(|group: &Read| group.is_compressed) {
        return Err(
            "it was written by another program (its columns are compressed); only files written by palpus are supported".to_owned()
        );
    }
    Ok(Footer { header, groups: groups.into_iter().map(|read| read.group).collect() })
}

const LIST: u8 = Thrift::List as u8;
const TEXT: u8 = Thrift::Text as u8;
const INT: u8 = Thrift::Int as u8;
const LONG: u8 = Thrift::Long as u8;
const STRUCT: u8 = Thrift::Struct as u8;

/// Calls `item` for each struct of a list.
fn each<'a>(input: &mut Input<'a>, mut item: impl FnMut(&mut Input<'a>) -> Option<()>) -> Option<()> {
    let (kind, length) = input.list()?;
    if kind != STRUCT {
        return None;
    }
    for _ in 0..length {
        item(input)?;
    }
    Some(())
}

/// Name, type, repetition and logical type of an element of the schema.
type Element = (String, Option<i64>, Option<i64>, Option<i64>);

fn read_element(input: &mut Input<'_>) -> Option<Element> {
    let mut element: Element = Default::default();
    input.structure(|number, kind, input| {
        match (number, kind) {
            (1, INT) => element.1 = Some(input.int()?),
            (3, INT) => element.2 = Some(input.int()?),
            (4, TEXT) => element.0 = input.text()?.to_owned(),
            (6, INT) => element.3 = Some(input.int()?),
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some(element)
}

/// Checks that the columns are exactly those of a recording, in the same order.
fn check_schema(schema: &[Element], columns: &[Column]) -> Result<(), String> {
    let is_ours = schema.len() == columns.len() + 1
        && schema[1..].iter().zip(columns).all(|((name, physical, repetition, converted), column)| {
            name == column.name
                && *physical == Some(column.physical().into())
                && *repetition == Some(column.is_optional().into())
                && *converted == column.converted().map(i64::from)
        });
    let problem = || {
        format!(
            "the columns must be {},{}; was it written by another version?",
            column_names().join(","),
            crate::record::change::KEY
        )
    };
    if is_ours { Ok(()) } else { Err(problem()) }
}

/// Returns the value of a key-value pair if its key is [`KEY`].
fn read_pair(input: &mut Input<'_>) -> Option<Option<String>> {
    let (mut key, mut value) = ("", "");
    input.structure(|number, kind, input| {
        match (number, kind) {
            (1, TEXT) => key = input.text()?,
            (2, TEXT) => value = input.text()?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some((key == KEY).then(|| value.to_owned()))
}

struct Read {
    group: Group,
    is_compressed: bool,
}

fn read_group(input: &mut Input<'_>) -> Option<Read> {
    let mut read = Read { group: Group { rows: 0, chunks: Vec::new() }, is_compressed: false };
    input.structure(|number, kind, input| {
        match (number, kind) {
            (1, LIST) => each(input, |input| read_chunk(input, &mut read))?,
            (3, LONG) => read.group.rows = input.size()?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some(read)
}

fn read_chunk(input: &mut Input<'_>, read: &mut Read) -> Option<()> {
    let mut chunk = Chunk { at: 0, length: 0 };
    let mut compressed = false;
    input.structure(|number, kind, input| {
        if (number, kind) != (3, STRUCT) {
            return Some(false);
        }
        input.structure(|number, kind, input| {
            match (number, kind) {
                (4, INT) => compressed = input.int()? != 0,
                (7, LONG) => chunk.length = input.size()?,
                (9, LONG) => chunk.at = input.size()?,
                _ => return Some(false),
            }
            Some(true)
        })?;
        Some(true)
    })?;
    read.is_compressed |= compressed;
    // Rejects more columns than a row can have (one for each value and one for changes), because a
    // footer may claim any number.
    if read.group.chunks.len() > columns_of(FORMAT).len() {
        return None;
    }
    read.group.chunks.push(chunk);
    Some(())
}

/// Appends the header of a page with the given numbers of rows and bytes.
pub(super) fn write_page(out: &mut Vec<u8>, rows: usize, length: usize) {
    thrift::write(out, |page| {
        page.int(1, 0);
        page.int(2, length as i32);
        page.int(3, length as i32);
        page.structure(5, |page| {
            page.int(1, rows as i32);
            // Encodings: plain for values, run lengths for both kinds of levels.
            page.int(2, 0);
            page.int(3, 3);
            page.int(4, 3);
        });
    });
}

/// Returns the number of rows and of bytes of the page at the start of `input`; `None` if palpus
/// did not write the page.
pub(super) fn read_page(input: &mut Input<'_>) -> Option<(u64, u64)> {
    let (mut rows, mut length, mut raw, mut is_plain) = (None, None, None, false);
    input.structure(|number, kind, input| {
        match (number, kind) {
            (1, INT) if input.int()? != 0 => return None,
            (1, INT) => {}
            (2, INT) => raw = Some(input.size()?),
            (3, INT) => length = Some(input.size()?),
            (5, STRUCT) => input.structure(|number, kind, input| {
                match (number, kind) {
                    (1, INT) => rows = Some(input.size()?),
                    (2, INT) => is_plain = input.int()? == 0,
                    _ => return Some(false),
                }
                Some(true)
            })?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    (is_plain && raw == length).then_some((rows?, length?))
}
