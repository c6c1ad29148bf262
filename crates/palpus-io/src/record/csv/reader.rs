//! Reads a CSV recording.
//!
//! The file may be malicious: no line may be longer than [`LONGEST_LINE`], so that the memory stays
//! within a small multiple of the file size.

use std::io::{BufRead, Read};

use crate::TableError;
use crate::record::columns::{Take, column_names, names_of, take};
use crate::record::header::MOST_TEXT;
use crate::record::{FORMAT, Recording, RecordingHeader, change};
use crate::table::Cells;

/// Length of the longest line that is accepted, in bytes: the text of a scene file is on one line.
const LONGEST_LINE: u64 = MOST_TEXT as u64;

/// Reads a recording; `name` is the name of the file in error messages.
///
/// A last line without a line break is incomplete, because the program ended while it was written.
/// Such a line is omitted, and the recording contains a notice.
pub(in crate::record) fn read(input: impl BufRead, name: &str) -> Result<Recording, TableError> {
    let mut lines = Lines { input, name, line: 0, text: String::new() };
    let header = header(&mut lines)?;
    let format = header.format;
    let columns = names_of(format);
    let mut recording = Recording::empty(header);
    while lines.next()? {
        let line = lines.line;
        if !lines.is_whole() {
            let whole = recording.rows.len();
            let notice =
                format!("{name}, line {line}: the last line is incomplete and omitted; {whole} ticks are complete");
            recording.notice = Some(notice);
            break;
        }
        let text = lines.text.trim_end();
        match text.strip_prefix("# ").filter(|comment| comment.starts_with(change::KEY)) {
            Some(text) => {
                let change = change::read(text).map_err(|problem| TableError::at(name, line, problem))?;
                recording.changes.push(change);
            }
            None if text.starts_with('#') => {}
            None => recording.rows.push(take(format, &mut Cells::new(name, line, &columns, text)?)?),
        }
    }
    Ok(recording)
}

/// The lines of a stream, read one at a time into the same buffer.
struct Lines<'a, R> {
    input: R,
    name: &'a str,
    line: u64,
    text: String,
}

impl<R: BufRead> Lines<'_, R> {
    /// Reads the next line; returns false at the end of the stream.
    fn next(&mut self) -> Result<bool, TableError> {
        self.text.clear();
        self.line += 1;
        let read = self.input.by_ref().take(LONGEST_LINE).read_line(&mut self.text);
        let read = read.map_err(|error| TableError::at(self.name, self.line, format!("cannot be read ({error})")))?;
        if read as u64 == LONGEST_LINE {
            let problem = "the line is too long; is it a recording?";
            return Err(TableError::at(self.name, self.line, problem));
        }
        Ok(read > 0)
    }

    /// Returns true if the line has its line break.
    fn is_whole(&self) -> bool {
        self.text.ends_with('\n')
    }
}

/// Reads the file up to and including the line of column names.
fn header<R: BufRead>(lines: &mut Lines<'_, R>) -> Result<RecordingHeader, TableError> {
    let name = lines.name;
    let mut toml = String::new();
    while lines.next()? {
        // White space at the end of a line may belong to a multi-line string.
        let text = lines.text.strip_suffix('\n').unwrap_or(&lines.text);
        let text = text.strip_suffix('\r').unwrap_or(text);
        let entry = text.strip_prefix('#');
        // A header that is too long is rejected later, when it is parsed.
        if let Some(entry) = entry.filter(|_| toml.len() <= MOST_TEXT) {
            toml.push_str(entry.strip_prefix(' ').unwrap_or(entry));
            toml.push('\n');
            continue;
        }
        let has_columns_of = |format: u32| text == names_of(format).join(",");
        let other_columns = || {
            // A recording of any version begins with a comment or with this column.
            let problem = if toml.is_empty() && !text.starts_with(column_names()[0]) {
                "this is not a recording; `palpus run --record FILE` writes one".to_owned()
            } else {
                format!("the columns must be {}; was it written by another version?", column_names().join(","))
            };
            TableError::at(name, lines.line, problem)
        };
        if entry.is_none() && !(lines.is_whole() && (1..=FORMAT).any(has_columns_of)) {
            return Err(other_columns());
        }
        let header =
            RecordingHeader::of_text(&toml).map_err(|error| TableError::at(name, error.line, error.problem))?;
        return if has_columns_of(header.format) { Ok(header) } else { Err(other_columns()) };
    }
    Err(TableError::at(name, lines.line, "the file ends before the line of column names; the recording is incomplete"))
}

impl Take for Cells<'_> {
    type Error = TableError;

    fn long(&mut self) -> Result<u64, TableError> {
        self.next()
    }

    fn whole(&mut self) -> Result<u32, TableError> {
        self.next()
    }

    fn double(&mut self) -> Result<f64, TableError> {
        self.next()
    }

    fn optional(&mut self) -> Result<Option<f64>, TableError> {
        self.next()
    }

    fn flag(&mut self) -> Result<bool, TableError> {
        self.next()
    }
}
