//! Output: results go to standard output, everything else goes to standard error.

use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicU8, Ordering};

use serde::Serialize;

/// Verbosity of messages other than results and errors: one of the three constants below.
static LEVEL: AtomicU8 = AtomicU8::new(USUAL);
const QUIET: u8 = 0;
const USUAL: u8 = 1;
const VERBOSE: u8 = 2;

/// Sets the verbosity from `--quiet` and `--verbose`.
pub(crate) fn set_level(quiet: bool, verbose: bool) {
    let level = if quiet { QUIET } else { USUAL + u8::from(verbose) };
    LEVEL.store(level, Ordering::Relaxed);
}

/// True with `--quiet`.
pub(crate) fn is_quiet() -> bool {
    LEVEL.load(Ordering::Relaxed) == QUIET
}

/// Prints an error: the outermost sentence, then its causes.
pub(crate) fn error(error: &anyhow::Error) {
    to_user(format_args!("error: {error}"));
    for cause in error.chain().skip(1) {
        to_user(format_args!("  because: {cause}"));
    }
}

/// Prints a line that is not a result, unless the program is quiet.
pub(crate) fn note(text: impl std::fmt::Display) {
    if !is_quiet() {
        to_user(text);
    }
}

/// Prints a line of detail, with `--verbose`.
pub(crate) fn detail(text: impl std::fmt::Display) {
    if LEVEL.load(Ordering::Relaxed) == VERBOSE {
        to_user(text);
    }
}

/// Prints a line to standard error. Ignores write errors, because a run goes on if its terminal is
/// closed.
fn to_user(text: impl std::fmt::Display) {
    // Ends a live line, if there is one.
    let begin = if watched() { "\r\x1b[2K" } else { "" };
    let _ = writeln!(std::io::stderr(), "{begin}{text}");
}

/// Prints a line of the result. If the reader has closed the pipe (`| head`), the program ends with
/// success.
pub(crate) fn line(text: impl std::fmt::Display) {
    if let Err(error) = writeln!(std::io::stdout(), "{text}") {
        unprinted(&error);
    }
}

/// Standard output as a writer for tables. If the reader has closed the pipe, the program ends with
/// success.
pub(crate) struct Answer(std::io::Stdout);

impl Answer {
    pub(crate) fn new() -> Self {
        Self(std::io::stdout())
    }
}

impl Write for Answer {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes).inspect_err(unprinted)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush().inspect_err(unprinted)
    }
}

/// Ends the program, because its result cannot be printed.
fn unprinted(error: &std::io::Error) {
    match error.kind() {
        ErrorKind::Interrupted => return,
        ErrorKind::BrokenPipe => std::process::exit(0),
        _ => {}
    }
    to_user(format_args!("error: the result could not be printed: {error}"));
    std::process::exit(1);
}

/// Prints the result as one JSON document.
pub(crate) fn json(document: &impl Serialize) -> anyhow::Result<()> {
    line(serde_json::to_string_pretty(document)?);
    Ok(())
}

/// True if the program may redraw a live line: standard error is a terminal, and `--quiet` is not
/// set.
pub(crate) fn watched() -> bool {
    !is_quiet() && std::io::stderr().is_terminal()
}

/// Redraws the live line. Call it only if [`watched`] returns true.
pub(crate) fn live(text: &str) {
    let _ = write!(std::io::stderr(), "\r\x1b[2K{text}");
}

/// Ends a live line.
pub(crate) fn live_end() {
    note("");
}
