//! Recordings: rows are written in each format, and then read again to the same bits.

use std::io::Cursor;

use palpus::render::Settings;
use palpus_io::RecordingWriter;
use palpus_io::record::{Recording, RecordingFormat, read_recording_from};

use crate::{Seed, check, sample};

const FORMATS: [RecordingFormat; 3] = [RecordingFormat::Csv, RecordingFormat::Parquet, RecordingFormat::Mcap];

/// Reads a recording of whatever format.
pub fn read_and_write(data: &[u8]) {
    match read_recording_from(data, "run.csv") {
        Ok(recording) => {
            // In CSV all bits can be compared: NaNs differ from themselves, and
            // how the other formats are cut into pieces is a matter of time.
            let first = written(&recording, RecordingFormat::Csv);
            for format in FORMATS {
                let again = read_recording_from(written(&recording, format).as_slice(), "again");
                let again = again.expect("what is written can be read");
                assert_eq!(again.notice, None);
                // A change behind the last row is of no tick, and of two for the same tick only the
                // last is.
                assert!(again.changes.len() <= recording.changes.len());
                assert!(written(&again, RecordingFormat::Csv) == first, "{format:?} keeps no bits");
            }
        }
        Err(error) => check::error(&error.to_string(), "run.csv"),
    }
}

fn written(recording: &Recording, format: RecordingFormat) -> Vec<u8> {
    let memory = Cursor::new(Vec::new());
    let mut writer = RecordingWriter::new(memory, format, &recording.header).expect("memory takes everything");
    recording.changes.iter().for_each(|(tick, settings)| writer.change(*tick, settings));
    recording.rows.iter().for_each(|row| writer.write(row).expect("memory takes everything"));
    writer.finish().expect("memory takes everything").into_inner()
}

/// A small recording in a format, whole and cut off.
pub fn seeds(format: RecordingFormat) -> Vec<Seed> {
    let mut more = toml::Table::new();
    more.insert("note".to_owned(), "two\nlines # and\t\"quotes\"".into());
    let header = sample::header(more);
    let changed = Settings { stiffness: 1234.5, ..header.scene.render };
    let rows = vec![sample::row(0), sample::row(1)];
    let recording = Recording { header, rows, changes: vec![(1, changed)], notice: None };
    let whole = written(&recording, format);
    let cut = whole[..whole.len() - 9].to_vec();
    vec![("whole".to_owned(), whole), ("cut".to_owned(), cut)]
}
