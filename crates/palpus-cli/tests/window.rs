//! The window as its user meets it, on a display in memory (Xvfb).
#![cfg(all(feature = "window", target_os = "linux"))]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A display whose pixels are a file; gone when the test is over.
struct Display {
    server: Child,
    name: String,
    folder: PathBuf,
}

impl Display {
    fn open() -> Self {
        let folder = std::env::temp_dir().join(format!("palpus-window-{}", std::process::id()));
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
