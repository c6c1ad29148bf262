//! Compares recordings with the reference crates of the formats: `parquet` (arrow-rs) and `mcap`
//! (Foxglove).

mod recorded;

use std::collections::BTreeMap;
use std::io::Cursor;
use std::panic::catch_unwind;

use palpus::algebra::Random;
use palpus::render::Settings;
use palpus_io::record::{RecordingFormat, column_names, read_recording_from};
use palpus_io::{RecordRow, RecordingWriter};
use parquet::errors::Result as ParquetResult;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use recorded::{NUMBERS, header, row, settings};

const SEED: u64 = 0x9ee5;

const TICKS: u64 = 40;

fn rows() -> Vec<RecordRow> {
    let mut random = Random::new(SEED);
    let numbers = |tick: u64, random: &mut Random| {
        let mut numbers = [(); NUMBERS].map(|()| random.between(-1e3, 1e3).to_bits());
        (numbers[0], numbers[1]) = (tick, tick * 1_000_000);
        numbers
    };
    (0..TICKS)
        .map(|tick| row(numbers(tick, &mut random), [(); 6].map(|()| random.bits() as u32), tick % 3 > 0))
        .collect()
}

/// Returns a recording in three pieces, with other settings from tick 7 on.
fn written(format: RecordingFormat) -> Vec<u8> {
    let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), format, &header()).unwrap();
    writer.change(7, &Settings { stiffness: 1234.5, ..settings() });
    for (k, row) in rows().iter().enumerate() {
        writer.write(row).unwrap();
        if k % 15 == 14 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap().into_inner()
}

/// Returns a cell as it is written in the CSV format.
fn cell(field: &Field) -> String {
    match field {
        Field::Double(value) => format!("{:x}", value.to_bits()),
        Field::Bool(value) => u8::from(*value).to_string(),
        Field::UInt(value) => value.to_string(),
        Field::ULong(value) => value.to_string(),
        Field::Null => String::new(),
        other => panic!("a column of another type: {other}"),
    }
}

fn parquet_rows(file: Vec<u8>) -> ParquetResult<Vec<parquet::record::Row>> {
    SerializedFileReader::new(bytes::Bytes::from(file))?.get_row_iter(None)?.collect()
}

#[test]
fn parquet_crate_reads_every_cell() {
    let csv = String::from_utf8(written(RecordingFormat::Csv)).unwrap();
    let lines: Vec<&str> = csv.lines().filter(|line| !line.starts_with('#')).skip(1).collect();
    let file = written(RecordingFormat::Parquet);
    let reader = SerializedFileReader::new(bytes::Bytes::from(file.clone())).unwrap();
    let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap();
    assert_eq!((metadata[0].key.as_str(), reader.metadata().num_row_groups()), ("palpus", 3));
    let rows = parquet_rows(file).unwrap();
    assert_eq!((rows.len(), lines.len()), (TICKS as usize, TICKS as usize));
    for (k, (row, line)) in rows.iter().zip(lines).enumerate() {
        let (names, fields): (Vec<&String>, Vec<&Field>) = row.get_column_iter().unzip();
        let own = column_names();
        assert_eq!(names[..own.len()], own);
        for ((field, text), name) in fields.iter().zip(line.split(',')).zip(&own) {
            let text = match field {
                Field::Double(_) => format!("{:x}", text.parse::<f64>().unwrap().to_bits()),
                _ => text.to_owned(),
            };
            assert_eq!(cell(field), text, "seed {SEED:#x}, tick {k}, column {name}");
        }
        assert_eq!(matches!(fields[own.len()], Field::Str(_)), k == 7, "tick {k}");
    }
}

#[test]
fn mcap_crate_reads_every_message() {
    let file = written(RecordingFormat::Mcap);
    let summary = mcap::Summary::read(&file).unwrap().unwrap();
    let stats = summary.stats.unwrap();
    assert_eq!((stats.message_count, stats.chunk_count, stats.metadata_count), (5 * TICKS + 1, 3, 1));
    assert_eq!(summary.chunk_indexes.len(), 3);
    let mut counts: BTreeMap<String, u64> = BTreeMap::new();
    for message in mcap::MessageStream::new(&file).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("ros2msg", "cdr"));
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
    }
    let expected = [
        ("/palpus/device/pose", TICKS),
        ("/palpus/device/twist", TICKS),
        ("/palpus/device/wrench", TICKS),
        ("/palpus/settings", 1),
        ("/palpus/tick", TICKS),
        ("/palpus/tool/pose", TICKS),
    ];
    assert!(counts.iter().map(|(topic, count)| (topic.as_str(), *count)).eq(expected), "{counts:?}");
}

/// Returns the recording as the crate `mcap` writes it: either finished, or as a killed program
/// leaves it.
fn rewritten(is_finished: bool) -> Vec<u8> {
    let own = written(RecordingFormat::Mcap);
    let mut file = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().compression(None).create(&mut file).unwrap();
    let text = header_text(&own);
    let metadata = BTreeMap::from([("header".to_owned(), text)]);
    writer.write_metadata(&mcap::records::Metadata { name: "palpus".to_owned(), metadata }).unwrap();
    for (k, message) in mcap::MessageStream::new(&own).unwrap().enumerate() {
        writer.write(&message.unwrap()).unwrap();
        if k % 50 == 49 {
            writer.flush().unwrap();
        }
    }
    if is_finished {
        writer.finish().unwrap();
    }
    // Does not finish the file, as if the program had been killed.
    let _ = writer.into_inner();
    file.into_inner()
}

/// Returns the content of the metadata record.
fn header_text(file: &[u8]) -> String {
    let summary = mcap::Summary::read(file).unwrap().unwrap();
    let record = mcap::read::metadata(file, &summary.metadata_indexes[0]).unwrap();
    record.metadata["header"].clone()
}

#[test]
fn files_of_the_mcap_crate_are_read() {
    let read = read_recording_from(rewritten(true).as_slice(), "theirs").unwrap();
    assert_eq!((read.notice, read.header, read.rows), (None, header(), rows()));
    assert_eq!(read.changes[0].0, 7);
    // The program is killed between two flushes, so the file contains all earlier chunks.
    let killed = rewritten(false);
    let read = read_recording_from(killed.as_slice(), "theirs").unwrap();
    assert!(read.rows.len() + 15 > TICKS as usize && read.rows == rows()[..read.rows.len()]);
    // This file has no index for readers that start with the index. palpus therefore writes an end
    // after each piece.
    assert!(!matches!(mcap::Summary::read(&killed), Ok(Some(_))));
}

/// Shows why palpus has a separate reader: if this test fails, `parquet` may have become robust.
/// docs/dependencies.md contains the whole comparison.
#[test]
fn parquet_crate_panics_on_a_damaged_footer() {
    let good = written(RecordingFormat::Parquet);
    let length = u32::from_le_bytes(*good[good.len() - 8..].first_chunk().unwrap()) as usize;
    let footer = (good.len() - 8 - length..good.len() - 8).step_by(5);
    let quiet = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| ()));
    let damaged = |at: usize| {
        let mut file = good.clone();
        file[at] = 0xff;
        file
    };
    let panics = footer.clone().filter(|at| catch_unwind(|| parquet_rows(damaged(*at))).is_err()).count();
    std::panic::set_hook(quiet);
    assert!(panics > 0);
    for at in footer {
        if let Err(error) = read_recording_from(damaged(at).as_slice(), "damaged") {
            assert!(error.to_string().starts_with("damaged"), "{error}");
        }
    }
}
