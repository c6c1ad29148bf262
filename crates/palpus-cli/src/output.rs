//! Where words go: answers to standard output, everything else to standard error.

use std::io::{ErrorKind, IsTerminal, Write};

use serde::Serialize;

/// One error on one screen: the outermost sentence, then its causes.
pub(crate) fn error(error: &anyhow::Error) {
    note(format_args!("error: {error}"));
    for cause in error.chain().skip(1) {
        note(format_args!("  because: {cause}"));
    }
}

/// A line for the user that is not the answer. Does nothing if there is no terminal any more: a run goes on to its end all the same.
pub(crate) fn note(text: impl std::fmt::Display) {
    // A live line may stand there.
    let begin = if watched() { "\r\x1b[2K" } else { "" };
    let _ = writeln!(std::io::stderr(), "{begin}{text}");
}

/// A line of the answer. Who reads may stop reading (`| head`): that ends the program, and is no failure of it.
pub(crate) fn line(text: impl std::fmt::Display) {
    if let Err(error) = writeln!(std::io::stdout(), "{text}") {
        if error.kind() == ErrorKind::BrokenPipe {
            std::process::exit(0);
        }
        note(format_args!("error: the answer could not be printed: {error}"));
        std::process::exit(1);
    }
}

/// The answer as one JSON document.
pub(crate) fn json(document: &impl Serialize) -> anyhow::Result<()> {
    line(serde_json::to_string_pretty(document)?);
    Ok(())
}

/// True when someone watches standard error, so that a line may be drawn over.
pub(crate) fn watched() -> bool {
    std::io::stderr().is_terminal()
}

/// Draws over the last live line (only where [`watched`]).
pub(crate) fn live(text: &str) {
    let _ = write!(std::io::stderr(), "\r\x1b[2K{text}");
}

/// Ends a live line.
pub(crate) fn live_end() {
    note("");
}
