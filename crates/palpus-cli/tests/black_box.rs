//! Tests of recordings and fault logs in runs with faults: they are never overwritten and stay
//! usable.

mod program_run;

use std::fs;
use std::path::Path;

use palpus_device::{Cut, Cuts};
use palpus_io::{RecordRow, Recording, read_recording};
use program_run::{Folder, assert_success, command, document, json, palpus, text};
use serde_json::Value;

const FORMATS: [&str; 3] = ["csv", "parquet", "mcap"];

fn recorded(file: &Path) -> Recording {
    read_recording(file).expect("the recording can be read")
}

fn has(row: &RecordRow, cut: Cut) -> bool {
    Cuts::from_bits(row.faults).has(cut)
}

/// A run in simulated time, recorded to `run.csv`.
const RUN: [&str; 8] = ["run", "box-table", "--fast", "--duration", "1", "--record", "run.csv", "--json"];

#[test]
fn recordings_are_numbered_unless_forced() {
    let folder = Folder::new("numbered");
    let at = |name: &str| folder.0.join(name);
    let named = |value: &Value| value["recordings"][0].as_str().map(str::to_owned);
    assert_eq!(named(&json(&palpus(&folder.0, &RUN))).as_deref(), Some("run.csv"));
    let first = fs::read(at("run.csv")).expect("the recording can be read");
    let again = palpus(&folder.0, &RUN);
    assert_eq!(named(&json(&again)).as_deref(), Some("run-2.csv"));
    assert!(text(&again.stderr).contains("run.csv exists already; recording to run-2.csv"));
    assert_eq!(fs::read(at("run.csv")).expect("the recording can be read"), first);
    let forced = [&RUN[..], &["--force"]].concat();
    assert_eq!(named(&json(&palpus(&folder.0, &forced))).as_deref(), Some("run.csv"));
    assert_ne!(fs::read(at("run.csv")).expect("the recording can be read"), first);
    assert!(!at("run-3.csv").exists());
    let converted = palpus(&folder.0, &["convert", "run.csv", "run-2.csv"]);
    assert!(!converted.status.success() && text(&converted.stderr).contains("exists already"));
}

#[test]
fn every_tick_has_wall_clock_and_phase() {
    let folder = Folder::new("clock");
    for format in FORMATS {
        let file = format!("run.{format}");
        let run = ["run", "box-table", "--fast", "--duration", "1", "--record", &file, "--json"];
        assert_success(&palpus(&folder.0, &run));
        let Recording { header, rows, .. } = recorded(&folder.0.join(&file));
        let start = header.start_utc.expect("the header has a start time");
        assert!(header.format == 3 && start.starts_with("20") && start.ends_with('Z'), "{start}");
        let servo: Vec<_> = rows.iter().map(|row| row.servo.expect("the row has format 3")).collect();
        assert!(servo[0].utc_ns > 1_600_000_000_000_000_000);
        assert!(servo.iter().all(|servo| servo.stepped && servo.raw.is_none() && servo.elapsed_s == 1e-3));
        let last = servo.last().expect("the recording has ticks");
        assert_eq!((last.phase, last.lateness_s), (3, 0.0), "the device must be engaged");
    }
}

#[test]
fn panicking_tick_and_coast_are_recorded_and_replayed() {
    let folder = Folder::new("panic");
    for (scene, files) in [("box-table", &["run.csv"][..]), ("two-hands", &["run.csv", "run-second.csv"])] {
        let run = ["run", scene, "--fast", "--fault", "panic@0.5", "--record", "run.csv", "--force", "--json"];
        let ran = palpus(&folder.0, &run);
        assert!(!ran.status.success() && document(&ran)["ticks"] == 501, "{scene}");
        for file in files {
            let rows = recorded(&folder.0.join(file)).rows;
            // The tick that panicked is followed by 0.1 s of damping.
            assert_eq!(rows.len(), 601, "{scene}: {file}");
            for (k, row) in rows.iter().enumerate() {
                let stepped = row.servo.expect("the row has format 3").stepped;
                assert_eq!((stepped, has(row, Cut::Panic)), (k < 500, k == 500), "{scene}: {file}, tick {k}");
            }
            let replay = json(&palpus(&folder.0, &["replay", file, "--json"]));
            assert_eq!(replay["identical"], 601, "{scene}: {replay}");
        }
        let _ = fs::remove_file(folder.0.join("run-second.csv"));
    }
}

#[test]
fn refused_state_is_recorded_as_read() {
    let folder = Folder::new("raw");
    for format in FORMATS {
        let file = format!("run.{format}");
        let run = ["run", "box-table", "--fast", "--duration", "1.5", "--fault", "non-finite-pose@0.5"];
        assert_success(&palpus(&folder.0, &[&run[..], &["--record", &file]].concat()));
        let rows = recorded(&folder.0.join(&file)).rows;
        for (k, row) in rows.iter().enumerate() {
            let raw = row.servo.expect("the row has format 3").raw;
            assert_eq!(raw.is_some(), k == 500, "{format}, tick {k}");
            assert!(raw.is_none_or(|raw| !raw.pose.is_valid()) && row.pose.is_valid(), "{format}, tick {k}");
        }
        let replay = json(&palpus(&folder.0, &["replay", &file, "--json"]));
        assert_eq!(replay["identical"], 1500, "{format}: {replay}");
    }
}

#[test]
fn late_tick_is_recorded_and_replayed() {
    let folder = Folder::new("late");
    let run = ["run", "box-table", "--duration", "1", "--no-realtime", "--headless", "--record", "run.csv"];
    palpus(&folder.0, &[&run[..], &["--fault", "late-step@0.5", "--json"]].concat());
    let rows = recorded(&folder.0.join("run.csv")).rows;
    let [before, after] = [500, 501].map(|k| rows[k].servo.expect("the row has format 3"));
    // The step waits for 0.1 s, so the next tick begins late by whole periods.
    assert!(after.elapsed_s > 0.09 && after.utc_ns > before.utc_ns, "{after:?}");
    let replay = json(&palpus(&folder.0, &["replay", "run.csv", "--json"]));
    assert_eq!(replay["identical"], replay["ticks"], "{replay}");
}

#[test]
fn faults_are_logged_without_a_recording() {
    let folder = Folder::new("fault-log");
    let run = ["run", "box-table", "--fast", "--duration", "2", "--no-record", "--fault", "pose-jump@0.5", "--json"];
    for (more, place) in [(&["--fault-log", "mine.jsonl"][..], "mine.jsonl"), (&[], "state/palpus/faults.jsonl")] {
        let ran = palpus(&folder.0, &[&run[..], more].concat());
        assert!(text(&ran.stderr).contains(place.rsplit('/').next().unwrap_or(place)), "{}", text(&ran.stderr));
        let log = fs::read_to_string(folder.0.join(place)).expect("the log can be read");
        let lines: Vec<Value> = log.lines().map(|line| serde_json::from_str(line).expect("the line is JSON")).collect();
        let [fault, over] = lines.as_slice() else { panic!("{log}") };
        assert_eq!(
            (&fault["event"], &fault["tick"], &fault["faults"][0]),
            (&"fault".into(), &500.into(), &"pose_jump".into())
        );
        assert_eq!((&fault["phase_before"], &fault["phase"]), (&"engaged".into(), &"faulted".into()));
        assert_eq!((&fault["device"], &fault["scene"]), (&"sim".into(), &"box-table".into()));
        assert_eq!(fault["scene_hash"].as_str().map(str::len), Some(64));
        assert!(fault["utc"].as_str().is_some_and(|utc| utc.ends_with('Z')) && fault["palpus"].is_string());
        assert!(fault["wrench_before"]["force_n"][0].is_number() && fault["wrench"]["torque_nm"][2].is_number());
        assert_eq!(over["event"], "over");
        assert!(over["lasted_s"].as_f64() > Some(0.01), "{over}");
    }
    let before = fs::metadata(folder.0.join("state/palpus/faults.jsonl")).expect("the log can be read").len();
    let none = palpus(&folder.0, &[&run[..], &["--fault-log", "none"]].concat());
    assert!(!text(&none.stderr).contains("jsonl"));
    assert_eq!(fs::metadata(folder.0.join("state/palpus/faults.jsonl")).expect("the log can be read").len(), before);
}

#[test]
fn unwritable_fault_log_is_reported_and_run_continues() {
    let folder = Folder::new("no-fault-log");
    folder.file("file", "no folder");
    let run = ["run", "box-table", "--fast", "--duration", "1", "--no-record", "--fault", "pose-jump@0.5"];
    let ran = palpus(&folder.0, &[&run[..], &["--fault-log", "file/log.jsonl", "--json"]].concat());
    assert_eq!(document(&ran)["ticks"], 1000);
    assert!(text(&ran.stderr).contains("a fault could not be logged in file/log.jsonl"), "{}", text(&ran.stderr));
}

/// The shell limits the file size, which has the same effect as a full disk.
#[cfg(target_os = "linux")]
#[test]
fn full_disk_is_reported_and_keeps_the_summary() {
    use std::process::Command;
    let folder = Folder::new("full");
    // The bodies are prepared first, so that the limit affects only the recording.
    assert_success(&palpus(&folder.0, &["run", "box-table", "--fast", "--duration", "0.1", "--no-record"]));
    for format in FORMATS {
        let file = format!("run.{format}");
        let run = ["run", "box-table", "--fast", "--duration", "20", "--record", &file, "--json"];
        let program = command(&folder.0, &run);
        let mut limited = Command::new("sh");
        limited.args(["-c", "trap '' XFSZ; ulimit -f 8192; exec \"$@\"", "sh"]).arg(program.get_program());
        limited.args(program.get_args()).current_dir(&folder.0).env("XDG_CACHE_HOME", folder.0.join("cache"));
        limited.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let ran = limited.output().expect("the shell starts");
        let said = text(&ran.stderr);
        assert_eq!(json(&ran)["ticks"], 20_000, "{format}: {said}");
        let at_once = said.find("cannot be written any more").unwrap_or_else(|| panic!("{format}: {said}"));
        let at_end = said.find("is not complete").unwrap_or_else(|| panic!("{format}: {said}"));
        assert!(at_once < at_end, "{said}");
        let rows = recorded(&folder.0.join(&file)).rows;
        assert!(rows.len() > 1000 && rows.len() < 20_000, "{format}: {} rows", rows.len());
        let replay = json(&palpus(&folder.0, &["replay", &file, "--json"]));
        assert_eq!(replay["identical"], rows.len(), "{format}");
    }
}

#[test]
fn large_recording_continues_in_parts_within_its_limit() {
    let folder = Folder::new("parts");
    let run = ["run", "box-table", "--fast", "--duration", "90", "--record", "run.csv", "--record-limit", "16MB"];
    let ran = palpus(&folder.0, &[&run[..], &["--json"]].concat());
    assert_success(&ran);
    assert!(
        text(&ran.stderr).contains("run.csv is full; the recording continues in run-part2.csv"),
        "{}",
        text(&ran.stderr)
    );
    let mut files: Vec<_> = fs::read_dir(&folder.0).expect("the folder can be read").flatten().collect();
    files.retain(|file| file.file_name().to_string_lossy().starts_with("run"));
    let total: u64 = files.iter().map(|file| file.metadata().expect("the file exists").len()).sum();
    assert!(files.len() == 3 && total <= 16_000_000, "{} files of {total} bytes", files.len());
    let first = recorded(&folder.0.join("run.csv"));
    let replay = json(&palpus(&folder.0, &["replay", "run.csv", "--json"]));
    assert_eq!((&replay["identical"], first.rows[0].tick), (&first.rows.len().into(), 0));
    // The newest parts end with the run and are contiguous.
    let mut parts: Vec<_> = files.iter().map(|file| file.path()).filter(|file| !file.ends_with("run.csv")).collect();
    parts.sort_by_key(|file| recorded(file).rows[0].tick);
    let ticks: Vec<u64> = parts.iter().flat_map(|file| recorded(file).rows).map(|row| row.tick).collect();
    assert!(ticks.windows(2).all(|two| two[1] == two[0] + 1) && ticks.last() == Some(&89_999));
    let name = parts[0].file_name().expect("the path has a name").to_string_lossy().into_owned();
    let refused = palpus(&folder.0, &["replay", &name]);
    assert!(text(&refused.stderr).contains("the first part, run.csv, can be replayed"), "{}", text(&refused.stderr));
}

/// Exports a scene to `scene/`, and runs it with the recording `scene/run.csv`.
fn scene_in(folder: &Folder) {
    assert_success(&palpus(&folder.0, &["export", "box-table", "scene"]));
    let run = ["run", "scene/scene.toml", "--fast", "--duration", "1", "--record", "scene/run.csv", "--json"];
    assert_success(&palpus(&folder.0, &run));
}

#[test]
fn recording_is_replayed_from_any_folder() {
    let folder = Folder::new("anywhere");
    scene_in(&folder);
    let other = folder.0.join("other");
    fs::create_dir_all(other.join("deep")).expect("the folder can be created");
    let replays = |arguments: &[&str]| palpus(&other, &[&["replay", "run.csv", "--json"], arguments].concat());
    let identical = |arguments: &[&str]| {
        let output = replays(arguments);
        assert_eq!(json(&output)["identical"], 1000, "{}", text(&output.stderr));
        text(&output.stderr)
    };
    // The recording is moved; the scene stays in its folder.
    fs::rename(folder.0.join("scene/run.csv"), other.join("run.csv")).expect("the file can be moved");
    identical(&[]);
    // The scene file changes. Then it is deleted, together with the hand's file.
    let scene = folder.0.join("scene/scene.toml");
    let now = fs::read_to_string(&scene).expect("the scene can be read").replace("[probe]", "# changed\n[probe]");
    fs::write(&scene, now).expect("the scene can be written");
    assert!(identical(&[]).contains("scene.toml has changed since the recording"));
    fs::remove_file(&scene).expect("the file can be deleted");
    identical(&[]);
    // The meshes lie beside the recording, and the meshes at the old place have changed.
    for mesh in ["tool.obj", "part.obj"] {
        fs::copy(folder.0.join("scene").join(mesh), other.join(mesh)).expect("the file can be copied");
    }
    fs::write(folder.0.join("scene/tool.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .expect("the mesh can be written");
    identical(&[]);
    // A mesh gets another name, in a folder given by `--meshes`.
    fs::rename(other.join("tool.obj"), other.join("deep/renamed.obj")).expect("the file can be moved");
    let changed = replays(&[]);
    assert!(!changed.status.success() && changed.stdout.is_empty(), "no wrench may be compared");
    assert!(text(&changed.stderr).contains("tool.obj is not the mesh of the recording: it has changed"));
    assert!(identical(&["--meshes", "deep"]).contains("renamed.obj, by its content"));
    fs::remove_dir_all(folder.0.join("scene")).expect("the folder can be deleted");
    let gone = replays(&[]);
    assert!(text(&gone.stderr).contains("--meshes DIR"), "{}", text(&gone.stderr));
    identical(&["--meshes", "deep"]);
}

#[test]
fn run_with_bounded_work_replays_bit_for_bit() {
    let folder = Folder::new("bounded");
    assert_success(&palpus(&folder.0, &["export", "gears", "scene"]));
    let scene = folder.0.join("scene/scene.toml");
    // Time budget of a step, µs: less than the gears need.
    let text =
        fs::read_to_string(&scene).expect("the scene can be read").replace("[contact]", "[contact]\ntime_budget = 5");
    fs::write(&scene, text).expect("the scene can be written");
    let run = ["run", "scene/scene.toml", "--headless", "--no-realtime", "--duration", "2", "--record", "run.csv"];
    palpus(&folder.0, &[&run[..], &["--json"]].concat());
    let rows = recorded(&folder.0.join("run.csv")).rows;
    let servo: Vec<_> = rows.iter().map(|row| row.servo.expect("the row has format 3")).collect();
    assert!(servo.iter().all(|servo| servo.work_allowed.is_some()), "in real time every step must be bounded");
    assert!(
        servo.iter().any(|servo| servo.work_allowed.is_some_and(|most| servo.work >= most.get())),
        "at least one step must reach its bound"
    );
    let replay = json(&palpus(&folder.0, &["replay", "run.csv", "--json"]));
    assert_eq!(replay["identical"], replay["ticks"], "{replay}");
}
