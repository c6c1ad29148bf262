//! CSV recordings: content of a line, files after a crash, and error messages.

mod recorded;

use std::io::Cursor;

use palpus::render::{Limits, Settings};
use palpus_io::record::{RecordingFormat, read_recording_from};
use palpus_io::{RecordRow, RecordingWriter, TableError, read_recording};
use recorded::{header, plain, settings};

fn recorded(rows: &[RecordRow]) -> Vec<u8> {
    let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), RecordingFormat::Csv, &header()).unwrap();
    rows.iter().for_each(|row| writer.write(row).unwrap());
    writer.finish().unwrap().into_inner()
}

fn error(bytes: &[u8]) -> TableError {
    read_recording_from(bytes, "run.csv").unwrap_err()
}

#[test]
fn csv_file_is_a_table_after_comments() {
    let text = String::from_utf8(recorded(&[plain()])).unwrap();
    let table: Vec<&str> = text.lines().filter(|line| !line.starts_with('#')).collect();
    assert_eq!(table.len(), 2, "{text}");
    assert_eq!(table[0].split(',').count(), table[1].split(',').count());
    assert!(text.starts_with("# format = 3\n# palpus_version = \"0.1.0\"\n# device = \"sim\"\n"), "{text}");
}

#[test]
fn truncated_recording_is_read_to_last_complete_line() {
    let bytes = recorded(&[plain(); 3]);
    let text = String::from_utf8(bytes.clone()).unwrap();
    let start = text.find("\ntick,").unwrap() + 1;
    let table = start + text[start..].find('\n').unwrap() + 1;
    for length in 0..table {
        let error = error(&bytes[..length]).to_string();
        assert!(error.starts_with("run.csv") && !error.contains('\n'), "{error}");
    }
    for length in table..=bytes.len() {
        let read = read_recording_from(&bytes[..length], "run.csv").unwrap();
        let whole = text[table..length].matches('\n').count();
        assert_eq!(read.rows, vec![plain(); whole], "cut at {length}");
        assert_eq!(read.notice.is_some(), !text[..length].ends_with('\n'), "cut at {length}");
    }
    let read = read_recording_from(&bytes[..bytes.len() - 3], "run.csv").unwrap();
    let notice = read.notice.unwrap();
    assert!(notice.ends_with("the last line is incomplete and omitted; 2 ticks are complete"), "{notice}");
}

#[test]
fn errors_name_line_and_column() {
    let text = String::from_utf8(recorded(&[plain()])).unwrap();
    let header = text.lines().filter(|line| line.starts_with('#')).count();
    let row = header + 2;
    let change = |from: &str, to: &str| error(text.replace(from, to).as_bytes()).to_string();
    let last = text.lines().last().unwrap();
    let broken = last.replacen(",1.0,1.0", ",1.0,one", 1);
    assert_eq!(
        change(last, &broken),
        format!("run.csv, line {row}, column device_tx: \"one\" is not a number; correct it")
    );
    let short = last.rsplit_once(',').unwrap().0;
    assert_eq!(
        change(last, short),
        format!("run.csv, line {row}: there are 59 cells but should be 60; correct or remove the line")
    );
    assert_eq!(
        change("format = 3", "format = 4"),
        "run.csv, line 1: recordings of format 4 are not supported, only 1 to 3; use the palpus version that wrote it"
    );
    let error = change("stiffness = 0.3333333333333333", "stiffness = -1.0");
    assert!(error.contains("the header is invalid: setting `stiffness` is -1"), "{error}");
    let error = change("seed = \"18446744073709551615\"", "seed = \"x\"");
    assert!(error.starts_with("run.csv, line 6: the header is invalid: invalid digit"), "{error}");
    let error = change("stiffness = 0.3333333333333333", &format!("stiffness = \"{}\"", "long\\n".repeat(1000)));
    assert!(error.len() < 400 && !error.contains('\n'), "{error}");
    let error = change("tick,time_ns", "tick,time_ms");
    assert!(error.contains(&format!("line {}: the columns must be tick,time_ns,", header + 1)), "{error}");
    assert!(self::error(b"tx,ty,tz\n0,0,0\n").to_string().starts_with("run.csv, line 1: this is not a recording"));
    let missing = read_recording("no such file.csv".as_ref()).unwrap_err().to_string();
    assert!(missing.starts_with("no such file.csv: cannot be read"), "{missing}");
}

#[test]
fn changes_of_settings_are_read_at_their_ticks() {
    let at = |tick| RecordRow { tick, ..plain() };
    let stiffer = |stiffness| Settings { stiffness, ..settings() };
    let mut writer = RecordingWriter::new(Cursor::new(Vec::new()), RecordingFormat::Csv, &header()).unwrap();
    writer.change(0, &stiffer(1.0));
    writer.write(&at(0)).unwrap();
    writer.change(1, &stiffer(2.0));
    writer.change(1, &stiffer(0.1 + 0.2));
    writer.change(3, &Settings { limits: Limits { force: f64::INFINITY, torque: 0.0 }, ..Settings::default() });
    (1..5).for_each(|tick| writer.write(&at(tick)).unwrap());
    writer.change(5, &stiffer(4.0));
    let bytes = writer.finish().unwrap().into_inner();
    let read = read_recording_from(bytes.as_slice(), "run.csv").unwrap();
    assert_eq!(read.rows.len(), 5);
    let last = Settings { limits: Limits { force: f64::INFINITY, torque: 0.0 }, ..Settings::default() };
    assert_eq!(read.changes, [(0, stiffer(1.0)), (1, stiffer(0.1 + 0.2)), (3, last)]);
    let text = String::from_utf8(bytes).unwrap();
    let wrong = error(text.replace("stiffness = 0.30000000000000004", "stiffness = -1").as_bytes()).to_string();
    assert!(
        wrong.contains("the change of settings is invalid: setting `stiffness` is -1") && !wrong.contains('\n'),
        "{wrong}"
    );
    let line = text.lines().find(|line| line.starts_with("# change")).unwrap();
    assert!(line.starts_with("# change = {") && line.contains("tick = 0") && line.contains("settings = {"), "{line}");
}
