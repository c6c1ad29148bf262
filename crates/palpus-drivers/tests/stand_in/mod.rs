//! Stand-ins for the makers' libraries. The tests compile these stand-ins.
#![allow(unsafe_code)] // Calls of functions in a stand-in are unsafe.
#![allow(dead_code, unreachable_pub)] // Each test file uses a part of this module.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

pub mod keys {
    include!("keys.rs");
}

/// One copy of a stand-in library, with separate numbers.
pub struct StandIn {
    path: PathBuf,
    library: libloading::Library,
}

impl StandIn {
    /// Returns a stand-in for Force Dimension's library.
    pub fn dhd() -> Self {
        static BUILT: OnceLock<PathBuf> = OnceLock::new();
        Self::copy(BUILT.get_or_init(|| build("dhd")))
    }

    /// Returns a stand-in for OpenHaptics' library.
    pub fn hd() -> Self {
        static BUILT: OnceLock<PathBuf> = OnceLock::new();
        Self::copy(BUILT.get_or_init(|| build("hd")))
    }

    /// Copies the library. The loader loads a file only once per process, so every test has a
    /// separate file.
    fn copy(built: &Path) -> Self {
        static COPIES: AtomicU32 = AtomicU32::new(0);
        let number = COPIES.fetch_add(1, Ordering::Relaxed);
        let path = built.with_file_name(format!("{number}-{}", built.file_name().unwrap().to_string_lossy()));
        std::fs::copy(built, &path).expect("the stand-in can be copied");
        // SAFETY: the stand-in only has the initialisers of Rust.
        let library = unsafe { libloading::Library::new(&path) }.expect("the stand-in can be loaded");
        Self { path, library }
    }

    pub fn path(&self) -> PathBuf {
        self.path.clone()
    }

    pub fn set(&self, slot: usize, value: f64) -> &Self {
        // SAFETY: the type is the type of the function in slots.rs.
        let set: libloading::Symbol<'_, extern "C" fn(usize, f64)> =
            unsafe { self.library.get(b"stand_in_set\0") }.expect("the function exists in the stand-in");
        set(slot, value);
        self
    }

    pub fn get(&self, slot: usize) -> f64 {
        // SAFETY: the type is the type of the function in slots.rs.
        let get: libloading::Symbol<'_, extern "C" fn(usize) -> f64> =
            unsafe { self.library.get(b"stand_in_get\0") }.expect("the function exists in the stand-in");
        get(slot)
    }

    pub fn three(&self, slot: usize) -> [f64; 3] {
        [self.get(slot), self.get(slot + 1), self.get(slot + 2)]
    }

    /// Waits until `what` is true. Returns false after two seconds.
    pub fn comes_to(&self, mut what: impl FnMut(&Self) -> bool) -> bool {
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(2) {
            if what(self) {
                return true;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        false
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Compiles `tests/stand_in/NAME.rs` to a C library, and returns its path.
pub fn build(name: &str) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stand_in").join(format!("{name}.rs"));
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}", env!("CARGO_CRATE_NAME")));
    std::fs::create_dir_all(&out).expect("the folder can be created");
    let file = out.join(format!("stand_in{}", std::env::consts::DLL_SUFFIX));
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let mut command = Command::new(rustc);
    command.args(["--edition", "2024", "--crate-type", "cdylib", "--crate-name", "stand_in", "-Cdebuginfo=0"]);
    let output = command.arg("-o").arg(&file).arg(&source).output().expect("rustc can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    file
}
