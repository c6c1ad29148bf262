//! Runs the program for tests: in a temporary folder, with its own cache, and without a display.
#![allow(dead_code, reason = "each test file uses only a part")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

/// A temporary folder for one test, deleted on drop.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("palpus-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("the folder can be created");
        Self(path)
    }

    pub(crate) fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, text).expect("the file can be written");
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
    // Faults of tests must not get into the user's log.
    command.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    // A test must not open a window.
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    command
}

/// Returns a command that runs the program in `folder`.
pub(crate) fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = program();
    // The cache of bodies is in the test's folder, not in the user's.
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

/// Runs the program in `folder` with `input` on standard input.
pub(crate) fn piped(folder: &Path, arguments: &[&str], input: &[u8]) -> Output {
    let mut command = command(folder, arguments);
    let mut child = command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // A program that stops with an error need not read its input.
    let _ = child.stdin.take().expect("standard input is a pipe").write_all(input);
    child.wait_with_output().expect("the program ends")
}

/// Returns a command that runs the program without a cache of bodies.
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

/// Returns the JSON document on standard output; the program must succeed.
pub(crate) fn json(output: &Output) -> Value {
    assert_success(output);
    document(output)
}

/// Returns the JSON document on standard output, with any exit status.
pub(crate) fn document(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("no JSON document ({error}): {}", text(&output.stderr)))
}
