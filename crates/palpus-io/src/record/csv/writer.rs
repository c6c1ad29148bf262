//! Writes a recording as CSV.

use crate::record::columns::{Put, names_of, put};
use crate::record::{Piece, RecordRow};
use crate::table::Line;

/// Converts rows to lines.
pub(in crate::record) struct Writer {
    /// Version of the recording format.
    format: u32,
    line: Line,
    lines: Vec<u8>,
    /// Number of bytes already returned.
    written: u64,
}

impl Writer {
    /// Starts a file with the header (each line after `# `) and the names of the columns of version
    /// `format`.
    pub(in crate::record) fn new(header: &str, format: u32) -> Self {
        let mut writer = Self { format, line: Line::default(), lines: Vec::new(), written: 0 };
        header.lines().for_each(|line| writer.comment(line));
        writer.lines.extend(names_of(format).join(",").bytes());
        writer.lines.push(b'\n');
        writer
    }

    fn comment(&mut self, text: &str) {
        self.lines.push(b'#');
        if !text.is_empty() {
            self.lines.push(b' ');
            self.lines.extend(text.bytes());
        }
        self.lines.push(b'\n');
    }

    /// Appends a change of settings, which applies from the next row on.
    pub(in crate::record) fn change(&mut self, text: &str) {
        self.comment(text);
    }

    /// Appends a tick as one complete line.
    pub(in crate::record) fn row(&mut self, row: &RecordRow) {
        self.line.clear();
        put(row, self.format, &mut self.line);
        self.lines.extend(self.line.end());
    }

    /// Returns the bytes since the last call.
    pub(in crate::record) fn flush(&mut self) -> Piece {
        let bytes = std::mem::take(&mut self.lines);
        let at = self.written;
        self.written += bytes.len() as u64;
        Piece { at, bytes }
    }
}

impl Put for Line {
    fn long(&mut self, value: u64) {
        self.cell(value);
    }

    fn whole(&mut self, value: u32) {
        self.cell(value);
    }

    fn double(&mut self, value: f64) {
        self.numbers([value]);
    }

    fn optional(&mut self, value: Option<f64>) {
        match value {
            Some(value) => self.numbers([value]),
            None => self.cell(""),
        }
    }

    fn flag(&mut self, value: bool) {
        self.cell(u8::from(value));
    }
}
