//! How the recordings of two tools name each other: without folders, since the other one lies beside the one that was named.

use std::path::Path;

use palpus_io::Recording;
use toml::{Table, Value};

/// Under this name a recording's header tells of the other tool's.
const SECTION: &str = "other_tool";

/// For the header of tool `which` (0 or 1): where the other one's recording is.
pub(crate) fn name_other(which: usize, other: &Path, into: &mut Table) {
    let mut table = Table::new();
    let file = other.file_name().unwrap_or_default().to_string_lossy().into_owned();
    table.insert("recording".into(), file.into());
    table.insert("this_is".into(), super::NAMES[which].into());
    into.insert(SECTION.into(), Value::Table(table));
}

/// If `recording` is that of one of two tools: which one, and the name of the other one's file.
pub(crate) fn other_of(recording: &Recording) -> Option<(usize, &str)> {
    let table = recording.header.scene.more.get(SECTION)?.as_table()?;
    let this = table.get("this_is")?.as_str()?;
    Some((super::NAMES.iter().position(|name| *name == this)?, table.get("recording")?.as_str()?))
}
