//! The window as its user meets it, on a display in memory (Xvfb).
#![cfg(all(feature = "window", target_os = "linux"))]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// A display whose pixels are a file; gone when the test is over.
struct Display {
    server: Child,
    name: String,
    folder: PathBuf,
}

impl Display {
    fn open() -> Self {
        static DISPLAYS: AtomicU32 = AtomicU32::new(0);
        let number = DISPLAYS.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("palpus-window-{}-{number}", std::process::id()));
        fs::create_dir_all(&folder).expect("a temporary folder");
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1300x900x24", "-fbdir"])
            .arg(&folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb is installed");
        let mut number = String::new();
        let said = server.stdout.take().expect("piped");
        BufReader::new(said).read_line(&mut number).expect("Xvfb says its number");
        Self { server, name: format!(":{}", number.trim()), folder }
    }

    /// Red, green and blue of every pixel, out of the file's format (XWD: a header of 32-bit numbers, colours, rows).
    fn pixels(&self) -> Vec<[u8; 3]> {
        let file = fs::read(self.folder.join("Xvfb_screen0")).expect("the screen");
        let number = |k: usize| u32::from_be_bytes(file[4 * k..4 * k + 4].try_into().expect("four bytes")) as usize;
        let (header, width, height, row, colours) = (number(0), number(4), number(5), number(12), number(19));
        let first = header + 12 * colours;
        let pixel = |x: usize, y: usize| first + y * row + 4 * x;
        let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        all.map(|(x, y)| [2, 1, 0].map(|part| file[pixel(x, y) + part])).collect()
    }

    /// Moves the mouse or presses a key, as a hand would.
    fn drive(&self, arguments: &[&str]) {
        let status = Command::new("xdotool").args(arguments).env("DISPLAY", &self.name).status();
        assert!(status.expect("xdotool is installed").success(), "xdotool {arguments:?}");
        std::thread::sleep(Duration::from_millis(60));
    }

    fn mouse_to(&self, [x, y]: [usize; 2]) {
        self.drive(&["mousemove", &x.to_string(), &y.to_string()]);
    }

    /// Presses the mouse at `from`, moves it by `by` in so many steps, and keeps it pressed.
    fn drag(&self, from: [usize; 2], by: [i32; 2], steps: i32) {
        self.mouse_to(from);
        self.drive(&["mousedown", "1"]);
        for k in 1..=steps {
            self.mouse_to([0, 1].map(|axis| (from[axis] as i32 + by[axis] * k / steps).max(0) as usize));
        }
    }

    /// The pixels of the scene's part of the window that are like the spoon.
    fn spoon(&self) -> Vec<[usize; 2]> {
        let pixels = self.pixels();
        let scene = (0..pixels.len()).map(|k| [k % WIDTH, k / WIDTH]).filter(|place| SCENE.contains(place));
        scene.filter(|[x, y]| orange(&pixels[y * WIDTH + x..][..1]) > 0).collect()
    }

    /// Waits until the scene is shown.
    fn wait(&self) {
        let patience = Instant::now() + Duration::from_secs(60);
        while self.spoon().len() < 300 {
            assert!(Instant::now() < patience, "no spoon is shown");
            std::thread::sleep(Duration::from_millis(200));
        }
        // Nobody manages the windows of this display: keys go to whom they are given.
        self.drive(&["search", "--name", "palpus", "windowfocus"]);
    }
}

/// Pixels of the display.
const WIDTH: usize = 1300;

/// Where the window shows the scene, without its legend.
struct Part {
    low: [usize; 2],
    high: [usize; 2],
}

const SCENE: Part = Part { low: [210, 80], high: [940, 670] };

impl Part {
    fn contains(&self, place: &[usize; 2]) -> bool {
        (0..2).all(|axis| (self.low[axis]..self.high[axis]).contains(&place[axis]))
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

fn palpus(folder: &Path, display: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpus"));
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.join("cache")).args(arguments);
    command.env("DISPLAY", display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command
}

/// How many pixels are the spoon's, or lit by the same lamps: much red, less green, little blue.
fn orange(pixels: &[[u8; 3]]) -> usize {
    let parts = pixels.iter().map(|pixel| pixel.map(i32::from));
    parts.filter(|[r, g, b]| *r > 120 && *r > g + 30 && *g > b + 25).count()
}

#[test]
#[ignore = "needs Xvfb and Mesa (apt-get install xvfb libgl1-mesa-dri libxkbcommon-x11-0 libxcursor1 libxi6)"]
fn the_window_shows_the_run_and_goes_with_it() {
    let display = Display::open();
    let arguments = ["run", "spoon-cup", "--duration", "6", "--no-record", "--no-realtime"];
    let mut run = palpus(&display.folder, &display.name, &arguments).stderr(Stdio::piped()).spawn().expect("it starts");
    let patience = Instant::now() + Duration::from_secs(60);
    let mut most = 0;
    let status = loop {
        if let Some(status) = run.try_wait().expect("it is ours") {
            break status;
        }
        assert!(Instant::now() < patience, "the window does not go with the run");
        std::thread::sleep(Duration::from_millis(200));
        most = most.max(orange(&display.pixels()));
    };
    assert!(status.success());
    assert!(most > 1000, "no spoon was seen, {most} pixels");
}

#[test]
#[ignore = "runs for ten seconds"]
fn a_display_that_is_not_there_is_a_line_and_a_run_without_it() {
    let folder = std::env::temp_dir();
    let arguments = ["run", "spoon-cup", "--no-record", "--no-realtime"];
    let output = palpus(&folder, ":4711", &arguments).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("no window could be opened here"), "{said}");
}

/// A run in a window, ended when the test is over.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The only recording in the folder: its lines.
fn recorded(folder: &Path) -> Vec<String> {
    let files: Vec<PathBuf> = fs::read_dir(folder.join("palpus-out"))
        .expect("a recording was begun")
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "csv"))
        .collect();
    assert_eq!(files.len(), 1, "{files:?}");
    fs::read_to_string(&files[0]).expect("it is text").lines().map(str::to_owned).collect()
}

/// The size of the force in every tick, N.
fn forces(lines: &[String]) -> Vec<f64> {
    let names = lines.iter().find(|line| line.starts_with("tick,")).expect("names of columns");
    let of = |name: &str| names.split(',').position(|column| column == name).expect("a column");
    let columns = ["force_x", "force_y", "force_z"].map(of);
    let rows = lines.iter().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    rows.map(|row| {
        let cells: Vec<&str> = row.split(',').collect();
        columns.map(|column| cells[column].parse::<f64>().expect("a number")).iter().map(|f| f * f).sum::<f64>().sqrt()
    })
    .collect()
}

/// The spoon is taken by the mouse and pressed onto the bottom of the cup; meanwhile a recording is written, and a picture; then a slider is
/// moved. All of it must be in the files, and a contact and its arrows on the screen.
#[test]
#[ignore = "needs Xvfb, Mesa and xdotool"]
fn the_probe_is_dragged_into_contact_and_sliders_act() {
    let display = Display::open();
    let arguments = ["run", "spoon-cup", "--no-record", "--no-realtime"];
    let mut command = palpus(&display.folder, &display.name, &arguments);
    let _run = Running(command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().expect("it starts"));
    display.wait();
    display.mouse_to([600, 120]);
    // From the front; a recording.
    display.drive(&["key", "1"]);
    display.drive(&["key", "e"]);
    std::thread::sleep(Duration::from_millis(1500));
    // It is taken while it stands, so that a slow machine does not miss it.
    display.drive(&["key", "space"]);
    std::thread::sleep(Duration::from_millis(700));
    let spoon = display.spoon();
    // Its lowest part is behind the cup's wall; the handle is taken.
    let top = spoon.iter().map(|[_, y]| *y).min().expect("a spoon");
    let mut handle: Vec<_> = spoon.iter().filter(|[_, y]| *y == top + 30).copied().collect();
    handle.sort_unstable();
    let middle = handle[handle.len() / 2];
    display.drag(middle, [0, 2], 2);
    display.drive(&["key", "space"]);
    for k in 1..=12 {
        display.mouse_to([middle[0], middle[1] + 2 + k * 258 / 12]);
    }
    std::thread::sleep(Duration::from_millis(1500));
    let pixels = display.pixels();
    display.drive(&["key", "s"]);
    display.drive(&["mouseup", "1"]);
    // The first slider: stiffness.
    display.drag([1132, 374], [-40, 0], 4);
    display.drive(&["mouseup", "1"]);
    std::thread::sleep(Duration::from_millis(500));
    display.drive(&["key", "e"]);
    std::thread::sleep(Duration::from_millis(1000));

    let lines = recorded(&display.folder);
    let forces = forces(&lines);
    let (before, after) = forces.split_at(1000);
    let most = |forces: &[f64]| forces.iter().copied().fold(0.0, f64::max);
    assert!(most(after) > 1.0 && most(after) > 2.0 * most(before), "{} N, then {} N", most(before), most(after));
    assert!(lines.iter().any(|line| line.starts_with("# change")), "the slider changed nothing");
    let picture = fs::read(display.folder.join("palpus-out/window-1.png")).expect("a picture was written");
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 20_000, "{} bytes", picture.len());
    // Arrows of clusters are violet, those of the hand's force blue.
    let arrows = (0..pixels.len()).filter(|k| SCENE.contains(&[k % WIDTH, k / WIDTH])).filter(|k| {
        let [r, g, b] = pixels[*k].map(i32::from);
        b > 180 && b > g + 50 && b > r + 25
    });
    assert!(arrows.count() > 60, "no arrows are shown");
}
