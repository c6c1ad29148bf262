//! Reads a Parquet recording. Only the output of [`Writer`](super::Writer) is supported.
//!
//! 1. Find the footer at the end, or the last complete footer before it.
//! 2. Read each row group, column by column. The groups must follow each other in the file, so that
//!    no byte is read twice, even if a footer is malicious.
//! 3. Assemble the rows from their columns.

use std::io::{self, Read, Seek, SeekFrom};

use super::meta::{Column, Footer, Group, MAGIC, columns, read_footer, read_page};
use super::thrift::Input;
use crate::TableError;
use crate::record::columns::{Kind, Take, take};
use crate::record::{Recording, change};

/// Number of bytes at the end of the file that are searched for a complete footer: more than the
/// largest piece that could be truncated.
const MOST_CUT_OFF: u64 = 1 << 26;

/// Largest number of candidates for the end of a footer that are tried.
const MOST_TRIED: usize = 16;

/// Size of a footer's length and the magic number after it, in bytes.
const ENDING: u64 = 8;

/// Reads a recording; `name` is the name of the file in error messages.
pub(in crate::record) fn read(input: &mut (impl Read + Seek), name: &str) -> Result<Recording, TableError> {
    let wrong = |problem: String| TableError::at(name, 0, problem);
    let unreadable = |error: io::Error| TableError::at(name, 0, format!("cannot be read ({error})"));
    let length = input.seek(SeekFrom::End(0)).map_err(unreadable)?;
    let (footer, end) = match footer_before(input, length).map_err(unreadable)? {
        Ok(found) => found,
        Err(problem) => match earlier_footer(input, length).map_err(unreadable)? {
            Some(found) => found,
            None => return Err(wrong(problem)),
        },
    };
    let mut recording = Recording::empty(footer.header);
    let mut read_to = MAGIC.len() as u64;
    for (k, group) in footer.groups.iter().enumerate() {
        let problem = |problem: &str| wrong(format!("row group {k}: {problem}"));
        let bytes = group_bytes(input, group, &mut read_to, end).map_err(unreadable)?;
        let bytes = bytes.ok_or_else(|| problem("it is not at the position in the footer"))?;
        rows(group, &bytes, &mut recording).map_err(|error| problem(&error))?;
    }
    if end < length {
        let whole = recording.rows.len();
        let notice = format!("{name}, byte {end}: truncated or damaged from here on; {whole} ticks are complete");
        recording.notice = Some(notice);
    }
    Ok(recording)
}

/// Returns the footer that ends at `end`, together with `end`; the inner error describes a problem.
fn footer_before(input: &mut (impl Read + Seek), end: u64) -> io::Result<Result<(Footer, u64), String>> {
    let cut_off = || Ok(Err("the Parquet file is incomplete: it has no footer at its end".to_owned()));
    if end < MAGIC.len() as u64 + ENDING {
        return cut_off();
    }
    let ending = bytes(input, end - ENDING, ENDING)?;
    let Some((size, MAGIC)) = ending.split_first_chunk() else { return cut_off() };
    let size = u64::from(u32::from_le_bytes(*size));
    let Some(begin) = (end - ENDING).checked_sub(size).filter(|begin| *begin >= MAGIC.len() as u64) else {
        return cut_off();
    };
    Ok(read_footer(&bytes(input, begin, size)?).map(|footer| (footer, end)))
}

/// Returns the last complete footer before `end`, for a file whose last piece is truncated.
fn earlier_footer(input: &mut (impl Read + Seek), end: u64) -> io::Result<Option<(Footer, u64)>> {
    let begin = end.saturating_sub(MOST_CUT_OFF);
    let last = bytes(input, begin, end - begin)?;
    let ends = last.windows(MAGIC.len()).enumerate().rev().filter(|(_, window)| *window == MAGIC);
    for (k, _) in ends.take(MOST_TRIED) {
        if let Ok(found) = footer_before(input, begin + (k + MAGIC.len()) as u64)? {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// Reads up to `length` bytes at offset `at`.
fn bytes(input: &mut (impl Read + Seek), at: u64, length: u64) -> io::Result<Vec<u8>> {
    input.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    input.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the bytes of a group; `None` if the group overlaps earlier groups or the footer.
/// Advances `read_to` to the end of the group.
fn group_bytes(
    input: &mut (impl Read + Seek),
    group: &Group,
    read_to: &mut u64,
    end: u64,
) -> io::Result<Option<Vec<u8>>> {
    let begin = group.at();
    if begin < *read_to {
        return Ok(None);
    }
    let mut at = begin;
    for chunk in &group.chunks {
        match chunk.at.checked_add(chunk.length) {
            Some(next) if chunk.at == at && next <= end => at = next,
            _ => return Ok(None),
        }
    }
    *read_to = at;
    bytes(input, begin, at - begin).map(|bytes| (bytes.len() as u64 == at - begin).then_some(bytes))
}

/// Appends the rows of a group to a recording.
fn rows(group: &Group, bytes: &[u8], recording: &mut Recording) -> Result<(), String> {
    let damaged = |column: &Column| format!("column {} is damaged", column.name);
    let format = recording.header.format;
    let columns = columns(format);
    let rows = usize::try_from(group.rows).map_err(|_| "it has too many rows")?;
    let mut values = Vec::new();
    for (chunk, column) in group.chunks.iter().zip(&columns) {
        let at = (chunk.at - group.at()) as usize;
        let chunk = bytes.get(at..at + chunk.length as usize).ok_or_else(|| damaged(column))?;
        // The first column has eight bytes for each row, so reading it verifies the number of rows.
        values.push(read_column(column, chunk, rows).ok_or_else(|| damaged(column))?);
    }
    let texts = values.pop();
    let mut cursor = Cursor { columns: &values, column: 0, row: 0 };
    for row in 0..rows {
        (cursor.column, cursor.row) = (0, row);
        recording.rows.push(take(format, &mut cursor).map_err(|Missing| "its columns have different lengths")?);
    }
    if let Some(Values::Texts(texts)) = texts {
        for line in texts.iter().flat_map(|text| text.lines()) {
            recording.changes.push(change::read(line)?);
        }
    }
    Ok(())
}

/// The values of a column.
enum Values<'a> {
    /// Values of equal size.
    Plain(&'a [u8]),
    Optional(Vec<Option<f64>>),
    /// Values packed as bits.
    Flags(&'a [u8]),
    /// The values of the rows that have a value.
    Texts(Vec<&'a str>),
}

/// Reads the only page of a column; `None` if the page does not fit `rows` rows.
fn read_column<'a>(column: &Column, chunk: &'a [u8], rows: usize) -> Option<Values<'a>> {
    let mut input = Input(chunk);
    let (in_page, length) = read_page(&mut input)?;
    let mut page = input.0;
    if in_page != rows as u64 || length != page.len() as u64 {
        return None;
    }
    let has = if column.is_optional() { levels(&mut page, rows)? } else { Vec::new() };
    match column.kind {
        Some(Kind::Flag) => (page.len() == rows.div_ceil(8)).then_some(Values::Flags(page)),
        Some(Kind::Optional) => optional(page, &has).map(Values::Optional),
        None => texts(page, &has).map(Values::Texts),
        _ => (page.len() == column.width()?.checked_mul(rows)?).then_some(Values::Plain(page)),
    }
}

/// Removes the definition levels from a page. The levels are packed bits that say which rows have a
/// value.
fn levels(page: &mut &[u8], rows: usize) -> Option<Vec<bool>> {
    let (length, rest) = page.split_first_chunk()?;
    let (run, values) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *page = values;
    let mut run = Input(run);
    if run.varint()? != (rows.div_ceil(8) as u64) << 1 | 1 || run.0.len() != rows.div_ceil(8) {
        return None;
    }
    Some((0..rows).map(|k| bit(run.0, k)).collect())
}

fn bit(bits: &[u8], k: usize) -> bool {
    bits.get(k / 8).is_some_and(|byte| byte >> (k % 8) & 1 == 1)
}

fn optional(mut page: &[u8], has: &[bool]) -> Option<Vec<Option<f64>>> {
    let mut values = Vec::new();
    for has in has {
        values.push(match has {
            true => {
                let (value, rest) = page.split_first_chunk()?;
                page = rest;
                Some(f64::from_le_bytes(*value))
            }
            false => None,
        });
    }
    page.is_empty().then_some(values)
}

fn texts<'a>(mut page: &'a [u8], has: &[bool]) -> Option<Vec<&'a str>> {
    let mut texts = Vec::new();
    for _ in has.iter().filter(|has| **has) {
        let (length, rest) = page.split_first_chunk()?;
        let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        page = rest;
        texts.push(std::str::from_utf8(text).ok()?);
    }
    page.is_empty().then_some(texts)
}

/// Iterates over the columns of a row.
struct Cursor<'a> {
    columns: &'a [Values<'a>],
    column: usize,
    row: usize,
}

/// Error: a value is missing.
struct Missing;

impl Cursor<'_> {
    fn next(&mut self) -> Result<&Values<'_>, Missing> {
        self.column += 1;
        self.columns.get(self.column - 1).ok_or(Missing)
    }

    fn plain<const N: usize>(&mut self) -> Result<[u8; N], Missing> {
        let row = self.row;
        match self.next()? {
            Values::Plain(bytes) => bytes.get(row * N..).and_then(|rest| rest.first_chunk()).copied().ok_or(Missing),
            _ => Err(Missing),
        }
    }
}

impl Take for Cursor<'_> {
    type Error = Missing;

    fn long(&mut self) -> Result<u64, Missing> {
        self.plain().map(u64::from_le_bytes)
    }

    fn whole(&mut self) -> Result<u32, Missing> {
        self.plain().map(u32::from_le_bytes)
    }

    fn double(&mut self) -> Result<f64, Missing> {
        self.plain().map(f64::from_le_bytes)
    }

    fn optional(&mut self) -> Result<Option<f64>, Missing> {
        let row = self.row;
        match self.next()? {
            Values::Optional(values) => values.get(row).copied().ok_or(Missing),
            _ => Err(Missing),
        }
    }

    fn flag(&mut self) -> Result<bool, Missing> {
        let row = self.row;
        match self.next()? {
            Values::Flags(bits) => Ok(bit(bits, row)),
            _ => Err(Missing),
        }
    }
}
