//! A virtual display (Xvfb) with a program on it, driven by synthetic keys and a synthetic mouse
//! (xdotool).

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// A virtual display whose pixels are in a file; it ends on drop.
pub(crate) struct Display {
    server: Child,
    name: String,
    pub(crate) folder: PathBuf,
}

/// A program on the display; it ends on drop.
pub(crate) struct Shown(pub(crate) Child);

impl Drop for Shown {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A rectangle of the display, pixels.
pub(crate) struct Part {
    pub(crate) low: [usize; 2],
    pub(crate) high: [usize; 2],
}

impl Part {
    fn contains(&self, place: [usize; 2]) -> bool {
        (0..2).all(|axis| (self.low[axis]..self.high[axis]).contains(&place[axis]))
    }
}

/// The whole display.
pub(crate) const WHOLE: Part = Part { low: [0, 0], high: [1300, 900] };

/// Time limit for any action, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);
/// Time between two looks at the window.
const LOOK: Duration = Duration::from_millis(200);

impl Display {
    /// Opens a display. `name` is the name of the test. The display gets the first free number,
    /// so that tests can run in parallel.
    pub(crate) fn open(name: &str) -> Self {
        static DISPLAYS: AtomicU32 = AtomicU32::new(0);
        let number = DISPLAYS.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("palpus-{name}-{}-{number}", std::process::id()));
        fs::create_dir_all(&folder).expect("the folder can be created");
        let [width, height] = WHOLE.high;
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", &format!("{width}x{height}x24"), "-fbdir"])
            .arg(&folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb is installed");
        let mut number = String::new();
        let said = server.stdout.take().expect("the output is piped");
        BufReader::new(said).read_line(&mut number).expect("Xvfb prints its number");
        Self { server, name: format!(":{}", number.trim()), folder }
    }

    /// Returns a command that runs the program on this display, in its folder.
    pub(crate) fn palpus(&self, arguments: &[&str]) -> Command {
        palpus(&self.folder, &self.name, arguments)
    }

    /// Starts the program.
    pub(crate) fn show(&self, arguments: &[&str]) -> Shown {
        let mut command = self.palpus(arguments);
        Shown(command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts"))
    }

    /// Sends synthetic input, given as arguments of xdotool.
    pub(crate) fn input(&self, words: &str) {
        let status = Command::new("xdotool").args(words.split(' ')).env("DISPLAY", &self.name).status();
        assert!(status.expect("xdotool is installed").success(), "xdotool {words}");
    }

    /// Gives the keyboard focus to the window, since this display has no window manager.
    pub(crate) fn focus(&self) {
        self.input("search --name palpus windowfocus");
    }

    /// Returns the places of the pixels of `part` for which `wanted` is true.
    pub(crate) fn seen(&self, part: &Part, wanted: impl Fn([i32; 3]) -> bool) -> Vec<[usize; 2]> {
        let pixels = self.pixels().into_iter().filter(|(place, _)| part.contains(*place));
        pixels.filter(|(_, pixel)| wanted(pixel.map(i32::from))).map(|(place, _)| place).collect()
    }

    /// Waits until `wanted` is true for at least `least` pixels of `part`.
    pub(crate) fn wait_for(&self, what: &str, least: usize, part: &Part, wanted: impl Fn([i32; 3]) -> bool) {
        let begin = Instant::now();
        loop {
            let seen = self.seen(part, &wanted).len();
            if seen >= least {
                return;
            }
            assert!(begin.elapsed() < PATIENCE, "no {what}: {seen} pixels of {least}");
            std::thread::sleep(LOOK);
        }
    }

    /// Waits until a file in the display's folder is a complete picture.
    pub(crate) fn wait_for_picture(&self, name: &str) {
        let (file, begin) = (self.folder.join(name), Instant::now());
        while !is_whole_picture(&file) {
            assert!(begin.elapsed() < PATIENCE, "no {name}");
            std::thread::sleep(LOOK);
        }
    }

    /// Reads place and colour (red, green, blue) of every pixel from the screen file. Its format is
    /// XWD: a header of 32-bit numbers, colours, rows.
    fn pixels(&self) -> Vec<([usize; 2], [u8; 3])> {
        let file = fs::read(self.folder.join("Xvfb_screen0")).expect("the screen file can be read");
        let number = |k: usize| {
            u32::from_be_bytes(file[4 * k..4 * k + 4].try_into().expect("the slice has four bytes")) as usize
        };
        let (header, width, height, row, colours) = (number(0), number(4), number(5), number(12), number(19));
        let first = header + 12 * colours;
        let pixel = |[x, y]: [usize; 2]| first + y * row + 4 * x;
        let all = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        all.map(|place| (place, [2, 1, 0].map(|part| file[pixel(place) + part]))).collect()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Returns a command that runs the program on a display, in a folder.
pub(crate) fn palpus(folder: &Path, display: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpus"));
    command.current_dir(folder).env("XDG_CACHE_HOME", folder.join("cache")).args(arguments);
    command.env("XDG_STATE_HOME", folder.join("state"));
    command.env("DISPLAY", display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command.env("LP_NUM_THREADS", "1");
    command
}

/// True for the spoon's colour in any light: much red, less green, little blue.
pub(crate) fn orange([r, g, b]: [i32; 3]) -> bool {
    r > 120 && r > g + 30 && g > b + 25
}

/// True if the file begins and ends like a PNG file.
fn is_whole_picture(file: &Path) -> bool {
    fs::read(file).is_ok_and(|bytes| bytes.starts_with(b"\x89PNG") && bytes.ends_with(b"IEND\xaeB`\x82"))
}
