//! `palpus devices`, on whatever machine the tests run.

mod program_run;

use program_run::{document, palpus_without_cache as palpus, text};
use serde_json::Value;

#[test]
fn the_page_names_what_is_there_and_mends_what_is_not() {
    let output = palpus(&["devices"]);
    let page = text(&output.stdout);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    assert!(page.contains("\nREADY TO USE\n") && page.contains("palpus run --device sim"), "{page}");
    let count = |what: &str| page.lines().filter(|line| line.trim_start().starts_with(what)).count();
    assert_eq!(count("looked for  "), count("do this  "), "{page}");
    assert_eq!(count("use it  "), count("safety  "), "{page}");
}

#[test]
fn the_document_has_the_same() {
    let document = document(&palpus(&["devices", "--json"]));
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
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.starts_with("error: ") && error.contains(says), "{device}: {error}");
    }
    let output = palpus(&["run", "pen-sphere", "--device", "haply", "--fast", "--no-record"]);
    assert!(text(&output.stderr).contains("leave --fast out"));
}
