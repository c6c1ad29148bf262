//! Writes a recording as Parquet.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

use super::meta::{Chunk, Group, MAGIC, columns, write_footer, write_page};
use super::thrift::varint;
use crate::record::columns::{Put, put};
use crate::record::{Piece, RecordRow};

/// Number of rows of a large group. At most these rows and one piece are in memory: 35 MB.
pub(super) const MERGED: usize = 1 << 16;

/// Collects rows into groups.
pub(in crate::record) struct Writer {
    header: String,
    /// Version of the recording format.
    format: u32,
    /// Number of bytes already returned.
    written: u64,
    /// The groups in use.
    groups: Vec<Group>,
    /// Rows that are not yet in a large group.
    tail: Tail,
    /// Number of rows of `tail` that are in small groups, and the number of these groups.
    in_small: usize,
    small: usize,
}

/// Rows, and the changes of settings before them.
#[derive(Default)]
struct Tail {
    rows: Vec<RecordRow>,
    /// Index of the row and the lines of text.
    changes: Vec<(usize, String)>,
}

impl Writer {
    /// Starts a file of version `format` with this header and no rows.
    pub(in crate::record) fn new(header: &str, format: u32) -> Self {
        let header = header.to_owned();
        Self { header, format, written: 0, groups: Vec::new(), tail: Tail::default(), in_small: 0, small: 0 }
    }

    /// Adds a change of settings before the next row.
    pub(in crate::record) fn change(&mut self, line: &str) {
        let next = self.tail.rows.len();
        match self.tail.changes.last_mut() {
            Some((row, lines)) if *row == next => {
                lines.push('\n');
                lines.push_str(line);
            }
            _ => self.tail.changes.push((next, line.to_owned())),
        }
    }

    /// Adds a row.
    pub(in crate::record) fn row(&mut self, row: &RecordRow) {
        self.tail.rows.push(*row);
    }

    /// Returns the new rows as a group, followed by a footer that lists all groups.
    pub(in crate::record) fn flush(&mut self) -> Piece {
        let at = self.written;
        let mut bytes = if at == 0 { MAGIC.to_vec() } else { Vec::new() };
        if self.tail.rows.len() >= MERGED {
            self.groups.truncate(self.groups.len() - self.small);
            self.groups.push(self.tail.group(self.format, 0, at, &mut bytes));
            (self.tail, self.in_small, self.small) = (Tail::default(), 0, 0);
        } else if self.tail.rows.len() > self.in_small {
            self.groups.push(self.tail.group(self.format, self.in_small, at, &mut bytes));
            self.in_small = self.tail.rows.len();
            self.small += 1;
        }
        write_footer(&mut bytes, &self.header, self.format, &self.groups);
        self.written += bytes.len() as u64;
        Piece { at, bytes }
    }
}

/// Copies the groups in use of a finished recording to a new file, which then replaces the old
/// file. If the copy fails, the old file remains. The old file is complete, but larger than
/// necessary.
pub(in crate::record) fn compact(writer: &Writer, path: &Path) {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    let Ok(new) = OpenOptions::new().write(true).create_new(true).open(&name) else { return };
    let copied = File::open(path).and_then(|mut old| copy(writer, &mut old, new));
    if copied.and_then(|()| fs::rename(&name, path)).is_err() {
        // The original file is still complete.
        let _ = fs::remove_file(&name);
    }
}

fn copy(writer: &Writer, old: &mut File, mut new: File) -> io::Result<()> {
    new.write_all(MAGIC)?;
    let mut at = MAGIC.len() as u64;
    let mut groups = Vec::new();
    for group in &writer.groups[..writer.groups.len() - writer.small] {
        old.seek(SeekFrom::Start(group.at()))?;
        io::copy(&mut old.take(group.length()), &mut new)?;
        groups.push(group.moved(at));
        at += group.length();
    }
    let mut rest = Vec::new();
    if !writer.tail.rows.is_empty() {
        groups.push(writer.tail.group(writer.format, 0, at, &mut rest));
    }
    write_footer(&mut rest, &writer.header, writer.format, &groups);
    new.write_all(&rest)
}

impl Tail {
    /// Appends the rows from index `from` on as a group to a piece that is written at offset `at`.
    fn group(&self, format: u32, from: usize, at: u64, out: &mut Vec<u8>) -> Group {
        let rows = &self.rows[from..];
        let columns = columns(format);
        let mut pages = Pages { pages: columns.iter().map(|_| Page::default()).collect(), row: 0, column: 0 };
        let mut changes = self.changes.iter().filter(|(row, _)| *row >= from).peekable();
        for (k, row) in rows.iter().enumerate() {
            (pages.row, pages.column) = (k, 0);
            put(row, format, &mut pages);
            pages.text(changes.next_if(|(row, _)| *row == from + k).map(|(_, lines)| lines.as_str()));
        }
        let mut chunks = Vec::new();
        for (page, column) in pages.pages.into_iter().zip(columns) {
            let begin = out.len();
            let levels = if column.is_optional() { page.levels() } else { Vec::new() };
            write_page(out, rows.len(), levels.len() + page.values.len());
            out.extend(levels);
            out.extend(page.values);
            chunks.push(Chunk { at: at + begin as u64, length: (out.len() - begin) as u64 });
        }
        Group { rows: rows.len() as u64, chunks }
    }
}

/// The values of a group, column by column.
struct Pages {
    pages: Vec<Page>,
    row: usize,
    column: usize,
}

/// The values of one column.
#[derive(Default)]
struct Page {
    values: Vec<u8>,
    /// One bit for each row: 1 if the row has a value.
    has: Vec<u8>,
}

impl Page {
    /// Returns the definition levels, preceded by their length: a single run of packed bits.
    fn levels(&self) -> Vec<u8> {
        let mut run = Vec::new();
        varint(&mut run, (self.has.len() as u64) << 1 | 1);
        run.extend(&self.has);
        let mut levels = (run.len() as u32).to_le_bytes().to_vec();
        levels.extend(run);
        levels
    }
}

/// Appends bit number `k`.
fn put_bit(bits: &mut Vec<u8>, k: usize, value: bool) {
    if k.is_multiple_of(8) {
        bits.push(0);
    }
    if let Some(last) = bits.last_mut() {
        *last |= u8::from(value) << (k % 8);
    }
}

impl Pages {
    fn next(&mut self) -> &mut Page {
        self.column += 1;
        &mut self.pages[self.column - 1]
    }

    fn text(&mut self, value: Option<&str>) {
        let row = self.row;
        let page = self.next();
        put_bit(&mut page.has, row, value.is_some());
        if let Some(text) = value {
            page.values.extend((text.len() as u32).to_le_bytes());
            page.values.extend(text.bytes());
        }
    }
}

impl Put for Pages {
    fn long(&mut self, value: u64) {
        self.next().values.extend(value.to_le_bytes());
    }

    fn whole(&mut self, value: u32) {
        self.next().values.extend(value.to_le_bytes());
    }

    fn double(&mut self, value: f64) {
        self.next().values.extend(value.to_le_bytes());
    }

    fn optional(&mut self, value: Option<f64>) {
        let row = self.row;
        let page = self.next();
        put_bit(&mut page.has, row, value.is_some());
        page.values.extend(value.into_iter().flat_map(f64::to_le_bytes));
    }

    fn flag(&mut self, value: bool) {
        let row = self.row;
        put_bit(&mut self.next().values, row, value);
    }
}
