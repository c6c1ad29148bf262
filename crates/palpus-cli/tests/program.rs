//! Tests of the whole program: arguments, output and exit status.

mod program_run;

use std::fs;
use std::path::Path;
use std::process::Output;

use program_run::{Folder, assert_success, json, palpus, text};
use serde_json::Value;

/// A cube of side 2 about the origin.
const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn every_command_explains_itself_with_an_example() {
    let folder = Folder::new("help");
    for command in [
        &["--help"][..],
        &["run", "--help"],
        &["query", "--help"],
        &["depth", "--help"],
        &["clearance", "--help"],
        &["prepare", "--help"],
        &["inspect", "--help"],
        &["view", "--help"],
        &["replay", "--help"],
        &["bench", "figures", "--help"],
        &["bench", "step", "--help"],
        &["bench", "depth", "--help"],
        &["bench", "feel", "--help"],
        &["completions", "--help"],
    ] {
        let output = palpus(&folder.0, command);
        assert!(output.status.success(), "{command:?}");
        let help = text(&output.stdout);
        assert!(help.contains("Example") && help.contains("palpus "), "{command:?} has no example:\n{help}");
    }
}

#[test]
fn depth_is_bounded_and_containment_is_reported() {
    let folder = Folder::new("depth");
    fs::write(folder.0.join("cube.obj"), CUBE).expect("the file can be written");
    let small: String = CUBE.lines().take(8).map(|line| line.replace('1', "0.25") + "\n").collect();
    let faces = &CUBE[CUBE.find('f').expect("the mesh has faces")..];
    fs::write(folder.0.join("small.obj"), small + faces).expect("the file can be written");
    fs::write(folder.0.join("open.obj"), &CUBE[..CUBE.rfind('f').expect("the mesh has a last face")])
        .expect("the file can be written");
    let poses = "tx,ty,tz,qx,qy,qz,qw\n1.5,0,0,0,0,0,1\n0,0,0.5,0,0,0,1\n2,0,0,0,0,0,1\n";
    fs::write(folder.0.join("poses.csv"), poses).expect("the file can be written");
    let run = |a: &str, more: &[&str]| {
        let line = [&["depth", a, "cube.obj", "--poses", "poses.csv", "--out", "out.csv"], more].concat();
        let output = palpus(&folder.0, &line);
        assert_success(&output);
        let rows = fs::read_to_string(folder.0.join("out.csv")).expect("the result can be read");
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        (output, rows.lines().skip(1).map(cells).collect::<Vec<_>>())
    };
    let (output, rows) = run("small.obj", &["--json"]);
    assert_eq!(json(&output)["contained"], 1);
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().expect("the cell is a number");
    // In the first pose, the cubes are apart by 0.25. In the second pose, the small cube is inside:
    // it is half a unit from the top, plus a quarter for its own size. In the third pose, the cubes
    // are apart by 0.75.
    for (row, depth, contained) in [(0, 0.0, "0"), (1, 0.75, "1"), (2, 0.0, "0")] {
        assert!((number(row, 1) - depth).abs() < 1e-6 && (number(row, 2) - depth).abs() < 1e-6, "{rows:?}");
        assert_eq!(rows[row][7], contained);
    }
    assert!((number(0, 8) - 0.25).abs() < 1e-12);
    let (output, _) = run("open.obj", &["--gap", "0.1mm"]);
    assert!(text(&output.stderr).contains("open boundary"), "{}", text(&output.stderr));
    let output = palpus(&folder.0, &["query", "small.obj", "cube.obj", "--poses", "poses.csv", "--out", "q.csv"]);
    assert_success(&output);
    let rows = fs::read_to_string(folder.0.join("q.csv")).expect("the result can be read");
    let contained: Vec<&str> = rows.lines().skip(1).filter_map(|line| line.rsplit(',').next()).collect();
    assert_eq!(contained, ["0", "1", "0"]);
}

#[test]
fn clearance_lists_and_pictures_the_tightest_places() {
    let folder = Folder::new("clearance");
    fs::write(folder.0.join("cube.obj"), CUBE).expect("the file can be written");
    let poses =
        "tx,ty,tz,qx,qy,qz,qw\n3,0,0,0,0,0,1\n2.5,0,0,0,0,0,1\n3,0,0,0,0,0,1\n1.5,0,0,0,0,0,1\n1.75,0,0,0,0,0,1\n";
    fs::write(folder.0.join("poses.csv"), poses).expect("the file can be written");
    let line = ["clearance", "cube.obj", "cube.obj", "--poses", "poses.csv", "--html", "page.html", "--json"];
    let output = palpus(&folder.0, &line);
    assert_success(&output);
    let answer = json(&output);
    assert_eq!((&answer["free"], &answer["overlapping"]), (&3.into(), &2.into()));
    for (place, frame, clearance) in [(0, 3, -0.5), (1, 1, 0.5)] {
        let place = &answer["tightest"][place];
        assert_eq!(place["frame"], frame);
        assert!((place["clearance"].as_f64().expect("the cell is a number") - clearance).abs() < 1e-6, "{place}");
    }
    let page = fs::read_to_string(folder.0.join("page.html")).expect("the page can be read");
    assert_eq!(page.matches("<figcaption>A: frame 3").count(), 1);
    assert!(page.contains("data:image/png;base64,"));
}

#[test]
fn wrong_use_is_2_and_failure_is_1_with_one_error() {
    let folder = Folder::new("errors");
    assert_eq!(palpus(&folder.0, &["run", "--speed", "3"]).status.code(), Some(2));
    for (arguments, word) in [
        (&["inspect", "nowhere.obj"][..], "nowhere.obj"),
        (&["run", "teapot"], "spoon-cup"),
        (&["run", "--hand", "strong", "--no-record"], "firm"),
        (&["run", "--device", "falcon", "--no-record"], "sim"),
        (&["run", "--rate", "0", "--no-record"], "rate"),
        (&["replay", "nothing.csv"], "nothing.csv"),
    ] {
        let output = palpus(&folder.0, arguments);
        let error = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        assert_eq!(error.matches("error:").count(), 1, "{arguments:?}: {error}");
        assert!(error.contains(word), "{arguments:?} does not mention `{word}`: {error}");
    }
}

#[test]
fn query_results_are_in_the_frame_of_b() {
    let folder = Folder::new("query");
    folder.file("cube.obj", CUBE);
    // In the first pose, the cubes are apart by 1 along x. In the second pose, they overlap by 0.5
    // along z. In the third pose, one cube is turned by 90°, and they are apart by 3.
    let poses =
        "tx,ty,tz,qx,qy,qz,qw\n3,0,0,0,0,0,1\n0,0,1.5,0,0,0,1\n0,5,0,0,0,0.7071067811865476,0.7071067811865476\n";
    folder.file("poses.csv", poses);
    let arguments =
        ["query", "cube.obj", "cube.obj", "--poses", "poses.csv", "--out", "out.csv", "--contacts", "all.csv"];
    let output = palpus(&folder.0, &arguments);
    assert_success(&output);
    let result = fs::read_to_string(folder.0.join("out.csv")).expect("the result can be read");
    let rows: Vec<Vec<f64>> = result
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    let expected = [(1.0, [1.0, 0.0, 0.0], 0.0), (-0.5, [0.0, 0.0, 1.0], 1.0), (3.0, [0.0, 1.0, 0.0], 0.0)];
    assert_eq!(rows.len(), expected.len());
    for (row, (separation, normal, contacts)) in rows.iter().zip(expected) {
        assert!((row[1] - separation).abs() < 1e-12, "{row:?}");
        for k in 0..3 {
            assert!((row[2 + k] - normal[k]).abs() < 1e-12, "{row:?}");
            assert!((row[5 + k] - row[8 + k] - separation * normal[k]).abs() < 1e-12, "{row:?}");
        }
        assert!((row[11] - contacts).abs() < 0.5, "{row:?}");
    }
    let contacts = fs::read_to_string(folder.0.join("all.csv")).expect("the contacts can be read");
    assert_eq!(contacts.lines().count(), 2, "the file must have a header and one contact:\n{contacts}");
}

#[test]
fn inspect_and_prepare_describe_a_cube() {
    let folder = Folder::new("inspect");
    folder.file("cube.obj", CUBE);
    let report = json(&palpus(&folder.0, &["inspect", "cube.obj", "--json"]));
    assert_eq!(report["triangles"], 12);
    assert_eq!(report["closed"], true);
    assert_eq!(report["pieces"]["count"], 1);
    assert!((report["mass"]["volume"].as_f64().unwrap_or(0.0) - 8.0).abs() < 1e-12);
    assert!(palpus(&folder.0, &["prepare", "cube.obj", "--pieces", "pieces.obj"]).status.success());
    let pieces = json(&palpus(&folder.0, &["inspect", "pieces.obj", "--json"]));
    assert!((pieces["mass"]["volume"].as_f64().unwrap_or(0.0) - 8.0).abs() < 1e-12);
}

#[test]
fn run_is_summarised_recorded_and_replayed_bit_for_bit() {
    let folder = Folder::new("run");
    let arguments = ["run", "box-table", "--fast", "--duration", "3", "--record", "run.csv", "--json"];
    let summary = json(&palpus(&folder.0, &arguments));
    for key in [
        "ticks",
        "duration_s",
        "rate_hz",
        "overruns",
        "step_us",
        "query_us",
        "force_us",
        "contacts",
        "clusters",
        "depth_max_m",
        "tool_away_max_m",
        "tool_turned_max_rad",
        "force_max_n",
        "torque_max_nm",
        "force_step_max_n",
        "torque_step_max_nm",
        "saturated_ticks",
        "faults",
        "energy_generated_j",
        "allocations",
    ] {
        assert!(!summary[key].is_null(), "the summary lacks {key}");
    }
    assert_eq!(summary["ticks"], 3000);
    assert_eq!(summary["faults"], 0);
    assert_eq!(summary["allocations"], 0, "the loop must not allocate");
    assert!(summary["force_max_n"].as_f64().unwrap_or(0.0) > 0.1, "there must be a force");
    let replay = json(&palpus(&folder.0, &["replay", "run.csv", "--json"]));
    assert_eq!(replay["identical"], 3000);

    // A run with the recording as its device has the same number of ticks and gives identical
    // wrenches.
    let arguments = ["run", "box-table", "--fast", "--device", "replay:run.csv", "--record", "again.csv", "--json"];
    assert_eq!(json(&palpus(&folder.0, &arguments))["ticks"], 3000);
    let replay = json(&palpus(&folder.0, &["replay", "again.csv", "--json"]));
    assert_eq!(replay["identical"], 3000);
}

#[test]
fn changed_recording_shows_its_first_divergence() {
    let folder = Folder::new("divergence");
    let arguments = ["run", "box-table", "--fast", "--duration", "1", "--record", "run.csv", "--json"];
    assert!(palpus(&folder.0, &arguments).status.success());
    let recording = fs::read_to_string(folder.0.join("run.csv")).expect("the recording can be read");
    let first = recording.lines().position(|line| line.starts_with("tick,")).expect("the recording has a header line");
    let names: Vec<&str> = recording.lines().nth(first).expect("the header line exists").split(',').collect();
    let column = names.iter().position(|name| *name == "force_z").expect("the recording has a force column");
    let changed: Vec<String> = recording
        .lines()
        .enumerate()
        .map(|(k, line)| {
            if k != first + 1 + 700 {
                return line.to_owned();
            }
            let mut cells: Vec<&str> = line.split(',').collect();
            cells[column] = "123.5";
            cells.join(",")
        })
        .collect();
    folder.file("changed.csv", &(changed.join("\n") + "\n"));
    let output = palpus(&folder.0, &["replay", "changed.csv"]);
    assert_eq!(output.status.code(), Some(1));
    let printed = text(&output.stdout);
    assert!(printed.contains("1 of 1000 wrenches differ; the first is tick 700"), "{printed}");
    assert!(printed.contains("123.5"), "{printed}");
}

#[test]
fn heavy_pair_is_reported_before_the_run() {
    let folder = Folder::new("heavy");
    for (scene, is_heavy) in [("gears", true), ("torus-torus", false)] {
        assert_success(&palpus(&folder.0, &["export", scene, scene]));
        let file = folder.0.join(scene).join("scene.toml");
        // Time budget of a step, µs. Any contact needs more time, so each step handles only one
        // patch.
        let text = fs::read_to_string(&file)
            .expect("the scene can be read")
            .replace("[contact]", "[contact]\ntime_budget = 1");
        fs::write(&file, text).expect("the scene can be written");
        let file = file.to_str().expect("the path is valid UTF-8");
        let run = palpus(&folder.0, &["run", file, "--headless", "--no-realtime", "--duration", "0.01", "--lenient"]);
        let said = String::from_utf8_lossy(&run.stderr).into_owned() + &String::from_utf8_lossy(&run.stdout);
        assert_eq!(said.contains("note: this pair is heavy for this machine"), is_heavy, "{scene}: {said}");
    }
}

#[test]
fn scene_file_uses_its_own_meshes() {
    let folder = Folder::new("scene");
    folder.file("cube.obj", CUBE);
    let scene = "unit = \"cm\"\n[probe]\nmesh = \"cube.obj\"\nposition = [0, 0, 4]\n[environment]\nmesh = \"cube.obj\"\n\
        [contact]\ntolerance = 0.1\ncluster_radius = 0.4\nstiffness = 500\n[coupling]\nmode = \"direct\"\n";
    folder.file("two-cubes.toml", scene);
    let arguments = ["run", "two-cubes.toml", "--fast", "--duration", "4", "--record", "run.csv", "--json"];
    let output = palpus(&folder.0, &arguments);
    let summary = json(&output);
    assert!(summary["contacts"]["max"].as_u64().unwrap_or(0) >= 1, "{summary}");
    assert!(summary["force_max_n"].as_f64().unwrap_or(0.0) > 0.0, "{summary}");
    assert_eq!(json(&palpus(&folder.0, &["replay", "run.csv", "--json"]))["identical"], 4000);
    folder.file("typo.toml", &scene.replace("tolerance", "tolerence"));
    let error = text(&palpus(&folder.0, &["run", "typo.toml"]).stderr);
    assert!(error.contains("tolerance") && error.contains("line"), "{error}");
}

#[test]
fn figures_are_written_as_pictures_and_numbers() {
    let folder = Folder::new("figures");
    for bench in ["figures", "depth"] {
        let output = palpus(&folder.0, &["bench", bench, "--out", "figures"]);
        assert_success(&output);
    }
    for name in
        ["depth_witness.svg", "table1.txt", "table1.json", "figure5.svg", "figure5.csv", "figure6.svg", "figure6.csv"]
    {
        let length = fs::metadata(folder.0.join("figures").join(name)).map(|m| m.len()).unwrap_or(0);
        assert!(length > 500, "{name} has {length} bytes");
    }
    let table: Value =
        serde_json::from_slice(&fs::read(folder.0.join("figures/table1.json")).expect("the table can be read"))
            .expect("the JSON is valid");
    let pieces = |model: &str| {
        let rows = table.as_array().into_iter().flatten();
        rows.filter(|row| row["model"] == model).filter_map(|row| row["pieces"].as_u64()).max().unwrap_or(u64::MAX)
    };
    // The limits are the numbers of pieces in the paper's Table 1. The meshes come from the
    // built-in scenes.
    for (model, most) in [("torus", 67), ("cup", 190), ("spoon", 78), ("intestine", 9913)] {
        assert!(pieces(model) <= most, "{model}: {} pieces, the paper has {most}", pieces(model));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn body_is_cached_and_prepared_again_if_damaged() {
    let folder = Folder::new("kept");
    folder.file("cube.obj", CUBE);
    let prepare = |more: &[&str]| palpus(&folder.0, &[&["prepare", "cube.obj", "--json"], more].concat());
    let is_cached = |output: &Output| json(output)[0]["cached"].as_bool().expect("the value is a boolean");
    assert!(!is_cached(&prepare(&["--no-cache"])));
    assert!(!is_cached(&prepare(&[])));
    assert!(is_cached(&prepare(&[])));
    let kept: Vec<_> = fs::read_dir(folder.0.join("cache/palpus/bodies")).expect("the cache folder exists").collect();
    assert_eq!(kept.len(), 1);
    let path = kept[0].as_ref().expect("the entry can be read").path();
    let mut bytes = fs::read(&path).expect("the cached body can be read");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&path, bytes).expect("the cached body can be written");
    let again = prepare(&[]);
    assert!(!is_cached(&again));
    assert!(text(&again.stderr).contains("damaged"), "{}", text(&again.stderr));
    assert!(is_cached(&prepare(&[])));
    // Other file content is another body, which is not in the cache.
    folder.file("cube.obj", &CUBE.replace("v -1 -1 -1", "v -1 -1 -1.5"));
    assert!(!is_cached(&prepare(&[])));
}

#[test]
fn feel_of_a_scene_is_measured_reproducibly() {
    let folder = Folder::new("feel");
    let measure = |out: &str| {
        let arguments = ["bench", "feel", "--scene", "box-rest", "--method", "smooth", "--quick", "--out", out];
        let output = palpus(&folder.0, &arguments);
        assert_success(&output);
        ["feel.csv", "feel.json", "feel.md", "feel.html"]
            .map(|name| fs::read_to_string(folder.0.join(out).join(name)).expect("every file is written"))
    };
    let first = measure("one");
    assert!(first == measure("two"), "the numbers must be the same in both runs");
    let document: Value = serde_json::from_str(&first[1]).expect("the JSON is valid");
    let rows = document["rows"].as_array().expect("the rows are a list");
    let value = |hand: &str, measure: &str| {
        let is_it = |row: &&Value| row["hand"] == hand && row["measure"] == measure;
        rows.iter().find(is_it).and_then(|row| row["value"].as_f64()).unwrap_or_else(|| panic!("no {measure}"))
    };
    // The force on a box that lies flat must point upward and be proportional to its depth.
    assert!(value("", "direction error max") < 1e-3);
    assert!(value("", "size error max") < 1e-6);
    assert!((value("", "felt stiffness") - 800.0).abs() < 1e-3);
    assert!(value("normal", "deepest in the loop") < 2e-3);
    assert!(first[3].contains("<svg") && first[2].contains("| smooth |"));
    let wrong = palpus(&folder.0, &["bench", "feel", "--scene", "box-rset", "--out", "no"]);
    assert!(!wrong.status.success() && text(&wrong.stderr).contains("box-rest"));
}

/// Returns width and height of a PNG file.
fn png_size(path: &Path) -> [u32; 2] {
    let bytes = fs::read(path).expect("the picture can be read");
    assert_eq!(bytes[..8], [137, 80, 78, 71, 13, 10, 26, 10], "{}", path.display());
    assert!(bytes.len() > 1000, "{} is almost empty", path.display());
    [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("the slice has four bytes")))
}

#[test]
fn pictures_need_no_display_and_are_reproducible() {
    let folder = Folder::new("pictures");
    folder.file("cube.obj", CUBE);
    let shot = |arguments: &[&str], name: &str| {
        let output = palpus(&folder.0, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains(name), "{arguments:?} does not print the path of the picture");
        folder.0.join(name)
    };
    let view = &["view", "cube.obj", "--screenshot", "cube.png", "--size", "400x300", "--exploded"];
    let first = fs::read(shot(view, "cube.png")).expect("the picture can be read");
    assert_eq!(png_size(&folder.0.join("cube.png")), [400, 300]);
    assert_eq!(first, fs::read(shot(view, "cube.png")).expect("the picture can be read"));
    assert_eq!(png_size(&shot(&["inspect", "cube.obj", "--picture", "seen/cube.png"], "seen/cube.png")), [1280, 800]);

    let square = ["view", "cube.obj", "--size", "240x160"];
    let gauss = fs::read(shot(&[&square[..], &["--gauss", "--screenshot", "gauss.png"]].concat(), "gauss.png"));
    let depth = ["--depth", "--axis", "z", "--offset", "-0.5", "--fineness", "24", "--screenshot", "depth.png"];
    let depth = fs::read(shot(&[&square[..], &depth].concat(), "depth.png"));
    assert_ne!(gauss.expect("the picture can be read"), depth.expect("the picture can be read"));

    let run = |at: &str, name: &str| {
        let common = ["run", "pen-sphere", "--fast", "--no-record", "--duration", "0.3", "--size", "200x150"];
        fs::read(shot(&[&common[..], &["--at", at, "--screenshot", name, "--no-words"]].concat(), name))
            .expect("the picture can be read")
    };
    assert_eq!(run("0.1", "one.png"), run("0.1", "two.png"));
    assert_ne!(run("0.1", "one.png"), run("0.25", "later.png"));
}

#[test]
fn picture_of_a_replayed_tick_equals_the_run() {
    let folder = Folder::new("replayed-picture");
    let same = ["--size", "200x150", "--no-words"];
    let run = ["run", "pen-sphere", "--fast", "--duration", "0.3", "--record", "run.csv", "--at", "0.2"];
    assert!(palpus(&folder.0, &[&run[..], &["--screenshot", "run.png"], &same].concat()).status.success());
    let replay = ["replay", "run.csv", "--at", "0.2", "--screenshot", "replay.png"];
    let output = palpus(&folder.0, &[&replay[..], &same].concat());
    assert_success(&output);
    let [first, second] =
        ["run.png", "replay.png"].map(|name| fs::read(folder.0.join(name)).expect("the picture can be read"));
    assert_eq!(first, second);
    for (arguments, code, word) in [
        (&["replay", "run.csv", "--view"][..], 1, "--screenshot"),
        (&["replay", "run.csv", "--at", "0.1"], 2, "--view"),
        (&["replay", "run.csv", "--at", "7", "--screenshot", "no.png"], 1, "0.299 s"),
        (&["replay", "run.csv", "--view", "--json"], 2, "--json"),
    ] {
        let output = palpus(&folder.0, arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains(word), "{arguments:?}: {}", text(&output.stderr));
    }
}

#[test]
fn impossible_pictures_are_refused() {
    let folder = Folder::new("no-pictures");
    folder.file("cube.obj", CUBE);
    let run = ["run", "pen-sphere", "--fast", "--no-record", "--duration", "0.1", "--screenshot", "p.png"];
    for (arguments, code, word) in [
        (&["view", "cube.obj"][..], 1, "--screenshot"),
        (&["view", "cube.obj", "--gauss", "7", "--screenshot", "p.png"], 1, "--gauss 7"),
        (&["view", "cube.obj", "--depth", "--offset", "3", "--screenshot", "p.png"], 1, "from -1 to 1"),
        (&["view", "cube.obj", "--depth", "--gauss", "--screenshot", "p.png"], 2, "--gauss"),
        (&["view", "cube.obj", "--screenshot", "p.png", "--size", "9x99999"], 2, "1280x800"),
        (&["view", "cube.obj", "--screenshot", "p.png", "--zoom", "0"], 1, "--zoom"),
        (&["run", "--at", "1"], 2, "--screenshot"),
        (&[&run[..], &["--at", "0.5"]].concat(), 1, "--duration"),
    ] {
        let output = palpus(&folder.0, arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains(word), "{arguments:?}: {}", text(&output.stderr));
    }
}
