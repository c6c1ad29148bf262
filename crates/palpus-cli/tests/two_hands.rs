//! Tests of scenes with several tools.

mod program_run;

use std::fs;

use program_run::{Folder, assert_success, document, json, palpus, text};

#[test]
fn both_tools_are_summarised_recorded_and_replayed() {
    let folder = Folder::new("two-hands-run");
    let run = ["run", "two-hands", "--fast", "--duration", "8", "--second-hand", "firm", "--record", "run.csv"];
    let summary = json(&palpus(&folder.0, &[&run[..], &["--json"]].concat()));
    for hand in [&summary, &summary["second"]] {
        assert_eq!(hand["ticks"], 8000);
        assert_eq!((&hand["faults"], &hand["allocations"]), (&0.into(), &0.into()));
        assert!(hand["force_max_n"].as_f64().expect("the summary has a force") > 0.1, "{hand}");
        assert!(hand["contacts"]["max"].as_u64().expect("the summary has a count") > 0);
    }
    for file in ["run.csv", "run-second.csv"] {
        let report = json(&palpus(&folder.0, &["replay", file, "--json"]));
        let other = if file == "run.csv" { "second" } else { "first" };
        for tool in [&report, &report[other]] {
            assert_eq!((&tool["ticks"], &tool["identical"]), (&8000.into(), &8000.into()), "{file}: {tool}");
        }
    }
    // A picture and a page of either recording show both tools.
    for file in ["run.csv", "run-second.csv"] {
        assert_success(&palpus(&folder.0, &["replay", file, "--screenshot", "tick.png", "--at", "4"]));
        assert_success(&palpus(&folder.0, &["report", file]));
        let page = fs::read_to_string(folder.0.join(file).with_extension("html")).expect("the page can be read");
        assert!(page.contains("replays bit for bit"), "{file}");
    }
    // A second run must be identical.
    let again = ["run", "two-hands", "--fast", "--duration", "8", "--second-hand", "firm", "--record", "again.csv"];
    json(&palpus(&folder.0, &[&again[..], &["--json"]].concat()));
    let forces = |name: &str| -> Vec<String> {
        let recording = fs::read_to_string(folder.0.join(name)).expect("the recording can be read");
        let rows = recording.lines().filter(|line| !line.starts_with('#')).skip(1);
        rows.map(|row| row.split(',').skip(17).take(6).collect::<Vec<_>>().join(",")).collect()
    };
    for name in ["run", "run-second"] {
        let other = name.replace("run", "again");
        assert!(forces(&format!("{name}.csv")) == forces(&format!("{other}.csv")), "{name}");
    }
    // A replay needs the recordings of both tools.
    fs::remove_file(folder.0.join("run-second.csv")).expect("the recording exists");
    let alone = palpus(&folder.0, &["replay", "run.csv"]);
    assert!(!alone.status.success() && text(&alone.stderr).contains("run-second.csv"), "{}", text(&alone.stderr));
}

#[test]
fn fault_of_one_device_does_not_affect_the_other() {
    let folder = Folder::new("two-hands-fault");
    let run =
        ["run", "two-hands", "--fast", "--duration", "4", "--fault", "pose-jump@2", "--record", "run.csv", "--json"];
    let summary = json(&palpus(&folder.0, &run));
    assert_eq!((&summary["faults"], &summary["second"]["faults"]), (&1.into(), &0.into()));
    assert_eq!(summary["second"]["ticks"], 4000);
    let report = json(&palpus(&folder.0, &["replay", "run-second.csv", "--json"]));
    for tool in [&report, &report["first"]] {
        assert_eq!(tool["identical"], 4000, "{tool}");
    }
    // A lost device leaves its tool at its last pose.
    let lost =
        ["run", "two-hands", "--fast", "--duration", "4", "--fault", "dropped@2", "--record", "lost.csv", "--json"];
    let output = palpus(&folder.0, &lost);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let summary = document(&output);
    assert_eq!((&summary["ticks"], &summary["second"]["ticks"]), (&2001.into(), &4000.into()));
    let report = json(&palpus(&folder.0, &["replay", "lost-second.csv", "--json"]));
    assert_eq!((&report["identical"], &report["first"]["identical"]), (&4000.into(), &2001.into()));
}

/// Writes a brick and a floor as meshes, in mm about their centres.
fn bricks(folder: &Folder) {
    let brick = |name: &str, half: [f64; 3]| {
        let corner = |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { half[axis] } else { -half[axis] });
        let vertices: String = (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
        let faces = "f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
        folder.file(name, &(vertices + faces));
    };
    brick("brick.obj", [20.0, 15.0, 10.0]);
    brick("floor.obj", [200.0, 200.0, 10.0]);
}

#[test]
fn scene_file_with_a_second_tool_runs_and_is_pictured() {
    let folder = Folder::new("two-hands-file");
    // Two bricks above the floor; the second tool is to the right of the first tool.
    bricks(&folder);
    let scene = |second: &str| {
        let text = format!(
            "unit = \"mm\"\n[probe]\nmesh = \"brick.obj\"\nposition = [-30, 0, 40]\n[environment]\nmesh = \"floor.obj\"\n\
             position = [0, 0, -10]\n{second}"
        );
        folder.file("scene.toml", &text);
    };
    scene("[second]\nmesh = \"brick.obj\"\nposition = [30, 0, 40]\n[second.hand]\npreset = \"firm\"\n");
    let run = ["run", "scene.toml", "--fast", "--duration", "1", "--no-record", "--screenshot", "both.png", "--json"];
    let summary = json(&palpus(&folder.0, &run));
    assert!(summary["second"]["contacts"]["max"].as_u64().expect("the summary has a count") > 0, "{summary}");
    assert!(fs::metadata(folder.0.join("both.png")).is_ok_and(|file| file.len() > 1000));
    for (second, word) in [
        ("[second]\nmesh = \"brick.obj\"\npositon = [0, 0, 0]\n", "position"),
        ("[second]\nposition = [0, 0, 0]\n", "[second] has no mesh"),
        ("[second]\nmesh = \"brick.obj\"\n[second.hand]\npreset = \"strong\"\n", "firm"),
        ("[second]\nmesh = \"brick.obj\"\n[second.hand]\npresent = \"firm\"\n", "preset"),
    ] {
        scene(second);
        let output = palpus(&folder.0, &["run", "scene.toml", "--no-record"]);
        let error = text(&output.stderr);
        assert!(!output.status.success() && error.contains(word), "{second}: {error}");
    }
}

/// Writes a scene with `count` bricks in a row above a floor, each a tool. The coupling and the
/// device limits of the second brick differ from the first brick's.
fn row_of_tools(folder: &Folder, count: usize, more: &str) {
    bricks(folder);
    let tool = |k: usize| {
        let own = ["", "coupling = { stiffness = 400 }\ndevice = { force_limit = 2.0 }\n"][usize::from(k == 1)];
        format!(
            "[[tool]]\nmesh = \"brick.obj\"\nposition = [{}, 0, 14]\nhand = {{ seed = {k}, tremor = 0.4 }}\n{own}",
            39.5 * k as f64
        )
    };
    let tools: String = (0..count).map(tool).collect();
    let text = format!("unit = \"mm\"\n[environment]\nmesh = \"floor.obj\"\nposition = [0, 0, -10]\n{tools}{more}");
    folder.file("scene.toml", &text);
}

#[test]
fn three_tools_are_recorded_and_replayed_bit_for_bit() {
    let folder = Folder::new("three-tools");
    row_of_tools(&folder, 3, "");
    let run = ["run", "scene.toml", "--fast", "--duration", "3", "--hand", "firm", "--record", "run.csv", "--json"];
    let summary = json(&palpus(&folder.0, &[&run[..], &["--screenshot", "three.png"]].concat()));
    for hand in [&summary, &summary["second"], &summary["third"]] {
        assert_eq!((&hand["ticks"], &hand["faults"], &hand["allocations"]), (&3000.into(), &0.into(), &0.into()));
        assert!(hand["force_max_n"].as_f64().expect("the summary has a force") > 0.1, "{hand}");
    }
    assert!(
        summary["second"]["force_max_n"].as_f64().expect("the summary has a force") <= 2.0,
        "the second tool must keep its own limit"
    );
    let files = ["run.csv", "run-second.csv", "run-third.csv"];
    assert_eq!(summary["recordings"], serde_json::json!(files));
    assert!(fs::metadata(folder.0.join("three.png")).is_ok_and(|file| file.len() > 1000));
    // A replay works from any of the three recordings, without the scene file.
    fs::remove_file(folder.0.join("scene.toml")).expect("the scene file exists");
    for (k, file) in files.iter().enumerate() {
        let report = json(&palpus(&folder.0, &["replay", file, "--json"]));
        let others = ["first", "second", "third"].into_iter().enumerate().filter(|(other, _)| *other != k);
        for tool in others.map(|(_, name)| &report[name]).chain([&report]) {
            assert_eq!((&tool["ticks"], &tool["identical"]), (&3000.into(), &3000.into()), "{file}: {tool}");
        }
    }
    assert_success(&palpus(&folder.0, &["replay", "run-third.csv", "--screenshot", "tick.png", "--at", "2"]));
    assert_success(&palpus(&folder.0, &["report", "run-second.csv"]));
    fs::remove_file(folder.0.join("run-third.csv")).expect("the recording exists");
    let alone = palpus(&folder.0, &["replay", "run.csv"]);
    assert!(!alone.status.success() && text(&alone.stderr).contains("run-third.csv"), "{}", text(&alone.stderr));
}

#[test]
fn loss_of_one_device_of_three_leaves_the_others_running() {
    let folder = Folder::new("three-tools-lost");
    row_of_tools(&folder, 3, "");
    let run =
        ["run", "scene.toml", "--fast", "--duration", "3", "--fault", "dropped@2", "--record", "run.csv", "--json"];
    let output = palpus(&folder.0, &run);
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let summary = document(&output);
    assert_eq!(
        (&summary["ticks"], &summary["second"]["ticks"], &summary["third"]["ticks"]),
        (&2001.into(), &3000.into(), &3000.into())
    );
    assert_eq!((&summary["second"]["faults"], &summary["third"]["faults"]), (&0.into(), &0.into()));
    let report = json(&palpus(&folder.0, &["replay", "run-second.csv", "--json"]));
    assert_eq!(
        (&report["identical"], &report["first"]["identical"], &report["third"]["identical"]),
        (&3000.into(), &2001.into(), &3000.into())
    );
}

#[test]
fn doctor_accepts_scenes_with_several_tools() {
    let folder = Folder::new("two-hands-doctor");
    let output = palpus(&folder.0, &["doctor", "--scene", "two-hands", "--duration", "0.5", "--json"]);
    assert!(
        document(&output)["scene"]["ticks"].as_u64().expect("the summary has a count") > 0,
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn contradicting_tool_settings_are_errors() {
    let folder = Folder::new("three-tools-errors");
    for (more, word) in [
        ("[probe]\nmesh = \"brick.obj\"\n", "[probe] and [[tool]]"),
        ("[second]\nmesh = \"brick.obj\"\n", "[second] and [[tool]]"),
        ("[hand]\npreset = \"firm\"\n", "[hand] and [[tool]]"),
        ("[[tool]]\nposition = [0, 0, 0]\n", "[[tool]] has no mesh"),
        ("[[tool]]\nmesh = \"brick.obj\"\ndevice = { rate = 500 }\n", "rate"),
        ("[[tool]]\nmesh = \"brick.obj\"\ncoupling = { stifness = 500 }\n", "stiffness"),
    ] {
        row_of_tools(&folder, 2, more);
        let output = palpus(&folder.0, &["run", "scene.toml", "--no-record"]);
        let error = text(&output.stderr);
        assert!(!output.status.success() && error.contains(word), "{more}: {error}");
    }
    row_of_tools(&folder, 2, "");
    for (arguments, word) in [
        (&["--hand", "firm", "--hand", "tight", "--hand", "normal"][..], "only 2 tools"),
        (&["--hand", "firm", "--hand", "tight", "--second-hand", "tight"], "--second-hand"),
    ] {
        let output = palpus(&folder.0, &[&["run", "scene.toml", "--no-record"], arguments].concat());
        let error = text(&output.stderr);
        assert!(!output.status.success() && error.contains(word), "{arguments:?}: {error}");
    }
}

#[test]
fn options_for_a_second_hand_need_a_second_tool() {
    let folder = Folder::new("two-hands-errors");
    for (arguments, word) in [
        (&["run", "pen-sphere", "--second-hand", "firm", "--no-record"][..], "two-hands"),
        (&["run", "two-hands", "--second-hand", "strong", "--no-record"], "relaxed"),
        (&["run", "two-hands", "--device", "haply", "--second-device", "haply", "--no-record"], "--second-device"),
    ] {
        let output = palpus(&folder.0, arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        assert!(error.contains(word), "{arguments:?} does not mention `{word}`: {error}");
    }
    assert!(text(&palpus(&folder.0, &["run", "--list"]).stdout).contains("two-hands"));
}
