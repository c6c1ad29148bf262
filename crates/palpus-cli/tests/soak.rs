//! Tests of `palpus soak`.

mod program_run;

use std::path::PathBuf;

use program_run::{document, palpus_without_cache as palpus, text};

fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

#[test]
fn soak_writes_its_report() {
    let out = folder("soak");
    let out = out.to_str().expect("the path is valid UTF-8");
    let record = format!("{out}/soak.csv");
    let arguments = ["--duration", "2s", "--timer", "0.2", "--out", out, "--record", &record, "--json"];
    let output = palpus(&[&["soak", "peg-hole"][..], &arguments].concat());
    let report = document(&output);
    // The machine decides if the rate holds, so only the report is tested.
    assert_eq!(output.status.code(), Some(i32::from(report["held"] != true)));
    assert_eq!(report["failures"].as_array().map(Vec::is_empty), report["held"].as_bool());
    assert_eq!((&report["scene"], &report["finished"]), (&"peg-hole".into(), &true.into()));
    assert_eq!(report["allocations"], 0);
    assert!(report["ran_s"].as_f64().is_some_and(|ran| (1.9..60.0).contains(&ran)), "{}", report["ran_s"]);
    let ticks: f64 = report["ticks"].as_f64().expect("the recording has ticks");
    assert!(ticks > 0.0 && report["lateness"]["turns"].as_f64() == Some(ticks));
    for bare in ["timer_before", "timer_after"] {
        assert_eq!(report[bare]["turns"], 200, "{bare}");
    }
    let rows = report["over_time"].as_array().expect("the recording has rows");
    assert!(rows.len() >= 2 && rows.iter().all(|row| row["rate_hz"].as_f64().is_some_and(|rate| rate > 0.0)));
    assert!(cfg!(not(target_os = "linux")) || rows[0]["machine"]["resident"].as_u64().is_some_and(|bytes| bytes > 0));

    let again = palpus(&["replay", &record]);
    assert!(again.status.success(), "{}", text(&again.stdout));

    let page = std::fs::read_to_string(format!("{out}/soak.html")).expect("the page can be read");
    assert!(page.contains("<svg") && page.contains("peg-hole") && !page.contains("http-equiv"));
    let words = std::fs::read_to_string(format!("{out}/soak.md")).expect("the file can be read");
    for part in ["verdict", "late by", "timer before", "step", "cuts", "memory", "time.svg", "lateness.svg"] {
        assert!(words.contains(part), "{part} in\n{words}");
    }
    assert!(!words.contains("http://"));
}

#[test]
fn wrong_arguments_are_reported() {
    let said = |arguments: &[&str]| {
        let output = palpus(arguments);
        (output.status.code(), text(&output.stderr))
    };
    let (code, words) = said(&["soak", "--duration", "1x"]);
    assert!(code == Some(2) && words.contains("1h30m"), "{words}");
    let (code, words) = said(&["soak", "no-such"]);
    assert!(code == Some(1) && words.contains("built-in scenes are"), "{words}");
    let out = folder("soak-wrong");
    let out = out.to_str().expect("the path is valid UTF-8");
    let (code, words) = said(&["soak", "--models", "/no/such", "--out", out]);
    assert!(code == Some(1) && words.contains("armadillo_31240.obj is neither"), "{words}");
    let (code, words) = said(&["soak", "peg-hole", "--hand", "none", "--timer", "0", "--out", out]);
    assert!(code == Some(1) && words.contains("must hold the device"), "{words}");
}
