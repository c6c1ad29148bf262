//! What the safety chain does, as a user sees it: nothing in an undisturbed run, and every fault by its name.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A folder of its own for one test, gone when the test is over.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("palpus-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn palpus(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpus"));
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.join("cache")).args(arguments);
    // Nobody closes the windows of a test.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command.output().expect("the program starts")
}

fn json(output: &Output) -> Value {
    let errors = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("no JSON document ({error}): {errors}"))
}

#[test]
fn nothing_is_cut_in_the_undisturbed_built_in_scenes() {
    let folder = Folder::new("undisturbed");
    let list = palpus(&folder.0, &["run", "--list"]);
    let list = String::from_utf8_lossy(&list.stdout).into_owned();
    let scenes: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(scenes.len() >= 7, "{list}");
    for scene in scenes {
        let summary = json(&palpus(&folder.0, &["run", scene, "--fast", "--duration", "4", "--no-record", "--json"]));
        let cuts = summary["safety"]["cuts"].as_object().expect("counts by name");
        // The first quarter of a second is the ramp.
        let after = cuts.iter().filter(|(name, _)| *name != "engagement").collect::<Vec<_>>();
        assert!(after.is_empty(), "{scene}: {after:?}");
        assert!(cuts.get("engagement").is_none_or(|ticks| ticks.as_u64() <= Some(250)), "{scene}: {cuts:?}");
        assert_eq!(summary["faults"], 0, "{scene}");
        assert!(summary["force_max_n"].as_f64().is_some_and(|force| force > 0.05), "{scene}: nothing was felt");
    }
}

#[test]
fn every_fault_is_named_in_the_summary_and_replayed_bit_for_bit() {
    let folder = Folder::new("faults");
    for (fault, cut, faults) in [
        ("non-finite-pose", "non_finite_state", 1),
        ("non-finite-wrench", "non_finite_wrench", 1),
        ("pose-jump", "pose_jump", 1),
        ("turn-jump", "pose_jump", 1),
        ("speed", "speed", 1),
        ("frozen", "frozen_state", 1),
        ("clock-back", "device_clock", 1),
        ("clock-ahead", "device_clock", 1),
        ("large-wrench", "slew", 0),
        ("large-torque", "saturation", 0),
        ("panic", "panic", 1),
        ("dropped", "device", 1),
    ] {
        let at = format!("{fault}@1.5");
        let arguments =
            ["run", "box-table", "--fast", "--duration", "3", "--fault", &at, "--record", "f.csv", "--json"];
        let output = palpus(&folder.0, &arguments);
        assert_eq!(output.status.success(), !["panic", "dropped"].contains(&fault), "{fault}");
        let summary = json(&output);
        assert_eq!(summary["faults"], faults, "{fault}: {}", summary["safety"]["cuts"]);
        // What is beyond the peak may be held back by the slew limit for all of its one tick.
        let cuts = &summary["safety"]["cuts"];
        let is_named = cuts[cut].as_u64().is_some_and(|ticks| ticks > 0) || faults == 0 && cuts["slew"].is_u64();
        assert!(is_named, "{fault}: {cuts}");
        let replay = json(&palpus(&folder.0, &["replay", "f.csv", "--json"]));
        // A replay has no way to know that the step's answer was replaced.
        let replaced = fault.starts_with("large");
        assert_eq!(replay["identical"] == replay["ticks"], !replaced, "{fault}: {replay}");
    }
}

#[test]
fn a_loop_that_stalls_in_real_time_is_a_fault_of_the_watchdog() {
    let folder = Folder::new("stall");
    let arguments =
        ["run", "box-table", "--duration", "1.2", "--no-realtime", "--fault", "late-step@0.5", "--no-record", "--json"];
    let summary = json(&palpus(&folder.0, &arguments));
    let cuts = &summary["safety"]["cuts"];
    assert!(cuts["watchdog"].is_u64() && cuts["late_loop"].is_u64(), "{cuts}");
    assert!(summary["faults"].as_u64().is_some_and(|faults| faults >= 1));
}

#[test]
fn thresholds_are_printed_with_their_reasons() {
    let folder = Folder::new("limits");
    let text = palpus(&folder.0, &["run", "box-table", "--limits"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("force_slew") && text.contains("peak in 2 ms"), "{text}");
    let values = json(&palpus(&folder.0, &["run", "box-table", "--limits", "--json"]));
    assert_eq!(values["force_peak"], 8.5);
    let wrong = palpus(&folder.0, &["run", "box-table", "--fault", "earthquake@1"]);
    assert!(!wrong.status.success() && String::from_utf8_lossy(&wrong.stderr).contains("pose-jump"));
}
