//! Reads a recording.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::render::Settings;
use serde::Deserialize;

use super::{COLUMNS, FORMAT, RecordRow, RecordingHeader, change};
use crate::table::{Cells, TableError};

/// The longest line that is taken for one of a recording.
const LONGEST_LINE: u64 = 1 << 16;

/// A recording, whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was run.
    pub header: RecordingHeader,
    /// Its ticks, as recorded.
    pub rows: Vec<RecordRow>,
    /// From which tick on the engine had other settings than before, and which: in the order of the ticks. Those before the first
    /// are in the header.
    pub changes: Vec<(u64, Settings)>,
    /// Says that the last line was cut off and left out, if so.
    pub notice: Option<String>,
}

/// Reads a recording from a file; see [`read_recording_from`].
pub fn read_recording(path: &Path) -> Result<Recording, TableError> {
    let name = path.display().to_string();
    let file = File::open(path)
        .map_err(|error| TableError::at(&name, 0, format!("cannot be read ({error}); check the path")))?;
    read_recording_from(BufReader::new(file), &name)
}

/// Reads a recording; `name` is how errors call the file.
///
/// A last line without a line break was being written when the program ended: it is left out, with a notice.
pub fn read_recording_from(input: impl BufRead, name: &str) -> Result<Recording, TableError> {
    let mut lines = Lines { input, name, line: 0, text: String::new() };
    let header = read_header(&mut lines)?;
    let mut rows = Vec::new();
    let mut changes: Vec<(u64, Settings)> = Vec::new();
    let mut notice = None;
    while lines.next()? {
        if !lines.is_whole() {
            let line = lines.line;
            notice = Some(format!(
                "{name}, line {line}: the last line was cut off and is left out; {} ticks are whole",
                rows.len()
            ));
            break;
        }
        let text = lines.text.trim_end();
        match text.strip_prefix("# ").filter(|comment| comment.starts_with(change::KEY)) {
            Some(text) => {
                changes.push(change::read(text).map_err(|problem| TableError::at(name, lines.line, problem))?)
            }
            None if text.starts_with('#') => {}
            None => rows.push(row(name, lines.line, text)?),
        }
    }
    changes.sort_by_key(|(tick, _)| *tick);
    Ok(Recording { header, rows, changes, notice })
}

/// The lines of a stream, one at a time.
struct Lines<'a, R> {
    input: R,
    name: &'a str,
    line: u64,
    text: String,
}

impl<R: BufRead> Lines<'_, R> {
    /// Goes to the next line; false at the end.
    fn next(&mut self) -> Result<bool, TableError> {
        use std::io::Read;
        self.text.clear();
        self.line += 1;
        let read = self.input.by_ref().take(LONGEST_LINE).read_line(&mut self.text);
        let read = read.map_err(|error| TableError::at(self.name, self.line, format!("cannot be read ({error})")))?;
        if read as u64 == LONGEST_LINE {
            let problem = "the line is far too long; is it a recording?";
            return Err(TableError::at(self.name, self.line, problem));
        }
        Ok(read > 0)
    }

    /// True when the line has its line break.
    fn is_whole(&self) -> bool {
        self.text.ends_with('\n')
    }
}

/// The format's number, which decides how the rest is read.
#[derive(Deserialize)]
struct Version {
    format: i64,
}

/// Reads up to and with the line of column names.
fn read_header<R: BufRead>(lines: &mut Lines<'_, R>) -> Result<RecordingHeader, TableError> {
    let name = lines.name;
    let mut toml = String::new();
    while lines.next()? {
        let text = lines.text.trim_end();
        let Some(entry) = text.strip_prefix('#') else {
            if !lines.is_whole() || text != COLUMNS.join(",") {
                let problem = format!("the columns must be {}; was it written by another version?", COLUMNS.join(","));
                return Err(TableError::at(name, lines.line, problem));
            }
            return parse_header(&toml, name);
        };
        toml.push_str(entry.strip_prefix(' ').unwrap_or(entry));
        toml.push('\n');
    }
    Err(TableError::at(name, lines.line, "the file ends before the line of column names; it is no whole recording"))
}

fn parse_header(text: &str, name: &str) -> Result<RecordingHeader, TableError> {
    let wrong = |error: toml::de::Error| {
        let line = error.span().map_or(0, |span| 1 + text[..span.start.min(text.len())].matches('\n').count() as u64);
        TableError::at(name, line, format!("the header is wrong: {}", error.message().replace('\n', " ")))
    };
    let version: Version = toml::from_str(text).map_err(wrong)?;
    if version.format != FORMAT {
        let problem = format!(
            "recordings of format {} are not read, only {FORMAT}; use the palpus that wrote it",
            version.format
        );
        return Err(TableError::at(name, 1, problem));
    }
    toml::from_str(text).map_err(wrong)
}

/// The tick on a line.
fn row(name: &str, line: u64, text: &str) -> Result<RecordRow, TableError> {
    let mut cells = Cells::new(name, line, &COLUMNS, text)?;
    Ok(RecordRow {
        tick: cells.next()?,
        time_ns: cells.next()?,
        dt: cells.next()?,
        pose: {
            let translation = DVec3::from_array(cells.array()?);
            Pose { rotation: DQuat::from_array(cells.array()?), translation }
        },
        twist: Twist { angular: DVec3::from_array(cells.array()?), linear: DVec3::from_array(cells.array()?) },
        buttons: cells.next()?,
        wrench: Wrench { torque: DVec3::from_array(cells.array()?), force: DVec3::from_array(cells.array()?) },
        contacts: cells.next()?,
        clusters: cells.next()?,
        separation: cells.next()?,
        query_us: cells.next()?,
        depth_us: cells.next()?,
        force_us: cells.next()?,
        total_us: cells.next()?,
        saturated: cells.next()?,
        faults: cells.next()?,
    })
}
