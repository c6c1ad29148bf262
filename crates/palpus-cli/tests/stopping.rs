//! How a run is stopped, and what keeps a person in command of its force.
#![cfg(unix)]

mod program_run;

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use palpus_device::Phase;
use palpus_io::read_recording;
use program_run::{Folder, command, json, palpus, text};

/// A run of ten minutes that gets this signal once it has written a recording; what it says, and
/// its exit status.
fn stopped_by(signal: &str) {
    let folder = Folder::new(&format!("stopped-{signal}"));
    let file = folder.0.join("run.csv");
    let arguments = ["run", "box-table", "--headless", "--no-realtime", "--duration", "600", "--record", "run.csv"];
    let mut running = command(&folder.0, &arguments);
    let running =
        running.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let begun = Instant::now();
    // Long enough for any machine; the run itself is not waited for by a clock.
    while fs::metadata(&file).map_or(0, |file| file.len()) < 100_000 && begun.elapsed() < Duration::from_secs(300) {
        std::thread::sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill").args([&format!("-{signal}"), &running.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()), "{signal}");
    let output = running.wait_with_output().expect("it ends");
    assert!(output.status.code().is_some(), "{signal}: it ended by itself, not by the signal: {}", output.status);
    let said = text(&output.stdout);
    assert!(said.contains("it was stopped"), "{signal}: {said}{}", text(&output.stderr));
    let recording = read_recording(&file).expect("the recording is whole");
    let ticks = said.split_once(" ticks").and_then(|(before, _)| before.rsplit(' ').next()?.parse::<usize>().ok());
    assert_eq!(Some(recording.rows.len()), ticks, "{signal}: {said}");
}

#[test]
fn a_run_that_is_told_to_end_ends_in_order() {
    stopped_by("TERM");
}

#[test]
fn a_run_whose_terminal_is_closed_ends_in_order() {
    stopped_by("HUP");
}

#[test]
fn limits_can_be_lowered_and_not_raised() {
    let folder = Folder::new("lowered");
    let limits = |arguments: &[&str]| {
        json(&palpus(&folder.0, &[&["run", "box-table", "--limits", "--json"], arguments].concat()))
    };
    let (usual, lowered) = (limits(&[]), limits(&["--max-force", "2", "--max-torque", "0.05"]));
    assert_eq!((&lowered["force_peak"], &lowered["torque_peak"]), (&2.0.into(), &0.05.into()));
    // Thresholds that follow from the peaks follow from the lowered ones.
    assert_eq!((&lowered["force_slew"], &lowered["rest_force"]), (&1000.0.into(), &0.2.into()));
    assert_eq!(limits(&["--max-force", "100", "--max-torque", "3"]), usual);
    for bad in ["0", "-1", "nan", "inf", "much"] {
        let argument = format!("--max-force={bad}");
        let output = palpus(&folder.0, &["run", "box-table", &argument, "--limits"]);
        assert!(!output.status.success() && text(&output.stderr).contains("positive number"), "{bad}");
    }
}

#[test]
fn a_dead_mans_button_needs_a_button() {
    let folder = Folder::new("dead-man");
    let output = palpus(&folder.0, &["run", "box-table", "--dead-man", "--headless"]);
    assert!(!output.status.success() && text(&output.stderr).contains("--dead-man needs something to hold"));
}

#[test]
fn three_faults_latch_unless_asked_otherwise() {
    let folder = Folder::new("latch");
    let faults = ["1", "1.8", "2.6"].map(|at| format!("--fault=non-finite-wrench@{at}"));
    let run = ["run", "box-table", "--fast", "--duration", "6", "--record", "run.csv", "--force"];
    let phase_at_the_end = |rearm: &str| {
        let faults = faults.each_ref().map(String::as_str);
        palpus(&folder.0, &[&run[..], &faults, &["--rearm", rearm]].concat());
        let recording = read_recording(&folder.0.join("run.csv")).expect("it was written");
        let replay = json(&palpus(&folder.0, &["replay", "run.csv", "--json"]));
        assert_eq!(replay["identical"], replay["ticks"], "{rearm}");
        let last = recording.rows.last().and_then(|row| row.servo.as_ref()).expect("there are ticks");
        last.phase
    };
    let phases = (phase_at_the_end("person"), phase_at_the_end("auto"));
    assert_eq!(phases, (Phase::Latched as u32, Phase::Engaged as u32));
}

/// Moves the path of the hand in `mine` down by so many mm.
fn lower_the_hand(folder: &Path, by: f64) {
    let path = folder.join("mine/hand.csv");
    let lines = fs::read_to_string(&path).expect("it was written");
    let lower = |line: &str| {
        let mut values: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(z) = values[2].parse::<f64>() {
            values[2] = (z - by).to_string();
        }
        values.join(",")
    };
    fs::write(&path, lines.lines().map(lower).collect::<Vec<_>>().join("\n")).expect("it can be written");
}

#[test]
fn start_buried_in_the_part_is_said() {
    let folder = Folder::new("buried");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    // A cube of 4 mm, 6 mm below the table's top: no contact comes near to a surface.
    let corners = (0..8).map(|k| format!("v {} {} {}\n", 4 * (k & 1) - 2, 2 * (k & 2) - 2, (k & 4) - 2));
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(folder.0.join("mine/tool.obj"), corners.collect::<String>() + faces).expect("it can be written");
    lower_the_hand(&folder.0, 48.0);
    let output =
        palpus(&folder.0, &["run", "mine/scene.toml", "--fast", "--headless", "--duration", "0.3", "--no-record"]);
    let said = text(&output.stderr);
    assert!(said.contains("the probe overlaps the part by 8.") && said.contains("to enable force"), "{said}");
    assert!(said.contains("along (0.00, 0.00, 1.00)"), "{said}");
}

#[test]
fn a_start_inside_the_part_is_said_with_the_way_out() {
    let folder = Folder::new("inside");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    lower_the_hand(&folder.0, 37.0);
    let output =
        palpus(&folder.0, &["run", "mine/scene.toml", "--fast", "--headless", "--duration", "0.3", "--no-record"]);
    let said = text(&output.stderr);
    assert!(said.contains("the probe overlaps the part by") && said.contains("to enable force"), "{said}");
    assert!(said.contains("along (0.00, 0.00, 1.00)"), "{said}");
}
