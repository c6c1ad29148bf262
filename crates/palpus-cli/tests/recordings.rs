//! Recordings as a user meets them: every format is replayed bit for bit, also after the program was killed.

mod program_run;

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use program_run::{Folder, command, document, palpus, text};

const FORMATS: [&str; 3] = ["csv", "parquet", "mcap"];

/// Without the header's name of the device and the columns of times, which differ from run to run.
fn rows(file: &Path) -> Vec<String> {
    let recording = fs::read_to_string(file).expect("a recording");
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        [&cells[..26], &cells[30..]].concat().join(",")
    };
    recording.lines().filter(|line| !line.starts_with('#')).map(row).collect()
}

#[test]
fn every_format_is_replayed_converted_and_felt_again_bit_for_bit() {
    let folder = Folder::new("formats");
    for format in FORMATS {
        let file = format!("run.{format}");
        let run = ["run", "box-table", "--fast", "--duration", "2", "--record", &file, "--json"];
        assert_eq!(document(&palpus(&folder.0, &run))["ticks"], 2000);
        let replay = document(&palpus(&folder.0, &["replay", &file, "--json"]));
        assert_eq!(replay["identical"], 2000, "{replay}");
        for other in FORMATS {
            let converted = format!("from-{format}.{other}");
            assert!(palpus(&folder.0, &["convert", &file, &converted]).status.success());
            if other == "csv" {
                let again = palpus(&folder.0, &["convert", &converted, "again.parquet"]);
                assert!(again.status.success() && palpus(&folder.0, &["replay", "again.parquet"]).status.success());
            }
        }
        let device = format!("replay:{file}");
        let run = ["run", "box-table", "--fast", "--device", &device, "--record", "felt.csv", "--json"];
        assert_eq!(document(&palpus(&folder.0, &run))["ticks"], 2000);
        let recorded = rows(&folder.0.join(format!("from-{format}.csv")));
        assert_eq!(recorded.len(), 2001);
        assert!(recorded == rows(&folder.0.join("felt.csv")), "the hand of {file} feels another run");
    }
    let refused = palpus(&folder.0, &["convert", "run.csv", "run.csv"]);
    assert_eq!(refused.status.code(), Some(1));
    let refused = palpus(&folder.0, &["run", "box-table", "--fast", "--duration", "0.1", "--record", "run.txt"]);
    assert!(text(&refused.stderr).contains(".parquet"));
}

#[test]
fn a_killed_run_leaves_a_recording_that_opens_and_is_replayed() {
    let folder = Folder::new("killed");
    assert!(palpus(&folder.0, &["run", "box-table", "--fast", "--duration", "0.1", "--no-record"]).status.success());
    for format in FORMATS {
        let file = format!("run.{format}");
        let path = folder.0.join(&file);
        let run = ["run", "box-table", "--duration", "600", "--no-realtime", "--headless", "--record", &file, "--json"];
        let mut run = command(&folder.0, &run).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
        let length = || fs::metadata(&path).map_or(0, |file| file.len());
        let begun = Instant::now();
        // Two pieces and a part of the third.
        let mut pieces = Vec::new();
        while pieces.len() < 4 && begun.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(20));
            if length() > pieces.last().copied().unwrap_or(0) {
                pieces.push(length());
            }
        }
        // SIGKILL: the program has no say in it.
        run.kill().and_then(|()| run.wait()).expect("it can be killed");
        let replay = document(&palpus(&folder.0, &["replay", &file, "--json"]));
        assert!(replay["ticks"].as_u64() > Some(0), "{format}: {replay}");
        assert_eq!(replay["identical"], replay["ticks"], "{format}");
    }
}
