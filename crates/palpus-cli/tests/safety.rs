//! Tests of the safety chain in the program: no cuts in undisturbed runs, and every fault with its
//! name.

mod program_run;

use program_run::{Folder, document, palpus, text};

#[test]
fn undisturbed_built_in_scenes_have_no_cuts() {
    let folder = Folder::new("undisturbed");
    let list = palpus(&folder.0, &["run", "--list"]);
    let list = text(&list.stdout);
    let scenes: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(scenes.len() >= 7, "{list}");
    for scene in scenes {
        let summary =
            document(&palpus(&folder.0, &["run", scene, "--fast", "--duration", "4", "--no-record", "--json"]));
        let cuts = summary["safety"]["cuts"].as_object().expect("the cuts are an object");
        // In the first quarter of a second the force ramps up.
        let after = cuts.iter().filter(|(name, _)| *name != "start_up_ramp").collect::<Vec<_>>();
        assert!(after.is_empty(), "{scene}: {after:?}");
        assert!(cuts.get("start_up_ramp").is_none_or(|ticks| ticks.as_u64() <= Some(250)), "{scene}: {cuts:?}");
        assert_eq!(summary["faults"], 0, "{scene}");
        assert!(summary["force_max_n"].as_f64().is_some_and(|force| force > 0.05), "{scene}: there must be a force");
    }
}

#[test]
fn every_fault_is_named_and_replayed_bit_for_bit() {
    let folder = Folder::new("faults");
    for (fault, cut, faults) in [
        ("non-finite-pose", "non_finite_state", 1),
        ("non-finite-wrench", "non_finite_wrench", 1),
        ("pose-jump", "pose_jump", 1),
        ("turn-jump", "pose_jump", 1),
        ("speed", "speed", 1),
        ("wrong-velocity", "speed", 1),
        ("withheld", "withheld", 0),
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
            ["run", "box-table", "--fast", "--duration", "3", "--fault", &at, "--record", "f.csv", "--force", "--json"];
        let output = palpus(&folder.0, &arguments);
        assert_eq!(output.status.success(), !["panic", "dropped"].contains(&fault), "{fault}");
        let summary = document(&output);
        assert_eq!(summary["faults"], faults, "{fault}: {}", summary["safety"]["cuts"]);
        // A wrench beyond the peak may be reduced by the slew limit in its single tick.
        let cuts = &summary["safety"]["cuts"];
        let is_named = cuts[cut].as_u64().is_some_and(|ticks| ticks > 0) || faults == 0 && cuts["slew"].is_u64();
        assert!(is_named, "{fault}: {cuts}");
        let replay = document(&palpus(&folder.0, &["replay", "f.csv", "--json"]));
        // A replay cannot know that the wrench of the step was replaced.
        let replaced = fault.starts_with("large");
        assert_eq!(replay["identical"] == replay["ticks"], !replaced, "{fault}: {replay}");
    }
}

#[test]
fn stalled_loop_trips_the_watchdog() {
    let folder = Folder::new("stall");
    let arguments =
        ["run", "box-table", "--duration", "1.2", "--no-realtime", "--fault", "late-step@0.5", "--no-record", "--json"];
    let summary = document(&palpus(&folder.0, &arguments));
    let cuts = &summary["safety"]["cuts"];
    assert!(cuts["watchdog"].is_u64() && cuts["late_loop"].is_u64(), "{cuts}");
    assert!(summary["faults"].as_u64().is_some_and(|faults| faults >= 1));
}

#[test]
fn thresholds_are_printed_with_reasons() {
    let folder = Folder::new("limits");
    let limits = text(&palpus(&folder.0, &["run", "box-table", "--limits"]).stdout);
    assert!(limits.contains("force_slew") && limits.contains("peak in 2 ms"), "{limits}");
    let values = document(&palpus(&folder.0, &["run", "box-table", "--limits", "--json"]));
    assert_eq!(values["force_peak"], 8.5);
    let wrong = palpus(&folder.0, &["run", "box-table", "--fault", "earthquake@1"]);
    assert!(!wrong.status.success() && text(&wrong.stderr).contains("pose-jump"));
}
