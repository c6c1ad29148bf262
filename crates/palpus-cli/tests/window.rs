//! Tests of the window, on a virtual display (Xvfb).
#![cfg(all(feature = "window", target_os = "linux"))]

mod display;

use std::fs;
use std::panic::{RefUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use display::{Display, Part, WHOLE, orange, palpus};

/// The part of the window that shows the scene, without its legend.
const SCENE: Part = Part { low: [210, 80], high: [940, 670] };

/// The same part without the axes of the world.
const ARROWS: Part = Part { low: SCENE.low, high: [840, 560] };

/// Sends an input of the mouse or keyboard, then waits a moment.
fn drive(display: &Display, words: &str) {
    display.input(words);
    std::thread::sleep(Duration::from_millis(60));
}

fn mouse_to(display: &Display, [x, y]: [usize; 2]) {
    drive(display, &format!("mousemove {x} {y}"));
}

/// Presses the mouse at `from`, moves it by `by` in `steps` steps, and keeps it pressed.
fn drag(display: &Display, from: [usize; 2], by: [i32; 2], steps: i32) {
    mouse_to(display, from);
    drive(display, "mousedown 1");
    for k in 1..=steps {
        mouse_to(display, [0, 1].map(|axis| (from[axis] as i32 + by[axis] * k / steps).max(0) as usize));
    }
}

#[test]
#[ignore = "needs Xvfb and Mesa (apt-get install xvfb libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6)"]
fn window_shows_the_run_and_closes_with_it() {
    let display = Display::open("run");
    // This test does not check whether the machine holds the rate while the processor draws the
    // window.
    let arguments = ["run", "spoon-cup", "--duration", "6", "--no-record", "--no-realtime", "--lenient"];
    let mut run = display.palpus(&arguments).stderr(Stdio::piped()).spawn().expect("the program starts");
    let patience = Instant::now() + Duration::from_secs(60);
    let mut most = 0;
    let status = loop {
        if let Some(status) = run.try_wait().expect("the child can be waited for") {
            break status;
        }
        assert!(Instant::now() < patience, "the window must close at the end of the run");
        std::thread::sleep(Duration::from_millis(200));
        most = most.max(display.seen(&WHOLE, orange).len());
    };
    assert!(status.success());
    assert!(most > 1000, "the spoon must be visible, but only {most} pixels were seen");
}

#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn two_tools_are_shown_steered_and_replayed() {
    let display = Display::open("two-hands");
    let mut run = display
        .palpus(&["run", "two-hands", "--duration", "12", "--no-realtime", "--lenient"])
        .spawn()
        .expect("the program starts");
    display.wait_for("peg and block", 300, &SCENE, orange);
    display.focus();
    mouse_to(&display, [600, 120]);
    std::thread::sleep(Duration::from_millis(1500));
    // Switches friction off, then selects the paper's coupling.
    drive(&display, "key i");
    std::thread::sleep(Duration::from_millis(300));
    drive(&display, "key d");
    assert!(run.wait().expect("the child can be waited for").success());
    for file in ["palpus-out/run.csv", "palpus-out/run-second.csv"] {
        let lines = fs::read_to_string(display.folder.join(file)).expect("the recording can be read");
        assert!(lines.lines().filter(|line| line.starts_with("# change")).count() >= 2, "{file}");
        let replay = display.palpus(&["replay", file]).output().expect("the program starts");
        assert!(replay.status.success(), "{file}: {}", String::from_utf8_lossy(&replay.stdout));
    }
}

#[test]
#[ignore = "runs for ten seconds"]
fn missing_display_is_reported_and_run_continues() {
    let folder = std::env::temp_dir();
    let arguments = ["run", "spoon-cup", "--no-record", "--no-realtime", "--lenient"];
    let output = palpus(&folder, ":4711", &arguments).output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("no window could be opened here"), "{said}");
}

/// Returns the lines of the only recording in the folder.
fn recorded(folder: &Path) -> Vec<String> {
    let files: Vec<PathBuf> = fs::read_dir(folder.join("palpus-out"))
        .expect("a recording was started")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "csv"))
        .collect();
    assert_eq!(files.len(), 1, "{files:?}");
    fs::read_to_string(&files[0]).expect("the recording is text").lines().map(str::to_owned).collect()
}

/// Returns the size of the force in every tick, N.
fn forces(lines: &[String]) -> Vec<f64> {
    let names = lines.iter().find(|line| line.starts_with("tick,")).expect("the recording names its columns");
    let of = |name: &str| names.split(',').position(|column| column == name).expect("the column exists");
    let columns = ["force_x", "force_y", "force_z"].map(of);
    let rows = lines.iter().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    rows.map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        columns
            .map(|column| cells[column].parse::<f64>().expect("the cell is a number"))
            .iter()
            .map(|f| f * f)
            .sum::<f64>()
            .sqrt()
    })
    .collect()
}

/// Runs a test up to three times. A busy machine draws only a few pictures per second, so a press
/// and a release of the mouse may fall between two pictures.
fn patiently(test: impl Fn() + RefUnwindSafe) {
    let passed = (0..2).any(|_| catch_unwind(&test).is_ok());
    if !passed {
        test();
    }
}

/// The mouse takes the spoon and presses it onto the bottom of the cup, while a recording and a
/// picture are written. Then a slider is moved. The files must contain these actions, and the
/// screen must show a contact and its arrows.
#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn dragged_probe_makes_contact_and_sliders_act() {
    patiently(|| {
        let display = Display::open("drag");
        let _run = display.show(&["run", "spoon-cup", "--no-record"]);
        display.wait_for("spoon", 300, &SCENE, orange);
        display.focus();
        mouse_to(&display, [600, 120]);
        // Shows the front view and starts a recording.
        drive(&display, "key 1");
        drive(&display, "key e");
        std::thread::sleep(Duration::from_millis(1500));
        // The run is paused while the mouse takes the spoon, so that a slow machine does not miss
        // it.
        drive(&display, "key space");
        std::thread::sleep(Duration::from_millis(700));
        let spoon = display.seen(&SCENE, orange);
        // The lowest part of the spoon is behind the cup's wall, so the mouse takes the handle.
        let top = spoon.iter().map(|[_, y]| *y).min().expect("the spoon is visible");
        let mut handle: Vec<_> = spoon.iter().filter(|[_, y]| *y == top + 30).copied().collect();
        handle.sort_unstable();
        let middle = handle[handle.len() / 2];
        drag(&display, middle, [0, 2], 2);
        drive(&display, "key space");
        for k in 1..=12 {
            mouse_to(&display, [middle[0], middle[1] + 2 + k * 258 / 12]);
        }
        std::thread::sleep(Duration::from_millis(1500));
        // Arrows of clusters are violet, arrows of the force on the hand are blue.
        let arrows = display.seen(&ARROWS, |[r, g, b]| b > 180 && b > g + 50 && b > r + 25);
        drive(&display, "key s");
        drive(&display, "mouseup 1");
        // The first slider sets the stiffness.
        drag(&display, [1132, 374], [-40, 0], 4);
        drive(&display, "mouseup 1");
        std::thread::sleep(Duration::from_millis(500));
        drive(&display, "key e");
        std::thread::sleep(Duration::from_millis(1000));

        let lines = recorded(&display.folder);
        let forces = forces(&lines);
        let (before, after) = forces.split_at(1000);
        let most = |forces: &[f64]| forces.iter().copied().fold(0.0, f64::max);
        assert!(most(after) > 1.0 && most(after) > 2.0 * most(before), "{} N, then {} N", most(before), most(after));
        assert!(lines.iter().any(|line| line.starts_with("# change")), "the slider must change a setting");
        display.wait_for_picture("palpus-out/window-1.png");
        let picture = fs::read(display.folder.join("palpus-out/window-1.png")).expect("the picture can be read");
        assert!(picture.starts_with(b"\x89PNG") && picture.len() > 20_000, "{} bytes", picture.len());
        assert!(arrows.len() > 60, "arrows must be shown");
    });
}

/// The two halves of the scene, and the first chart.
const LEFT: Part = Part { low: [20, 110], high: [460, 660] };
const RIGHT: Part = Part { low: [480, 110], high: [930, 660] };
const FORCE_CHART: Part = Part { low: [12, 722], high: [236, 855] };

/// A key shows the paper's method beside the usual method, with the same hand, and adds its force
/// to the plot. A drag on the plots shows the past while the loop continues.
#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn paper_method_is_shown_beside_and_plots_show_the_past() {
    patiently(|| {
        let display = Display::open("beside");
        let _run = display.show(&["run", "box-table", "--no-record", "--no-realtime", "--lenient"]);
        display.wait_for("box", 300, &SCENE, orange);
        display.focus();
        mouse_to(&display, [600, 120]);
        drive(&display, "key y");
        display.wait_for("box that is felt", 300, &LEFT, orange);
        display.wait_for("box by the paper", 300, &RIGHT, orange);
        display.wait_for("force by the paper", 40, &FORCE_CHART, orange);
        // While the past is shown, the picture stands still. The newest ticks are on the right; the
        // left may still be empty.
        let stands = || {
            drag(&display, [190, 800], [20, 0], 2);
            drive(&display, "mouseup 1");
            std::thread::sleep(Duration::from_millis(500));
            let before = display.seen(&LEFT, orange);
            std::thread::sleep(Duration::from_millis(2500));
            before == display.seen(&LEFT, orange)
        };
        // A busy machine may miss the mouse, or react late to it.
        assert!((0..20).any(|_| stands()), "the picture of the past must stand still");
        drive(&display, "key z");
        drive(&display, "key y");
        display.wait_for("one box alone", 300, &SCENE, orange);
    });
}

/// Waits until a file exists.
fn wait_for_file(file: &Path) {
    let begin = Instant::now();
    while !file.is_file() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no {}", file.display());
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Types two meshes into the dialog and runs them. Then saves the scene; the list of recent files
/// must contain both meshes.
#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn two_meshes_are_opened_together_and_saved() {
    patiently(|| {
        let display = Display::open("open");
        let faces = "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
        let vertices = |side: i32, z: i32| corners.map(|[x, y]| format!("v {} {} {z}\n", x * side, y * side)).concat();
        for (name, side, height) in [("pin.obj", 10, 60), ("plate.obj", 90, 8)] {
            let mesh = vertices(side, 0) + &vertices(side, height) + faces;
            fs::write(display.folder.join(name), mesh).expect("the mesh can be written");
        }
        let run = display.show(&["run", "box-table", "--no-realtime", "--lenient"]);
        display.wait_for("box", 300, &SCENE, orange);
        display.focus();
        mouse_to(&display, [600, 120]);
        drive(&display, "key o");
        std::thread::sleep(Duration::from_millis(1000));
        drive(&display, "type --delay 20 pin.obj");
        std::thread::sleep(Duration::from_millis(2000));
        // Skips the four units of the first mesh.
        for _ in 0..5 {
            drive(&display, "key Tab");
        }
        drive(&display, "type --delay 20 plate.obj");
        std::thread::sleep(Duration::from_millis(2000));
        drive(&display, "key Return");
        let folder = display.folder.join("palpus-out/scenes/pin-plate");
        wait_for_file(&folder.join("scene.toml"));
        wait_for_file(&display.folder.join("state/palpus/recent.txt"));
        let recent = fs::read_to_string(display.folder.join("state/palpus/recent.txt")).expect("the value is a list");
        assert!(recent.contains("pin.obj") && recent.contains("plate.obj"), "{recent}");
        display.wait_for("pin", 100, &SCENE, orange);
        drive(&display, "key F2");
        wait_for_file(&folder.join("scene-2.toml"));
        drop(run);
        let arguments = ["run", "palpus-out/scenes/pin-plate/scene-2.toml", "--headless", "--fast", "--json"];
        let output = display.palpus(&arguments).output().expect("the program starts");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && said.contains("\"no_contact\": null"), "{said}");
    });
}

/// Returns the places of the device's grip (m) in a recording, one for each tick.
fn device_places(display: &Display, file: &str) -> Vec<[f64; 3]> {
    let file = display.folder.join("palpus-out").join(file);
    let text = fs::read_to_string(file).expect("the recording can be read");
    let names = text.lines().find(|line| line.starts_with("tick,")).expect("the recording names its columns");
    let columns = ["device_tx", "device_ty", "device_tz"]
        .map(|name| names.split(',').position(|other| other == name).expect("the column exists"));
    let rows = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    rows.filter_map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        let [x, y, z] = columns.map(|column| cells.get(column).and_then(|cell| cell.parse().ok()));
        Some([x?, y?, z?])
    })
    .collect()
}

/// Returns the distance of two points.
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Returns the largest distance of any of the `places` from the first.
fn travel(places: &[[f64; 3]]) -> f64 {
    places.iter().map(|place| apart(*place, places[0])).fold(0.0, f64::max)
}

/// The script must repeat after its end. It must stop while the mouse holds the probe, and continue
/// some seconds after the mouse has released it.
#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn scene_repeats_until_the_mouse_takes_the_probe() {
    patiently(|| {
        let display = Display::open("repeats");
        let run = display.show(&["run", "box-table", "--no-realtime", "--lenient"]);
        display.wait_for("box", 300, &SCENE, orange);
        display.focus();
        mouse_to(&display, [600, 120]);
        drive(&display, "key 1");
        // The script lasts less than ten seconds.
        std::thread::sleep(Duration::from_secs(16));
        // The run is paused while the mouse takes the box, so that a slow machine does not miss it.
        drive(&display, "key space");
        std::thread::sleep(Duration::from_millis(700));
        let mut seen = display.seen(&SCENE, orange);
        seen.sort_unstable();
        let middle = seen[seen.len() / 2];
        drag(&display, middle, [0, -2], 2);
        drive(&display, "key space");
        for k in 1..=10 {
            mouse_to(&display, [middle[0], middle[1] - 2 - 6 * k]);
        }
        std::thread::sleep(Duration::from_secs(4));
        drive(&display, "mouseup 1");
        std::thread::sleep(Duration::from_secs(9));
        drop(run);
        let places = device_places(&display, "run.csv");
        assert!(travel(&places[10_000..14_000]) > 5e-3, "the script must repeat");
        let still = (14_000..places.len() - 2_000).step_by(100).find(|&k| travel(&places[k..k + 2_000]) < 1e-3);
        let still = still.expect("the script must stop while the mouse holds the box");
        assert!(
            travel(&places[still + 2_000..]) > 5e-3,
            "the script must continue after the mouse has released the box"
        );
    });
}

/// The x handle must move the probe along x only, and a restarted scene must begin at the new
/// place.
#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn handle_moves_the_probe_and_sets_the_start() {
    patiently(|| {
        let display = Display::open("handles");
        let run = display.show(&["run", "box-table", "--no-realtime", "--lenient"]);
        display.wait_for("box", 300, &SCENE, orange);
        display.focus();
        mouse_to(&display, [600, 120]);
        drive(&display, "key space");
        drive(&display, "key F3");
        std::thread::sleep(Duration::from_millis(1500));
        let red = display.seen(&ARROWS, |[r, g, b]| r > 180 && g < 130 && b < 140 && r > g + 90);
        let letter = red.into_iter().max_by_key(|[x, _]| *x).expect("the letter of the red arrow is visible");
        let white = display.seen(&ARROWS, |pixel| pixel.iter().all(|part| *part > 235));
        let pivot = white[white.len() / 2];
        // A point on the arrow, outside the rings. Elsewhere the mouse would turn the view or the
        // probe.
        let way = [0, 1].map(|axis| letter[axis] as f64 - pivot[axis] as f64);
        let shaft = [0, 1].map(|axis| (pivot[axis] as f64 + 0.78 * way[axis]).round() as usize);
        drag(&display, shaft, way.map(|part| (0.8 * part) as i32), 10);
        drive(&display, "mouseup 1");
        drive(&display, "key space");
        std::thread::sleep(Duration::from_millis(2500));
        drive(&display, "key j");
        wait_for_file(&display.folder.join("palpus-out/run-2.csv"));
        std::thread::sleep(Duration::from_millis(2500));
        drop(run);
        let (before, after) = (device_places(&display, "run.csv"), device_places(&display, "run-2.csv"));
        let (first, last) = (before[0], before[before.len() - 1]);
        let way = [0, 1].map(|axis| last[axis] - first[axis]);
        assert!(way[0] > 1e-2 && way[1].abs() < 1e-3, "moved by {way:?}");
        let still = apart(last, before[before.len() - 200]);
        assert!(still < 1e-3, "the probe must rest, but moved {still} m in the last 0.2 s");
        let from = apart(after[0], last);
        assert!(from < 3e-3, "the start is {from} m from the new place");
    });
}

/// Returns the cores that each thread of a process may use, with the thread's name.
fn cores_of_threads(process: u32) -> Vec<(String, String)> {
    let threads = fs::read_dir(format!("/proc/{process}/task")).expect("the process runs");
    let status = threads.filter_map(|thread| fs::read_to_string(thread.ok()?.path().join("status")).ok());
    let line = |status: &str, name: &str| {
        let value = status.lines().find_map(|line| line.strip_prefix(name));
        value.expect("the kernel reports it").trim().to_owned()
    };
    status.map(|status| (line(&status, "Name:"), line(&status, "Cpus_allowed_list:"))).collect()
}

/// Returns true if the loop can get its own core. The loop needs two cores and real-time priority
/// (`CAP_SYS_NICE`, or a limit above 0).
fn may_have_a_core() -> bool {
    let of = |file: &str, name: &str| {
        let text = fs::read_to_string(file).expect("the kernel reports it");
        text.lines().find_map(|line| line.strip_prefix(name)).expect("the file has the line").trim().to_owned()
    };
    let capabilities = u64::from_str_radix(&of("/proc/self/status", "CapEff:"), 16).expect("the cell is a number");
    let limit = of("/proc/self/limits", "Max realtime priority");
    let has_priority = capabilities >> 23 & 1 == 1 || !limit.starts_with('0');
    has_priority && std::thread::available_parallelism().is_ok_and(|cores| cores.get() > 1)
}

#[test]
#[ignore = "needs Xvfb and Mesa; tests little without real-time priority and two cores"]
fn drawing_threads_leave_the_core_of_the_loop() {
    let display = Display::open("cores");
    let run = display.show(&["run", "spoon-cup", "--no-record"]);
    display.wait_for("spoon", 300, &SCENE, orange);
    let threads = cores_of_threads(run.0.id());
    let of = |name: &str| &threads.iter().find(|thread| thread.0.starts_with(name)).expect("the thread exists").1;
    let (core, given) = (of("servo"), &cores_of_threads(std::process::id())[0].1);
    if !may_have_a_core() {
        return;
    }
    assert!(core.parse::<u32>().is_ok(), "the loop must have its own core: {threads:?}");
    assert!(of("palpus") != core && of("llvmpipe") == of("palpus"), "{threads:?}");
    // The watchdog may use all cores of the process. The process got them from this test.
    assert_eq!(of("watchdog"), given, "{threads:?}");
}
