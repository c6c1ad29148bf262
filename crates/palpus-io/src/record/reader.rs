//! Reads a recording in any format.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor};
use std::path::Path;

use palpus::render::Settings;

use super::{RecordRow, RecordingFormat, RecordingHeader, csv, mcap, parquet};
use crate::table::TableError;

/// A complete recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The header.
    pub header: RecordingHeader,
    /// The ticks, as recorded.
    pub rows: Vec<RecordRow>,
    /// Changes of the engine's settings: the first tick with the new settings, and the settings;
    /// sorted by tick. The header contains the initial settings.
    pub changes: Vec<(u64, Settings)>,
    /// Describes what was omitted from a truncated or damaged file; `None` for a complete file.
    pub notice: Option<String>,
}

impl Recording {
    /// Returns a recording without ticks.
    pub(super) fn empty(header: RecordingHeader) -> Self {
        Self { header, rows: Vec::new(), changes: Vec::new(), notice: None }
    }
}

/// Reads a recording of any format from a file. The format is recognised by the first bytes, not by
/// the file name.
pub fn read_recording(path: &Path) -> Result<Recording, TableError> {
    let name = path.display().to_string();
    let problem = |error| TableError::at(&name, 0, format!("cannot be read ({error}); check the path"));
    let mut input = BufReader::new(File::open(path).map_err(problem)?);
    let format = format_of(&mut input).map_err(problem)?;
    match format {
        RecordingFormat::Parquet => in_order(parquet::read(&mut input, &name)),
        _ => read_stream(format, input, &name),
    }
}

/// Reads a recording of any format, which is recognised by the first bytes; `name` is the name of
/// the file in error messages.
pub fn read_recording_from(mut input: impl BufRead, name: &str) -> Result<Recording, TableError> {
    let problem = |error| TableError::at(name, 0, format!("cannot be read ({error})"));
    let format = format_of(&mut input).map_err(problem)?;
    if format != RecordingFormat::Parquet {
        return read_stream(format, input, name);
    }
    let mut bytes = Vec::new();
    input.read_to_end(&mut bytes).map_err(problem)?;
    in_order(parquet::read(&mut Cursor::new(bytes), name))
}

fn format_of(input: &mut impl BufRead) -> std::io::Result<RecordingFormat> {
    Ok(RecordingFormat::of_content(input.fill_buf()?))
}

fn read_stream(format: RecordingFormat, input: impl BufRead, name: &str) -> Result<Recording, TableError> {
    in_order(match format {
        RecordingFormat::Mcap => mcap::read(input, name),
        _ => csv::read(input, name),
    })
}

/// Sorts the changes by tick, because a change may have been written late.
fn in_order(recording: Result<Recording, TableError>) -> Result<Recording, TableError> {
    let mut recording = recording?;
    recording.changes.sort_by_key(|(tick, _)| *tick);
    Ok(recording)
}
