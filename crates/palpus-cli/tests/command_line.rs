//! Tests of the command line: its documentation, man pages, standard input and output, `--quiet`
//! and `--verbose`.

mod program_run;

use std::fs;

use program_run::{Folder, assert_success, json, palpus, piped, text};

/// A cube of side 2 about the origin.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
const POSES: &str = "tx,ty,tz,qx,qy,qz,qw\n2.5,0,0,0,0,0,1\n1.5,0,0,0,0,0,1\n";

#[test]
fn command_line_page_is_current() {
    let folder = Folder::new("page");
    let output = palpus(&folder.0, &["man", "--markdown"]);
    assert_success(&output);
    let page = include_str!("../../../docs/command-line.md");
    let said = text(&output.stdout);
    let differs = said.lines().zip(page.lines()).find(|(said, stands)| said != stands);
    assert_eq!(differs, None, "the page is out of date: run palpus man --markdown > docs/command-line.md");
    assert_eq!(said.lines().count(), page.lines().count());
}

#[test]
fn every_command_has_a_man_page() {
    let folder = Folder::new("man");
    assert_success(&palpus(&folder.0, &["man", "--out", "pages"]));
    for page in ["palpus.1", "palpus-run.1", "palpus-query.1", "palpus-bench-scale.1"] {
        let text = fs::read_to_string(folder.0.join("pages").join(page)).expect(page);
        assert!(text.contains(".TH") && text.contains("SYNOPSIS"), "{page}");
    }
}

#[test]
fn two_meshes_run_and_replay_without_a_scene_file() {
    let folder = Folder::new("pair");
    folder.file("tool.obj", CUBE);
    fs::create_dir(folder.0.join("parts")).expect("the folder can be created");
    folder.file("parts/part.obj", CUBE);
    let run = ["run", "tool.obj", "parts/part.obj", "--fast", "--duration", "2"];
    let output = palpus(&folder.0, &[&run[..], &["--record", "run.csv"]].concat());
    assert_success(&output);
    assert!(text(&output.stderr).contains("the unit of both meshes seems to be cm"), "{}", text(&output.stderr));
    let said = palpus(&folder.0, &["replay", "run.csv"]);
    assert_success(&said);
    let summary = json(&palpus(&folder.0, &[&run[..], &["--unit", "inch", "--no-record", "--json"]].concat()));
    assert_eq!((&summary["faults"], &summary["ticks"]), (&0.into(), &2000.into()));
    assert!(summary["force_max_n"].as_f64() > Some(0.1), "the probe touches: {summary}");
    for (wrong, says) in [
        (&["run", "spoon-cup", "tool.obj"][..], "one scene, or two meshes"),
        (&["run", "tool.obj"], "PROBE ENVIRONMENT"),
        (&["run", "tool.obj", "parts/part.obj", "--unit", "parsec"], "parsec"),
    ] {
        let output = palpus(&folder.0, wrong);
        assert!(!output.status.success() && text(&output.stderr).contains(says), "{}", text(&output.stderr));
    }
}

#[test]
fn poses_come_from_standard_input() {
    let folder = Folder::new("pipe");
    folder.file("cube.obj", CUBE);
    let query = |more: &[&str]| {
        let line = [&["query", "cube.obj", "cube.obj", "--poses", "-"], more].concat();
        let output = piped(&folder.0, &line, POSES.as_bytes());
        assert_success(&output);
        output
    };
    for out in [&[][..], &["--out", "-"]] {
        let table = text(&query(out).stdout);
        assert!(table.starts_with("frame,separation,") && table.lines().count() == 3, "{table}");
    }
    let document = json(&query(&["--json", "--tolerance", "1"]));
    let separations: Vec<f64> = document["results"]
        .as_array()
        .expect("the results are a list")
        .iter()
        .filter_map(|row| row["separation"].as_f64())
        .collect();
    assert_eq!(separations, [0.5, -0.5]);
    assert_eq!(document["tolerance"].as_f64(), Some(1.0));
}

#[test]
fn models_come_from_standard_input() {
    let folder = Folder::new("model-pipe");
    folder.file("cube.obj", CUBE);
    folder.file("poses.csv", POSES);
    let run = |line: &[&str]| piped(&folder.0, line, CUBE.as_bytes());
    let inspected = json(&run(&["inspect", "-", "--json"]));
    assert_eq!((inspected["model"].as_str(), inspected["triangles"].as_u64()), (Some("standard input"), Some(12)));
    assert_eq!(json(&run(&["prepare", "-", "--json"]))[0]["pieces"].as_u64(), Some(1));
    for command in ["query", "depth", "clearance"] {
        for models in [["-", "cube.obj"], ["cube.obj", "-"]] {
            let line = [&[command], &models[..], &["--poses", "poses.csv", "--out", "out.csv"]].concat();
            assert_success(&run(&line));
        }
        let twice = run(&[command, "-", "-", "--poses", "poses.csv", "--out", "out.csv"]);
        assert_eq!(twice.status.code(), Some(1), "{command}");
        assert!(text(&twice.stderr).contains("name the other file"), "{}", text(&twice.stderr));
    }
    let empty = piped(&folder.0, &["inspect", "-"], b"");
    assert!(text(&empty.stderr).starts_with("error: standard input: "), "{}", text(&empty.stderr));
}

#[test]
fn unknown_command_names_a_similar_one() {
    let folder = Folder::new("similar");
    for (typed, meant) in [("rnu", "run"), ("qury", "query")] {
        let refused = palpus(&folder.0, &[typed]);
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains(&format!("'{meant}'")), "{}", text(&refused.stderr));
    }
}

#[test]
fn quiet_and_verbose_set_the_amount_of_output() {
    let folder = Folder::new("levels");
    // An OBJ file named as STL causes a note.
    folder.file("cube.stl", CUBE);
    let said = |more: &[&str]| {
        let output = palpus(&folder.0, &[&["prepare", "cube.stl"], more].concat());
        assert_success(&output);
        text(&output.stderr)
    };
    let usual = said(&[]);
    assert!(usual.contains("named as STL, but its content is OBJ") && !usual.contains("from the cache"), "{usual}");
    assert_eq!(said(&["-q"]), "");
    assert!(said(&["-v"]).contains("12 triangles, 1 convex pieces, from the cache"));
    let wrong = palpus(&folder.0, &["inspect", "none.obj", "--quiet"]);
    assert!(!wrong.status.success() && text(&wrong.stderr).starts_with("error: "));
}

#[test]
fn mistyped_scene_gets_a_suggestion() {
    let folder = Folder::new("mistyped");
    for line in [&["run", "spon-cup", "--headless"][..], &["export", "spon-cup", "mine"]] {
        let output = palpus(&folder.0, line);
        assert!(!output.status.success());
        assert!(text(&output.stderr).contains("did you mean `spoon-cup`?"), "{}", text(&output.stderr));
    }
}

#[test]
fn version_names_the_program() {
    let folder = Folder::new("version");
    let version = text(&palpus(&folder.0, &["--version"]).stdout);
    assert_eq!(version.trim(), concat!("palpus ", env!("CARGO_PKG_VERSION")));
}
