//! Tests of `palpus doctor`, and of devices whose maker's library is missing or replaced by a
//! stand-in.

mod program_run;

use std::path::Path;
use std::process::Command;

use program_run::{assert_success, command_without_cache, document, palpus_without_cache as palpus, text};

#[test]
fn doctor_prints_text_or_json() {
    // The verdict depends on the machine and its load, so any of the three verdicts is accepted.
    let output = palpus(&["doctor", "--scene", "peg-hole", "--duration", "0.5", "--json"]);
    let report = document(&output);
    let fitness = report["verdict"]["fitness"].as_str().expect("the report has a verdict");
    assert!(["fit", "fit_with_notes", "not_fit"].contains(&fitness), "{fitness}");
    assert_eq!(output.status.code(), Some(i32::from(fitness == "not_fit")));
    assert_eq!(report["timer"]["turns"], 500);
    assert_eq!(report["scene"]["name"], "peg-hole");
    assert!(report["scene"]["p999_us"].as_f64().is_some_and(|us| us > 0.0));
    assert_eq!(report["real_time"].as_array().map(Vec::len), Some(5));
    for note in report["verdict"]["notes"].as_array().expect("the notes are a list") {
        assert!(note["what"].as_str().is_some_and(|what| !what.is_empty() && !what.contains('\n')), "{note}");
    }

    let words = text(&palpus(&["doctor", "--scene", "peg-hole", "--duration", "0.5"]).stdout);
    assert!(words.trim_start().starts_with("verdict  "), "{words}");
    for line in [
        "timer at 1 kHz",
        "scene",
        "priority",
        "locked memory",
        "large pages",
        "cores",
        "governor",
        "kernel",
        "other load",
    ] {
        assert!(words.contains(&format!("{line}  ")), "{line} in\n{words}");
    }
}

#[test]
fn doctor_refuses_invalid_arguments() {
    let too_short = palpus(&["doctor", "--duration", "0"]);
    assert!(!too_short.status.success() && text(&too_short.stderr).contains("--duration"));
    let no_scene = palpus(&["doctor", "--scene", "no-such"]);
    assert!(!no_scene.status.success() && text(&no_scene.stderr).contains("built-in scenes are"));
}

#[test]
fn missing_library_is_reported_with_a_remedy() {
    for device in ["force-dimension:/no/such.so", "force-dimension-simulator:/no/such.so", "openhaptics:/no/such.so"] {
        let output = palpus(&["run", "peg-hole", "--device", device, "--duration", "1", "--no-record"]);
        let said = text(&output.stderr);
        assert!(!output.status.success(), "{device}");
        assert!(
            said.contains(device) && said.contains("searched for /no/such.so") && said.contains("give the path"),
            "{said}"
        );
    }
    let fast = palpus(&["run", "peg-hole", "--device", "openhaptics:/no/such.so", "--fast", "--no-record"]);
    assert!(text(&fast.stderr).contains("--fast"), "{}", text(&fast.stderr));
    let unknown = palpus(&["run", "peg-hole", "--device", "feather"]);
    assert!(text(&unknown.stderr).contains("openhaptics[#NAME][:LIBRARY]"), "{}", text(&unknown.stderr));
}

/// Compiles the stand-in library `name` from the tests of the drivers.
fn stand_in(name: &str) -> String {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../palpus-drivers/tests/stand_in/{name}.rs"));
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("program-{name}{}", std::env::consts::DLL_SUFFIX));
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let mut command = Command::new(rustc);
    command
        .args(["--edition", "2024", "--crate-type", "cdylib", "--crate-name", "stand_in", "-o"])
        .arg(&file)
        .arg(source);
    let output = command.output().expect("rustc runs");
    assert_success(&output);
    file.display().to_string()
}

#[test]
fn loop_runs_with_a_makers_library() {
    // Numbers from tests/stand_in/keys.rs: a powered, calibrated device with three axes and 3 N.
    let begin = "0=1,4=1,17=1,6=0.01,13=3,14=3";
    for (device, name) in [("force-dimension", "dhd"), ("openhaptics", "hd")] {
        let device = format!("{device}:{}", stand_in(name));
        // This test does not check whether the machine held the rate.
        let run = ["run", "peg-hole", "--device", &device, "--duration", "0.3", "--no-record", "--json", "--lenient"];
        let output = command_without_cache(&run).env("STAND_IN", begin).output().expect("the program starts");
        let summary = document(&output);
        assert!(output.status.success() && summary["ticks"].as_u64().is_some_and(|ticks| ticks > 0), "{summary}");
    }
    // The output names the passed self test. A device whose own watchdog does not trip is refused.
    let device = format!("force-dimension:{}", stand_in("dhd"));
    let run = ["run", "peg-hole", "--device", &device, "--duration", "0.3", "--no-record"];
    let output = command_without_cache(&run).env("STAND_IN", begin).output().expect("the program starts");
    assert!(text(&output.stderr).contains("self test passed"), "{}", text(&output.stderr));
    let begin = format!("{begin},25=1");
    let output = command_without_cache(&run).env("STAND_IN", begin).output().expect("the program starts");
    let error = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("failed its self test") && error.contains("its own watchdog"), "{error}");
}
