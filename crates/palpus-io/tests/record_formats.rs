//! Recordings of every format are read back bit for bit, also after a crash. No input causes a
//! panic.

mod recorded;

use std::io::Cursor;

use glam::DVec3;
use palpus::render::Settings;
use palpus_io::record::{RecordingFormat, read_recording_from};
use palpus_io::{RecordRow, Recording, RecordingHeader, RecordingWriter, TableError, read_recording};
use proptest::prelude::*;
use recorded::{SEED, any_row, bits, header, plain, runner, settings};

const FORMATS: [RecordingFormat; 3] = [RecordingFormat::Csv, RecordingFormat::Parquet, RecordingFormat::Mcap];

type Writer = RecordingWriter<Cursor<Vec<u8>>>;

fn writer(format: RecordingFormat) -> Writer {
    RecordingWriter::new(Cursor::new(Vec::new()), format, &header()).unwrap()
}

fn bytes(writer: Writer) -> Vec<u8> {
    writer.finish().unwrap().into_inner()
}

fn read(bytes: &[u8]) -> Result<Recording, TableError> {
    read_recording_from(bytes, "run")
}

fn at(tick: u64) -> RecordRow {
    RecordRow { tick, time_ns: tick * 1_000_000, depth_us: (!tick.is_multiple_of(3)).then_some(0.1), ..plain() }
}

/// Returns a recording with `ticks` ticks, in pieces of three, and with a change of settings before
/// every fifth tick.
fn recorded(format: RecordingFormat, ticks: u64) -> (Vec<u8>, Vec<(u64, Settings)>) {
    let mut writer = writer(format);
    let mut changes = Vec::new();
    for tick in 0..ticks {
        if tick % 5 == 4 {
            changes.push((tick, Settings { stiffness: 1.0 / tick as f64, ..settings() }));
            writer.change(tick, &changes[changes.len() - 1].1);
        }
        writer.write(&at(tick)).unwrap();
        if tick % 3 == 2 {
            writer.flush().unwrap();
        }
    }
    (bytes(writer), changes)
}

#[test]
fn older_formats_are_read_and_written_unchanged() {
    // Older formats contain neither the start time nor the text of the scene file.
    let mut old = RecordingHeader { format: 1, start_utc: None, ..header() };
    old.scene.text = None;
    let names = |bytes: &[u8], name: &str| bytes.windows(name.len()).any(|window| window == name.as_bytes());
    for (version, format) in [1, 2].into_iter().flat_map(|version| FORMATS.map(|format| (version, format))) {
        let old = RecordingHeader { format: version, ..old.clone() };
        let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), format, &old).unwrap();
        let tool = at(0).tool.filter(|_| version == 2);
        let rows = [0, 1, 2].map(|tick| RecordRow { tool, servo: None, ..at(tick) });
        rows.iter().for_each(|row| writer.write(row).unwrap());
        let bytes = bytes(writer);
        let read = read(&bytes).unwrap();
        assert_eq!((&read.header, &read.rows[..]), (&old, &rows[..]), "{format:?} {version}");
        assert_eq!(names(&bytes, "tool_tx"), version == 2, "{format:?} {version}");
        assert!(!names(&bytes, "utc_ns"), "{format:?} {version}");
    }
    // In format 1 the device pose is the pose of the mesh's origin, which differs from the grip in
    // general.
    assert!(!old.has_grip_poses() && header().has_grip_poses());
    let mut at_origin = old;
    at_origin.scene.render.grip_a = DVec3::ZERO;
    assert!(at_origin.has_grip_poses());
}

#[test]
fn columns_must_match_the_format_in_the_header() {
    let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), RecordingFormat::Csv, &header()).unwrap();
    writer.write(&plain()).unwrap();
    let text = String::from_utf8(bytes(writer)).unwrap().replacen("format = 3", "format = 2", 1);
    let error = read(text.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("the columns must be"), "{error}");
}

#[test]
fn header_and_rows_are_read_back_exactly() {
    let pieces = prop::collection::vec(prop::collection::vec(any_row(), 0..12), 0..5);
    let run = runner(150).run(&pieces, |pieces| {
        for format in FORMATS {
            let mut writer = writer(format);
            for rows in &pieces {
                rows.iter().for_each(|row| writer.write(row).unwrap());
                writer.flush().unwrap();
            }
            let read = read(&bytes(writer)).unwrap();
            prop_assert_eq!(&read.header, &header());
            prop_assert_eq!(read.notice, None);
            let both = |rows: &[RecordRow]| rows.iter().map(bits).collect::<Vec<_>>();
            prop_assert_eq!(both(&read.rows), both(&pieces.concat()), "{:?}", format);
        }
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}

#[test]
fn late_changes_are_read_at_their_ticks() {
    for format in FORMATS {
        let (bytes, changes) = recorded(format, 23);
        let read = read(&bytes).unwrap();
        assert_eq!(read.rows, (0..23).map(at).collect::<Vec<_>>(), "{format:?}");
        assert_eq!(read.changes, changes, "{format:?}");

        let mut writer = writer(format);
        writer.write(&at(0)).unwrap();
        writer.write(&at(1)).unwrap();
        // This change applies from tick 1, but is written late because of a full queue.
        writer.change(1, &Settings { stiffness: 1.0, ..settings() });
        writer.change(2, &Settings { stiffness: 2.0, ..settings() });
        writer.write(&at(2)).unwrap();
        writer.change(7, &settings());
        let read = self::read(&self::bytes(writer)).unwrap();
        let ticks: Vec<_> = read.changes.iter().map(|(tick, settings)| (*tick, settings.stiffness)).collect();
        assert_eq!(ticks, [(1, 1.0), (2, 2.0)], "{format:?}");
    }
}

#[test]
fn file_is_complete_after_each_piece() {
    for format in FORMATS {
        let mut file = Vec::new();
        for ticks in [0, 3, 6, 9] {
            let mut writer = writer(format);
            for tick in 0..ticks {
                writer.write(&at(tick)).unwrap();
                if tick % 3 == 2 {
                    writer.flush().unwrap();
                }
            }
            // The program is killed here: the rows after the last piece never reach the file.
            writer.flush().unwrap();
            let left = bytes(writer);
            let read = read(&left).unwrap();
            assert_eq!((read.rows.len() as u64, read.notice), (ticks, None), "{format:?}");
            assert!(left.len() > file.len(), "{format:?}");
            file = left;
        }
    }
}

#[test]
fn truncated_file_is_read_to_last_complete_piece() {
    for format in [RecordingFormat::Parquet, RecordingFormat::Mcap] {
        let (bytes, _) = recorded(format, 9);
        let mut most = 0;
        for length in (0..bytes.len()).rev().step_by(5).collect::<Vec<_>>().into_iter().rev() {
            match read(&bytes[..length]) {
                Err(error) => {
                    assert!(most == 0 && !error.to_string().contains('\n'), "{format:?} cut at {length}: {error}")
                }
                Ok(read) => {
                    assert!(read.rows.len() >= most, "{format:?} cut at {length}");
                    most = read.rows.len();
                    assert!(
                        read.rows.iter().enumerate().all(|(k, row)| *row == at(k as u64)),
                        "{format:?} cut at {length}"
                    );
                }
            }
        }
        assert!(most >= 6, "{format:?}: {most}");
    }
}

/// The system writes only a part of a piece over the old end before the program ends.
#[test]
fn half_written_piece_is_omitted() {
    for format in FORMATS {
        let mut before = writer(format);
        let mut after = writer(format);
        for tick in 0..6 {
            for writer in [&mut before, &mut after] {
                writer.write(&at(tick)).unwrap();
            }
        }
        before.flush().unwrap();
        after.flush().unwrap();
        (6..9).for_each(|tick| after.write(&at(tick)).unwrap());
        // `after` has one piece more than `before`; only a part of that piece is written below.
        let (before, after) = (bytes(before), bytes(after));
        let common = before.iter().zip(&after).take_while(|(a, b)| a == b).count();
        for length in common..after.len() {
            let mut torn = after[..length].to_vec();
            torn.extend(before.get(length..).unwrap_or_default());
            let read = read(&torn).unwrap_or_else(|error| panic!("{format:?} at {length}: {error}"));
            assert!(read.rows.len() >= 6, "{format:?} at {length}");
            assert!(read.rows.iter().enumerate().all(|(k, row)| *row == at(k as u64)), "{format:?} at {length}");
        }
    }
}

#[test]
fn name_selects_written_format_and_content_the_read_one() {
    let folder = std::env::temp_dir().join(format!("palpus-records-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    for (name, begin) in [("run.csv", "# format"), ("run.PARQUET", "PAR1"), ("run.mcap", "\u{89}MCAP0\r\n")] {
        let path = folder.join(name);
        let mut writer = RecordingWriter::create(&path, &header()).unwrap();
        for tick in 0..1000 {
            writer.write(&at(tick)).unwrap();
            if tick % 100 == 0 {
                writer.flush().unwrap();
            }
        }
        assert!(RecordingWriter::create(&path, &header()).is_err(), "a recording is never overwritten");
        writer.finish().unwrap();
        let elsewhere = folder.join("recording.bin");
        std::fs::rename(&path, &elsewhere).unwrap();
        let read = read_recording(&elsewhere).unwrap();
        assert_eq!((read.rows, read.notice), ((0..1000).map(at).collect(), None), "{name}");
        let bytes = std::fs::read(&elsewhere).unwrap();
        let begin: Vec<u8> = begin.chars().map(|c| c as u8).collect();
        assert!(bytes.starts_with(&begin), "{name}");
        if name == "run.PARQUET" {
            // The file no longer contains the ten footers of six kilobytes.
            assert!(bytes.len() < 1000 * 346 + 12_000, "{}", bytes.len());
        }
    }
    assert!(
        RecordingWriter::create(&folder.join("run.txt"), &header()).err().unwrap().to_string().contains(".parquet")
    );
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "no other file remains");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn many_small_groups_are_merged() {
    let mut writer = writer(RecordingFormat::Parquet);
    let ticks = 200_000;
    for tick in 0..ticks {
        if tick % 50_000 == 40_000 {
            writer.change(tick, &Settings { stiffness: tick as f64, ..settings() });
        }
        writer.write(&at(tick)).unwrap();
        if tick % 700 == 0 {
            writer.flush().unwrap();
        }
    }
    let read = read(&bytes(writer)).unwrap();
    assert!(read.rows.iter().enumerate().all(|(k, row)| *row == at(k as u64)));
    assert_eq!(read.rows.len() as u64, ticks);
    let changes: Vec<u64> = read.changes.iter().map(|(tick, _)| *tick).collect();
    assert_eq!(changes, [40_000, 90_000, 140_000, 190_000]);
}

#[test]
fn other_files_give_errors_of_one_line() {
    for bytes in [
        &b"PAR1"[..],
        b"PAR1\0\0\0\0PAR1",
        b"PAR1\xff\xff\xff\x7fPAR1",
        b"\x89MCAP0\r\n",
        b"\x89MCAP0\r\n\x06\xff\xff\xff\xff\xff\xff\xff\xff",
    ] {
        let error = read(bytes).unwrap_err().to_string();
        assert!(error.starts_with("run: ") && !error.contains('\n'), "{error}");
    }
    let comments = "# a = \"0123456789\"\n".repeat(100_000);
    assert!(read(comments.as_bytes()).unwrap_err().to_string().starts_with("run: the header is too long"));
    // A list in the footer with a very large length.
    let endless =
        [&b"PAR1"[..], &[0x29, 0xFC, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01], b"\x0b\0\0\0PAR1"].concat();
    assert_eq!(read(&endless).unwrap_err().to_string(), "run: the footer is damaged");
    let deep = [&b"PAR1"[..], &[0x1C; 100_000], &100_000u32.to_le_bytes(), b"PAR1"].concat();
    assert_eq!(read(&deep).unwrap_err().to_string(), "run: the footer is damaged");
}

#[test]
fn random_bytes_never_panic() {
    let edits = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4);
    let files = FORMATS.map(|format| recorded(format, 7).0);
    let run = runner(250).run(&(edits, prop::collection::vec(any::<u8>(), 0..200)), |(edits, noise)| {
        for good in &files {
            let mut bytes = good.clone();
            for (at, byte) in &edits {
                let at = at.index(bytes.len());
                bytes[at] = *byte;
            }
            let begun = [&good[..8], &noise].concat();
            for bytes in [&bytes, &noise, &begun] {
                if let Err(error) = read(bytes) {
                    prop_assert!(!error.to_string().contains('\n'), "{}", error);
                }
            }
        }
        Ok(())
    });
    run.unwrap_or_else(|failure| panic!("seed {}: {failure}", SEED.escape_ascii()));
}
