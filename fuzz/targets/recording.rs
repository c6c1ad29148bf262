//! Recordings in CSV: what is read is written, and then read again to the same bits.
#![no_main]

use palpus::render::Settings;
use palpus_fuzz::{Allowance, Seed, check, sample, target};
use palpus_io::RecordingWriter;
use palpus_io::record::{Recording, read_recording_from};

fn run(data: &[u8]) {
    match read_recording_from(data, "run.csv") {
        Ok(recording) => {
            let (first, again) = write_and_read(&recording);
            assert_eq!(again.notice, None);
            // Written, since numbers that are none differ from themselves.
            assert_eq!(write_and_read(&again).0, first);
        }
        Err(error) => check::error(&error.to_string(), "run.csv"),
    }
}

fn write_and_read(recording: &Recording) -> (Vec<u8>, Recording) {
    let mut writer = RecordingWriter::new(Vec::new(), &recording.header).expect("memory takes everything");
    recording.changes.iter().for_each(|(tick, settings)| writer.change(*tick, settings));
    recording.rows.iter().for_each(|row| writer.write(row).expect("memory takes everything"));
    let bytes = writer.finish().expect("memory takes everything");
    let again = read_recording_from(bytes.as_slice(), "again.csv").expect("what is written can be read");
    // As text, since a number that is none differs from itself.
    assert_eq!(format!("{:?}", again.header), format!("{:?}", recording.header));
    assert_eq!(again.rows.len(), recording.rows.len());
    // A change behind the last row is of no tick, and of two for the same tick only the last is.
    assert!(again.changes.len() <= recording.changes.len());
    (bytes, again)
}

fn seeds() -> Vec<Seed> {
    let mut more = toml::Table::new();
    more.insert("note".to_owned(), "two\nlines # and\t\"quotes\"".into());
    let header = sample::header(more);
    let header_settings = Settings { stiffness: 1234.5, ..header.scene.render };
    let recording = Recording {
        header,
        rows: vec![sample::row(0), sample::row(1)],
        changes: vec![(1, header_settings)],
        notice: None,
    };
    let whole = write_and_read(&recording).0;
    let cut = whole[..whole.len() - 9].to_vec();
    vec![("whole".to_owned(), whole), ("cut".to_owned(), cut)]
}

target!(run: run, allowance: Allowance { per_byte: 400, always: 2 << 20 }, seeds: seeds);
