//! Stand-ins for the makers' libraries, compiled by the tests.
#![allow(unsafe_code)] // To talk with a stand-in, one has to call it.
#![allow(dead_code, unreachable_pub)] // Each test file has its own half of it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

pub mod keys {
    include!("keys.rs");
}

/// One copy of a stand-in library, with numbers of its own.
pub struct StandIn {
    path: PathBuf,
    library: libloading::Library,
}

impl StandIn {
    /// Force Dimension's library.
    pub fn dhd() -> Self {
        static BUILT: OnceLock<PathBuf> = OnceLock::new();
        Self::copy(BUILT.get_or_init(|| build("dhd")))
    }

    /// OpenHaptics' library.
    pub fn hd() -> Self {
        static BUILT: OnceLock<PathBuf> = OnceLock::new();
        Self::copy(BUILT.get_or_init(|| build("hd")))
    }

    /// The loader gives everyone who opens a file the same library, so every test has a file of its
    /// own.
    fn copy(built: &Path) -> Self {
        static COPIES: AtomicU32 = AtomicU32::new(0);
        let number = COPIES.fetch_add(1, Ordering::Relaxed);
        let path = built.with_file_name(format!("{number}-{}", built.file_name().unwrap().to_string_lossy()));
        std::fs::copy(built, &path).expect("a copy of the stand-in");
        // SAFETY: the stand-in's initialisers are those of Rust.
        let library = unsafe { libloading::Library::new(&path) }.expect("the stand-in loads");
        Self { path, library }
    }

    pub fn path(&self) -> PathBuf {
        self.path.clone()
    }

    pub fn set(&self, slot: usize, value: f64) -> &Self {
        // SAFETY: the type is that of the function in slots.rs.
        let set: libloading::Symbol<'_, extern "C" fn(usize, f64)> =
            unsafe { self.library.get(b"stand_in_set\0") }.expect("a stand-in");
        set(slot, value);
        self
    }

    pub fn get(&self, slot: usize) -> f64 {
        // SAFETY: the type is that of the function in slots.rs.
        let get: libloading::Symbol<'_, extern "C" fn(usize) -> f64> =
            unsafe { self.library.get(b"stand_in_get\0") }.expect("a stand-in");
        get(slot)
    }

    pub fn three(&self, slot: usize) -> [f64; 3] {
        [self.get(slot), self.get(slot + 1), self.get(slot + 2)]
    }

    /// Waits until `what` is so; false when it is not after two seconds.
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

/// Compiles `tests/stand_in/NAME.rs` to a C library.
pub fn build(name: &str) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/stand_in").join(format!("{name}.rs"));
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}-{name}", env!("CARGO_CRATE_NAME")));
    std::fs::create_dir_all(&out).expect("a folder for the stand-in");
    let file = out.join(format!("stand_in{}", std::env::consts::DLL_SUFFIX));
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let mut command = Command::new(rustc);
    command.args(["--edition", "2024", "--crate-type", "cdylib", "--crate-name", "stand_in", "-Cdebuginfo=0"]);
    let output = command.arg("-o").arg(&file).arg(&source).output().expect("rustc runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    file
}
