//! Tests of recordings: every format is replayed bit for bit, even after the program was killed.

mod program_run;

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use program_run::{Folder, command, document, palpus, piped, text};

const FORMATS: [&str; 3] = ["csv", "parquet", "mcap"];

/// Returns the rows without the header and without the columns that differ from run to run, such as
/// times.
fn rows(file: &Path) -> Vec<String> {
    let recording = fs::read_to_string(file).expect("the recording can be read");
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        [&cells[..26], &cells[30..39]].concat().join(",")
    };
    recording.lines().filter(|line| !line.starts_with('#')).map(row).collect()
}

#[test]
fn every_format_is_replayed_and_converted_bit_for_bit() {
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
                let again = palpus(&folder.0, &["convert", &converted, "again.parquet", "--force"]);
                assert!(again.status.success() && palpus(&folder.0, &["replay", "again.parquet"]).status.success());
            }
        }
        let device = format!("replay:{file}");
        let run = ["run", "box-table", "--fast", "--device", &device, "--record", "felt.csv", "--force", "--json"];
        assert_eq!(document(&palpus(&folder.0, &run))["ticks"], 2000);
        let recorded = rows(&folder.0.join(format!("from-{format}.csv")));
        assert_eq!(recorded.len(), 2001);
        assert!(recorded == rows(&folder.0.join("felt.csv")), "a run with the device replay:{file} must be identical");
    }
    let printed = palpus(&folder.0, &["convert", "run.mcap", "-"]);
    let file = fs::read(folder.0.join("from-mcap.csv")).expect("the recording can be read");
    assert!(printed.status.success() && printed.stdout == file, "standard output must be the CSV file");
    let read = piped(&folder.0, &["convert", "-", "again.csv"], &printed.stdout);
    assert!(read.status.success() && palpus(&folder.0, &["replay", "again.csv"]).status.success());
    let refused = palpus(&folder.0, &["convert", "run.csv", "run.csv"]);
    assert_eq!(refused.status.code(), Some(1));
    let refused = palpus(&folder.0, &["run", "box-table", "--fast", "--duration", "0.1", "--record", "run.txt"]);
    assert!(text(&refused.stderr).contains(".parquet"));
}

#[test]
fn killed_run_leaves_a_replayable_recording() {
    let folder = Folder::new("killed");
    assert!(palpus(&folder.0, &["run", "box-table", "--fast", "--duration", "0.1", "--no-record"]).status.success());
    for format in FORMATS {
        let file = format!("run.{format}");
        let path = folder.0.join(&file);
        let run = ["run", "box-table", "--duration", "600", "--no-realtime", "--headless", "--record", &file, "--json"];
        let mut run =
            command(&folder.0, &run).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
        let length = || fs::metadata(&path).map_or(0, |file| file.len());
        let begun = Instant::now();
        // Waits until the file has grown four times.
        let mut pieces = Vec::new();
        while pieces.len() < 4 && begun.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(20));
            if length() > pieces.last().copied().unwrap_or(0) {
                pieces.push(length());
            }
        }
        // SIGKILL, which the program cannot handle.
        run.kill().and_then(|()| run.wait()).expect("the program can be killed");
        let replay = document(&palpus(&folder.0, &["replay", &file, "--json"]));
        assert!(replay["ticks"].as_u64() > Some(0), "{format}: {replay}");
        assert_eq!(replay["identical"], replay["ticks"], "{format}");
    }
}

/// Writes a scene with a cube, held 240 mm from its mesh's origin above another cube, with direct
/// rendering.
fn far_cube(folder: &Folder, grip: &str) {
    let cube = |low: [f64; 3]| {
        let corner = |k: u32| [0, 1, 2].map(|axis| low[axis] + 0.02 * f64::from(k >> axis & 1));
        let mut text: String = (0..8).map(corner).map(|at| format!("v {} {} {}\n", at[0], at[1], at[2])).collect();
        text += "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
        text
    };
    folder.file("probe.obj", &cube([0.24, 0.0, 0.0]));
    folder.file("table.obj", &cube([0.0, 0.0, 0.0]));
    let scene = format!(
        "unit = \"m\"\n[probe]\nmesh = \"probe.obj\"\nposition = [-0.24, 0, 0.03]\ngrip = {grip}\n\
         [environment]\nmesh = \"table.obj\"\nposition = [0.001, 0.002, 0]\norientation = [0, 0, 0.6, 0.8]\n\
         [coupling]\nmode = \"direct\"\n"
    );
    folder.file("scene.toml", &scene);
}

#[test]
fn recorded_tool_pose_is_device_pose_minus_grip() {
    let folder = Folder::new("tool-pose");
    far_cube(&folder, "[0.25, 0.01, 0.015]");
    for format in FORMATS {
        let file = format!("run.{format}");
        let run = ["run", "scene.toml", "--fast", "--duration", "3", "--record", &file, "--json"];
        assert_eq!(document(&palpus(&folder.0, &run))["ticks"], 3000);
        let recording = palpus_io::read_recording(&folder.0.join(&file)).expect("the recording can be read");
        let grip_a = recording.header.scene.render.grip_a;
        assert!(recording.rows.iter().any(|row| row.contacts > 0), "there must be contact");
        for row in &recording.rows {
            let tool = row.tool.expect("the row has a tool pose");
            let off = tool.point(grip_a).distance(row.pose.translation);
            let turned = tool.rotation.dot(row.pose.rotation).abs();
            assert!(off < 1e-12 && turned > 1.0 - 1e-12, "{format}, tick {}: {off} m", row.tick);
        }
        assert_eq!(document(&palpus(&folder.0, &["replay", &file, "--json"]))["identical"], 3000);
    }
}

/// Converts a recording to an older format. Format 1 has no tool pose; format 2 has no data of the
/// servo loop.
fn as_format(version: usize, text: &str) -> String {
    let columns = [32, 39][version - 1];
    let old = |line: &str| match line.strip_prefix('#') {
        Some(_) => line.replace("format = 3", &format!("format = {version}")),
        None => line.split(',').take(columns).collect::<Vec<_>>().join(","),
    };
    let lines = text.lines().filter(|line| !line.starts_with("# start_utc = "));
    let all: String = lines.map(|line| old(line) + "\n").collect();
    // Removes the text of the scene file.
    let begin = all.find("# text = \"\"\"").expect("the header has a scene text");
    let end = begin + all[begin..].find("\n# \"\"\"\n").expect("the scene text ends") + "\n# \"\"\"\n".len();
    all[..begin].to_owned() + &all[end..]
}

#[test]
fn format_2_is_read_converted_and_replayed() {
    let folder = Folder::new("format-2");
    far_cube(&folder, "[0.25, 0.01, 0.015]");
    let run = ["run", "scene.toml", "--fast", "--duration", "1", "--record", "run.csv", "--json"];
    assert_eq!(document(&palpus(&folder.0, &run))["ticks"], 1000);
    let text = fs::read_to_string(folder.0.join("run.csv")).expect("the recording can be read");
    let old = folder.file("old.csv", &as_format(2, &text));
    let read = palpus_io::read_recording(&old).expect("the recording can be read");
    assert!(read.header.format == 2 && read.rows.iter().all(|row| row.servo.is_none()));
    assert!(palpus(&folder.0, &["convert", "old.csv", "old.parquet"]).status.success());
    for file in ["old.csv", "old.parquet"] {
        assert_eq!(document(&palpus(&folder.0, &["replay", file, "--json"]))["identical"], 1000, "{file}");
    }
}

#[test]
fn format_1_is_replayed_if_grip_equals_origin() {
    let folder = Folder::new("format-1");
    for (grip, replays) in [("[0, 0, 0]", true), ("[0.25, 0.01, 0.015]", false)] {
        far_cube(&folder, grip);
        let run = ["run", "scene.toml", "--fast", "--duration", "1", "--record", "run.csv", "--force", "--json"];
        assert_eq!(document(&palpus(&folder.0, &run))["ticks"], 1000);
        let text = fs::read_to_string(folder.0.join("run.csv")).expect("the recording can be read");
        folder.file("old.csv", &as_format(1, &text));
        assert!(palpus(&folder.0, &["convert", "old.csv", "old.mcap", "--force"]).status.success());
        for file in ["old.csv", "old.mcap"] {
            let device = format!("replay:{file}");
            for arguments in
                [&["replay", file][..], &["run", "scene.toml", "--fast", "--device", &device, "--no-record"]]
            {
                let output = palpus(&folder.0, arguments);
                assert_eq!(output.status.success(), replays, "{arguments:?}: {}", text_of(&output));
                assert!(replays || text_of(&output).contains("has format 1"), "{}", text_of(&output));
            }
        }
    }
}

fn text_of(output: &std::process::Output) -> String {
    text(&output.stderr)
}
