//! Tests of `palpus devices`, on any machine.
#![allow(clippy::print_stderr, reason = "a skipped test prints the reason")]

mod program_run;

use program_run::{Folder, document, palpus_without_cache as palpus, text};
use serde_json::Value;

#[test]
fn devices_page_lists_found_and_missing_devices() {
    let output = palpus(&["devices"]);
    let page = text(&output.stdout);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    assert!(page.contains("\nREADY TO USE\n") && page.contains("palpus run --device sim"), "{page}");
    let count = |what: &str| page.lines().filter(|line| line.trim_start().starts_with(what)).count();
    assert_eq!(count("looked for  "), count("do this  "), "{page}");
    assert_eq!(count("use it  "), count("safety  "), "{page}");
}

#[test]
fn json_has_the_same_devices() {
    let document = document(&palpus(&["devices", "--json"]));
    let found = document["found"].as_array().expect("the value is a list");
    let sim = found.iter().find(|device| device["device"] == "sim").expect("the simulated device is found");
    assert_eq!((&sim["force_max_n"], &sim["driven"]["rotation"]), (&Value::from(8.5), &Value::from(3)));
    assert_eq!(sim["safety"]["force_peak"], 8.5);
    for missing in document["missing"].as_array().expect("the value is a list") {
        for part in ["backend", "name", "looked_for", "why", "mend"] {
            assert!(missing[part].as_str().is_some_and(|text| !text.is_empty()), "{part}: {missing}");
        }
    }
}

#[test]
fn missing_hardware_is_one_error() {
    for (device, says) in [
        ("haply:ws://127.0.0.1:1", "no service answers"),
        ("spacemouse:/nowhere", "cannot be opened"),
        ("lever", "there are: sim"),
        ("bridge", "not the address of a driver"),
        ("bridge:udp:127.0.0.1:9", "no driver listens at"),
        ("bridge:udp:192.0.2.1:7000", "loopback addresses only"),
    ] {
        let output = palpus(&["run", "pen-sphere", "--device", device, "--no-record"]);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.starts_with("error: ") && error.contains(says), "{device}: {error}");
    }
    let output = palpus(&["run", "pen-sphere", "--device", "haply", "--fast", "--no-record"]);
    assert!(text(&output.stderr).contains("leave out --fast"));
}

#[test]
#[cfg(target_os = "linux")]
fn driver_behind_the_bridge_is_tested_and_runs() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    let folder = Folder::new("bridge");
    let socket = folder.0.join("d.sock").display().to_string();
    let nobody = palpus(&["devices", "--conformance", &socket]);
    let error = text(&nobody.stderr);
    assert!(nobody.status.code() == Some(1) && error.contains("no driver listens at"), "{error}");

    let script = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/bridge/driver.py");
    let mut driver = Command::new("python3");
    driver.arg("-B").arg(script).args([&socket, "--rate", "500"]).stdout(Stdio::piped());
    let Ok(mut driver) = driver.spawn() else {
        eprintln!("skipped: python3 is not installed");
        return;
    };
    let mut line = String::new();
    let _ = BufReader::new(driver.stdout.take().expect("the driver has an output")).read_line(&mut line);
    let tested = palpus(&["devices", "--conformance", &socket]);
    let device = format!("bridge:{socket}");
    let run = palpus(&["run", "pen-sphere", "--device", &device, "--duration", "1", "--no-record", "--json"]);
    let _ = driver.kill();
    let _ = driver.wait();
    let page = text(&tested.stdout);
    assert!(tested.status.success() && page.contains("conforms: palpus run"), "{page}{}", text(&tested.stderr));
    assert_eq!(page.matches("passed  ").count(), 11, "{page}");
    // This test does not check whether the machine held the rate.
    assert_eq!(document(&run)["ticks"].as_u64().map(|ticks| ticks > 0), Some(true), "{}", text(&run.stderr));
}
