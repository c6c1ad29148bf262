//! Checks that recordings that are written in each format and read again have the same bits.

use std::io::Cursor;

use palpus::render::Settings;
use palpus_io::RecordingWriter;
use palpus_io::record::{Recording, RecordingFormat, read_recording_from};

use crate::{Seed, check, sample};

const FORMATS: [RecordingFormat; 3] = [RecordingFormat::Csv, RecordingFormat::Parquet, RecordingFormat::Mcap];

/// Reads a recording in any format, writes it in each format, and reads it again.
pub fn read_and_write(data: &[u8]) {
    match read_recording_from(data, "run.csv") {
        Ok(recording) => {
            // The comparison uses CSV, where all bits can be compared: NaN is not equal to itself,
            // and the division of the other formats into pieces depends on the time.
            let first = written(&recording, RecordingFormat::Csv);
            for format in FORMATS {
                let again = read_recording_from(written(&recording, format).as_slice(), "again");
                let again = again.expect("a readable recording");
                assert_eq!(again.notice, None);
                // Changes after the last row are not written, and if there are several changes for
                // one tick, only the last is written.
                assert!(again.changes.len() <= recording.changes.len());
                assert!(written(&again, RecordingFormat::Csv) == first, "{format:?} changes bits");
            }
        }
        Err(error) => check::error(&error.to_string(), "run.csv"),
    }
}

fn written(recording: &Recording, format: RecordingFormat) -> Vec<u8> {
    let memory = Cursor::new(Vec::new());
    let mut writer = RecordingWriter::new(memory, format, &recording.header).expect("writing to memory succeeds");
    recording.changes.iter().for_each(|(tick, settings)| writer.change(*tick, settings));
    recording.rows.iter().for_each(|row| writer.write(row).expect("writing to memory succeeds"));
    writer.finish().expect("writing to memory succeeds").into_inner()
}

/// Returns a small recording in a format, complete and truncated.
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
