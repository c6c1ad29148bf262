//! Arguments for the recording and the fault log of a run.

use std::path::{Path, PathBuf};

use clap::Args;

/// See the module's description.
#[derive(Clone, Debug, Args)]
pub(crate) struct KeepArguments {
    /// Overwrites a recording of the same name. By default the new recording gets a number:
    /// run-2.csv.
    #[arg(long)]
    pub(crate) force: bool,
    /// The largest size of a recording on disk, such as 500MB, or `none`. The first half of the
    /// size is for the beginning of the run. The other half is for the newest part of the run, in
    /// further files: run-part2.csv and so on.
    #[arg(long, value_name = "SIZE", default_value = "2GB", value_parser = size)]
    pub(crate) record_limit: Size,
    /// The file of the fault log (one line of JSON for each fault), or `none` [default:
    /// palpus/faults.jsonl in the user's state folder, such as ~/.local/state].
    #[arg(long, value_name = "FILE")]
    pub(crate) fault_log: Option<PathBuf>,
}

/// A size in bytes; `None` for no limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size(pub(crate) Option<u64>);

/// Smallest limit of a recording, bytes. Each part then has some seconds.
const LEAST: u64 = 16_000_000;

/// Reads a size: a number and a unit.
fn size(text: &str) -> Result<Size, String> {
    if text == "none" {
        return Ok(Size(None));
    }
    let digits = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let factor = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "MB" | "M" => 1e6,
        "GB" | "G" => 1e9,
        _ => return Err("write a size as 500MB, 2GB or none".to_owned()),
    };
    let number: f64 = digits.trim().parse().map_err(|_| "write a size as 500MB, 2GB or none".to_owned())?;
    let bytes = number * factor;
    if bytes.is_nan() || bytes < LEAST as f64 {
        return Err(format!("a recording needs at least {} MB", LEAST / 1_000_000));
    }
    Ok(Size(Some(bytes as u64)))
}

impl KeepArguments {
    /// Returns the file of the fault log: `Some(None)` for the default file, `None` for no log.
    pub(crate) fn fault_log(&self) -> Option<Option<&Path>> {
        match self.fault_log.as_deref() {
            Some(file) if file == Path::new("none") => None,
            file => Some(file),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_a_number_and_a_unit() {
        assert_eq!(size("2GB"), Ok(Size(Some(2_000_000_000))));
        assert_eq!(size("62.5m"), Ok(Size(Some(62_500_000))));
        assert_eq!(size("none"), Ok(Size(None)));
        for text in ["2", "GB", "-1GB", "1MB", "nanGB", "2TB", ""] {
            assert!(size(text).is_err(), "{text}");
        }
    }
}
