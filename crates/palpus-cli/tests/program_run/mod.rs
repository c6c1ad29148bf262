//! The program as a test runs it: in a folder of its own, with bodies kept there, and without a
//! display.
#![allow(dead_code, reason = "each test file uses a part of it")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A folder of its own for one test, gone when the test is over.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("palpus-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    pub(crate) fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).expect("a temporary file");
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpus"));
    // Faults of tests are not the user's.
    command.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    // A test must not open a window.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command
}

/// The program, to be run in `folder`.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = program();
    // Bodies are kept in the test's folder, not in the user's.
    command
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .env("XDG_STATE_HOME", folder.join("state"))
        .args(arguments);
    command
}

pub(crate) fn palpus(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the program starts")
}

/// The program, to be run without a folder: it keeps no bodies.
pub(crate) fn command_without_cache(arguments: &[&str]) -> Command {
    let mut command = program();
    command.arg("--no-cache").args(arguments);
    command
}

pub(crate) fn palpus_without_cache(arguments: &[&str]) -> Output {
    command_without_cache(arguments).output().expect("the program starts")
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

pub(crate) fn assert_success(output: &Output) {
    assert!(output.status.success(), "{}", text(&output.stderr));
}

/// The document on standard output of a program that succeeded.
pub(crate) fn json(output: &Output) -> Value {
    assert_success(output);
    document(output)
}

/// The document on standard output, whatever the exit status says.
pub(crate) fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("no JSON document ({error}): {}", text(&output.stderr)))
}
