//! `palpus devices`, on whatever machine the tests run.

use std::process::{Command, Output};

use serde_json::Value;

fn palpus(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpus")).args(arguments).output().expect("the program starts")
}

#[test]
fn the_page_names_what_is_there_and_mends_what_is_not() {
    let output = palpus(&["devices"]);
    let page = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(page.contains("\nREADY TO USE\n") && page.contains("palpus run --device sim"), "{page}");
    let count = |what: &str| page.lines().filter(|line| line.trim_start().starts_with(what)).count();
    assert_eq!(count("looked for  "), count("do this  "), "{page}");
    assert_eq!(count("use it  "), count("safety  "), "{page}");
}

#[test]
fn the_document_has_the_same() {
    let output = palpus(&["devices", "--json"]);
    let document: Value = serde_json::from_slice(&output.stdout).expect("one JSON document");
    let found = document["found"].as_array().expect("a list");
    let sim = found.iter().find(|device| device["device"] == "sim").expect("the simulated device");
    assert_eq!((&sim["force_max_n"], &sim["driven"]["rotation"]), (&Value::from(8.5), &Value::from(3)));
    assert_eq!(sim["safety"]["force_peak"], 8.5);
    for missing in document["missing"].as_array().expect("a list") {
        for part in ["backend", "name", "looked_for", "why", "mend"] {
            assert!(missing[part].as_str().is_some_and(|text| !text.is_empty()), "{part}: {missing}");
        }
    }
}

#[test]
fn hardware_that_is_not_there_is_one_error() {
    for (device, says) in [
        ("haply:ws://127.0.0.1:1", "nothing answers"),
        ("spacemouse:/nowhere", "cannot be opened"),
        ("lever", "there are: sim"),
    ] {
        let output = palpus(&["run", "pen-sphere", "--device", device, "--no-record"]);
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.starts_with("error: ") && error.contains(says), "{device}: {error}");
    }
    let output = palpus(&["run", "pen-sphere", "--device", "haply", "--fast", "--no-record"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("leave --fast out"));
}
