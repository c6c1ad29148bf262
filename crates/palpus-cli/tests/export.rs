//! Tests of exported built-in scenes.

mod program_run;

use program_run::{Folder, document, json, palpus, text};

#[test]
fn exported_scene_runs_and_is_never_overwritten() {
    let folder = Folder::new("export");
    let exported = palpus(&folder.0, &["export", "pen-sphere", "mine"]);
    assert!(exported.status.success(), "{exported:?}");
    let run = ["run", "mine/scene.toml", "--fast", "--duration", "2", "--no-record", "--json"];
    let summary = json(&palpus(&folder.0, &run));
    assert!(summary["contacts"]["max"].as_f64() > Some(0.0), "there must be contact: {summary}");
    let two = palpus(&folder.0, &["export", "two-hands", "two"]);
    assert!(two.status.success() && folder.0.join("two/second_hand.csv").is_file(), "{two:?}");
    let run = ["run", "two/scene.toml", "--fast", "--duration", "1", "--no-record", "--json"];
    let output = palpus(&folder.0, &run);
    let summary = document(&output);
    assert!(output.status.success() && summary["second"]["ticks"].as_u64() > Some(0), "{output:?}");
    let again = palpus(&folder.0, &["export", "pen-sphere", "mine"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(text(&again.stderr).contains("exists already"), "{again:?}");
    let nothing = palpus(&folder.0, &["export", "pen-spere", "other"]);
    assert!(!nothing.status.success() && !folder.0.join("other").exists());
}
