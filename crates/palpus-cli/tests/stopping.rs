//! Tests of stopping a run, and of protections for the user: force limits, dead-man button, start
//! in overlap.
#![cfg(unix)]

mod program_run;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use palpus_device::Phase;
use palpus_io::read_recording;
use program_run::{Folder, command, json, palpus, text};

/// Starts a run of ten minutes, sends it this signal after it has written a part of its recording,
/// and checks its output and exit status.
fn stopped_by(signal: &str) {
    let folder = Folder::new(&format!("stopped-{signal}"));
    let file = folder.0.join("run.csv");
    let arguments = ["run", "box-table", "--headless", "--no-realtime", "--duration", "600", "--record", "run.csv"];
    let mut running = command(&folder.0, &arguments);
    let running =
        running.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let begun = Instant::now();
    // This limit is long enough for any machine.
    while fs::metadata(&file).map_or(0, |file| file.len()) < 100_000 && begun.elapsed() < Duration::from_secs(300) {
        std::thread::sleep(Duration::from_millis(20));
    }
    let sent = Command::new("kill").args([&format!("-{signal}"), &running.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()), "{signal}");
    let output = running.wait_with_output().expect("the program ends");
    assert!(output.status.code().is_some(), "{signal}: the program must handle the signal: {}", output.status);
    let said = text(&output.stdout);
    assert!(said.contains("it was stopped"), "{signal}: {said}{}", text(&output.stderr));
    let recording = read_recording(&file).expect("the recording is complete");
    let ticks = said.split_once(" ticks").and_then(|(before, _)| before.rsplit(' ').next()?.parse::<usize>().ok());
    assert_eq!(Some(recording.rows.len()), ticks, "{signal}: {said}");
}

#[test]
fn terminated_run_ends_in_order() {
    stopped_by("TERM");
}

#[test]
fn run_ends_in_order_when_its_terminal_closes() {
    stopped_by("HUP");
}

#[test]
fn limits_can_be_lowered_but_not_raised() {
    let folder = Folder::new("lowered");
    let limits = |arguments: &[&str]| {
        json(&palpus(&folder.0, &[&["run", "box-table", "--limits", "--json"], arguments].concat()))
    };
    let (usual, lowered) = (limits(&[]), limits(&["--max-force", "2", "--max-torque", "0.05"]));
    assert_eq!((&lowered["force_peak"], &lowered["torque_peak"]), (&2.0.into(), &0.05.into()));
    // Thresholds that depend on the peaks must be lowered too.
    assert_eq!((&lowered["force_slew"], &lowered["rest_force"]), (&1000.0.into(), &0.2.into()));
    assert_eq!(limits(&["--max-force", "100", "--max-torque", "3"]), usual);
    for bad in ["0", "-1", "nan", "inf", "much"] {
        let argument = format!("--max-force={bad}");
        let output = palpus(&folder.0, &["run", "box-table", &argument, "--limits"]);
        assert!(!output.status.success() && text(&output.stderr).contains("positive number"), "{bad}");
    }
}

#[test]
fn dead_man_mode_needs_a_button() {
    let folder = Folder::new("dead-man");
    let output = palpus(&folder.0, &["run", "box-table", "--dead-man", "--headless"]);
    assert!(!output.status.success() && text(&output.stderr).contains("--dead-man needs a button or a key"));
}

#[test]
fn three_faults_latch_unless_asked_otherwise() {
    let folder = Folder::new("latch");
    let faults = ["1", "1.8", "2.6"].map(|at| format!("--fault=non-finite-wrench@{at}"));
    let run = ["run", "box-table", "--fast", "--duration", "6", "--record", "run.csv", "--force"];
    let phase_at_the_end = |rearm: &str| {
        let faults = faults.each_ref().map(String::as_str);
        palpus(&folder.0, &[&run[..], &faults, &["--rearm", rearm]].concat());
        let recording = read_recording(&folder.0.join("run.csv")).expect("the recording can be read");
        let replay = json(&palpus(&folder.0, &["replay", "run.csv", "--json"]));
        assert_eq!(replay["identical"], replay["ticks"], "{rearm}");
        let last = recording.rows.last().and_then(|row| row.servo.as_ref()).expect("the recording has ticks");
        last.phase
    };
    let phases = (phase_at_the_end("person"), phase_at_the_end("auto"));
    assert_eq!(phases, (Phase::Latched as u32, Phase::Engaged as u32));
}

/// Moves the path of the hand in `mine` down by `by` mm.
fn lower_the_hand(folder: &Path, by: f64) {
    let path = folder.join("mine/hand.csv");
    let lines = fs::read_to_string(&path).expect("the path was exported");
    let lower = |line: &str| {
        let mut values: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(z) = values[2].parse::<f64>() {
            values[2] = (z - by).to_string();
        }
        values.join(",")
    };
    fs::write(&path, lines.lines().map(lower).collect::<Vec<_>>().join("\n")).expect("the file can be written");
}

/// Makes `mine` start with a cube of 4 mm, 6 mm below the table's top, so that no surfaces are near
/// each other.
fn bury_a_cube(folder: &Path) {
    hold_a_cube(folder);
    lower_the_hand(folder, 48.0);
}

/// Replaces the tool of `mine` by a cube of 4 mm.
fn hold_a_cube(folder: &Path) {
    let corners = (0..8).map(|k| format!("v {} {} {}\n", 4 * (k & 1) - 2, 2 * (k & 2) - 2, (k & 4) - 2));
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(folder.join("mine/tool.obj"), corners.collect::<String>() + faces).expect("the file can be written");
}

/// Asserts that the device gave no force, also not while the tool left the part.
fn assert_no_force(output: &Output) {
    let summary = text(&output.stdout);
    assert!(summary.contains("peak force 0.00 N"), "{summary}");
}

#[test]
fn start_buried_in_the_part_is_reported() {
    let folder = Folder::new("buried");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    bury_a_cube(&folder.0);
    let output =
        palpus(&folder.0, &["run", "mine/scene.toml", "--fast", "--headless", "--duration", "0.3", "--no-record"]);
    let said = text(&output.stderr);
    assert!(said.contains("the probe overlaps the part by 8.") && said.contains("to enable force"), "{said}");
    assert!(said.contains("along (0.00, 0.00, 1.00)"), "{said}");
    assert_no_force(&output);
}

#[test]
fn start_inside_the_part_is_reported_with_the_way_out() {
    let folder = Folder::new("inside");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    lower_the_hand(&folder.0, 37.0);
    let output =
        palpus(&folder.0, &["run", "mine/scene.toml", "--fast", "--headless", "--duration", "0.3", "--no-record"]);
    let said = text(&output.stderr);
    assert!(said.contains("the probe overlaps the part by") && said.contains("to enable force"), "{said}");
    assert!(said.contains("along (0.00, 0.00, 1.00)"), "{said}");
    assert_no_force(&output);
}

/// Adds a fixed plate of 60 mm at the hand's start to `mine`, between two heights (mm).
fn add_a_plate(folder: &Path, low: f64, high: f64) {
    let corner = |k: usize| {
        let side = |bit: usize| if k & bit == 0 { -30.0 } else { 30.0 };
        format!("v {} {} {}\n", side(1) - 30.0, side(2), if k & 4 == 0 { low } else { high })
    };
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(folder.join("mine/plate.obj"), (0..8).map(corner).collect::<String>() + faces)
        .expect("the file can be written");
    let scene = folder.join("mine/scene.toml");
    let text = fs::read_to_string(&scene).expect("the scene was exported");
    fs::write(&scene, text + "\n[[object]]\nmesh = \"plate.obj\"\nmotion = \"fixed\"\n")
        .expect("the file can be written");
}

/// Returns the program's message about the start of `mine`.
fn said_of_start(folder: &Path) -> String {
    let run = ["run", "mine/scene.toml", "--fast", "--headless", "--duration", "0.3", "--no-record"];
    text(&palpus(folder, &run).stderr).to_owned()
}

#[test]
fn start_inside_an_object_is_reported_with_the_way_out() {
    let folder = Folder::new("in-object");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    hold_a_cube(&folder.0);
    // The cube's centre is 42 mm above the table. The cube is therefore inside the plate, and the
    // surfaces are apart.
    add_a_plate(&folder.0, 20.0, 46.0);
    let said = said_of_start(&folder.0);
    assert!(said.contains("the probe overlaps the part by 6.") && said.contains("along (0.00, 0.00, 1.00)"), "{said}");
}

#[test]
fn start_inside_another_tool_is_reported_once() {
    let folder = Folder::new("in-tool");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    hold_a_cube(&folder.0);
    let scene = folder.0.join("mine/scene.toml");
    let text = fs::read_to_string(&scene).expect("the scene was exported");
    let second = "\n[second]\nmesh = \"tool.obj\"\nposition = [-30.0, 0.0, 39.0]\n";
    fs::write(&scene, text + second).expect("the file can be written");
    let said = said_of_start(&folder.0);
    assert_eq!(said.matches("the probe overlaps the part by").count(), 1, "{said}");
    assert!(said.contains("along (0.00, 0.00, 1.00)"), "{said}");
}

#[test]
fn way_out_of_the_part_avoids_objects() {
    let folder = Folder::new("past-object");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    hold_a_cube(&folder.0);
    lower_the_hand(&folder.0, 44.0);
    // The way out of the table is 4.5 mm plus a margin of 1 mm; then 1.5 mm plus 1 mm are needed to
    // leave the plate.
    add_a_plate(&folder.0, 1.0, 2.5);
    let said = said_of_start(&folder.0);
    assert!(said.contains("the probe overlaps the part by 4.") && said.contains("along (0.00, 0.00, 1.00)"), "{said}");
    let way: f64 = said
        .split_once("move it ")
        .and_then(|(_, way)| way.split_once(" mm")?.0.parse().ok())
        .expect("the message has a distance");
    assert!((7.0..9.0).contains(&way), "{said}");
}

/// Runs `mine` for 3 s with --lead-out. Checks that the device leads the grip up out of the part
/// with a small force, and then renders contacts.
fn is_led_out(folder: &Path, rendering: &str) {
    // The hand's intent stays at its start.
    let path = folder.join("mine/hand.csv");
    let lines = fs::read_to_string(&path).expect("the path was exported");
    let still: Vec<&str> = lines.lines().take(2).collect();
    fs::write(&path, format!("{}\n{}\n{}\n", still[0], still[1], still[1])).expect("the file can be written");
    let run = [
        "run",
        "mine/scene.toml",
        "--fast",
        "--headless",
        "--duration",
        "3",
        "--lead-out",
        "--record",
        "run.csv",
        "--force",
    ];
    let output = palpus(folder, &[&run[..], &["--rendering", rendering]].concat());
    let said = text(&output.stderr);
    assert!(output.status.success() && said.contains("the device leads it out"), "{rendering}: {said}");
    let rows = read_recording(&folder.join("run.csv")).expect("the recording can be read").rows;
    let start = rows[0].pose.translation;
    let out = rows.iter().position(|row| row.pose.translation.z - start.z > 8e-3).expect("the tool leaves the part");
    // The way is 8 mm at 20 mm/s, plus the time in which the force ramps up.
    assert!((250..1500).contains(&out), "{rendering}: out after {out} ticks");
    for row in &rows[..out] {
        let (force, speed) = (row.wrench.force.length(), row.twist.linear.length());
        assert!(force < 1.0 && speed < 0.05, "{rendering}: {force} N, {speed} m/s at tick {}", row.tick);
        assert_eq!(row.wrench.torque.length(), 0.0, "{rendering}: tick {}", row.tick);
    }
    let last = rows.last().expect("the recording has rows");
    assert_eq!(last.servo.as_ref().map(|servo| servo.phase), Some(Phase::Engaged as u32), "{rendering}");
    assert!(last.separation > -1e-3, "{rendering}: {} m", last.separation);
    let replay = json(&palpus(folder, &["replay", "run.csv", "--json"]));
    assert_eq!(replay["identical"], replay["ticks"], "{rendering}");
}

#[test]
fn buried_probe_is_led_out_softly_on_request() {
    let folder = Folder::new("led-buried");
    assert!(palpus(&folder.0, &["export", "box-table", "mine"]).status.success());
    bury_a_cube(&folder.0);
    is_led_out(&folder.0, "coupled");
    is_led_out(&folder.0, "direct");
}
