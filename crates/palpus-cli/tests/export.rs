//! A built-in scene as files, as its user starts from it.

use std::fs;
use std::process::{Command, Output};

fn palpus(folder: &std::path::Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpus"));
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.join("cache")).args(arguments);
    command.output().expect("it starts")
}

#[test]
fn an_exported_scene_runs_and_is_never_written_over() {
    let folder = std::env::temp_dir().join(format!("palpus-export-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    let exported = palpus(&folder, &["export", "pen-sphere", "mine"]);
    assert!(exported.status.success(), "{exported:?}");
    let run = ["run", "mine/scene.toml", "--fast", "--duration", "2", "--no-record", "--json"];
    let output = palpus(&folder, &run);
    assert!(output.status.success(), "{output:?}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one document");
    assert!(summary["contacts"]["max"].as_f64() > Some(0.0), "it touches: {summary}");
    let two = palpus(&folder, &["export", "two-hands", "two"]);
    assert!(two.status.success() && folder.join("two/second_hand.csv").is_file(), "{two:?}");
    let run = ["run", "two/scene.toml", "--fast", "--duration", "1", "--no-record", "--json"];
    let output = palpus(&folder, &run);
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one document");
    assert!(output.status.success() && summary["second"]["ticks"].as_u64() > Some(0), "{output:?}");
    let again = palpus(&folder, &["export", "pen-sphere", "mine"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("is there already"), "{again:?}");
    let nothing = palpus(&folder, &["export", "pen-spere", "other"]);
    assert!(!nothing.status.success() && !folder.join("other").exists());
    fs::remove_dir_all(&folder).expect("it was ours");
}
