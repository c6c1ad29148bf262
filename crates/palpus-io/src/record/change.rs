//! Writes and reads a change of the engine's settings within a recording, as text.

use std::io;

use palpus::render::Settings;
use serde::{Deserialize, Serialize};

use super::header::valid_settings;

/// Key of a change of settings in every recording format.
pub(super) const KEY: &str = "change";

#[derive(Serialize, Deserialize)]
struct Document {
    change: Change,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Change {
    /// The first tick that is computed with the settings.
    tick: u64,
    /// All settings, not only those that changed.
    #[serde(deserialize_with = "valid_settings")]
    settings: Settings,
}

/// Returns a line of TOML, `change = { … }`. Fails if TOML cannot represent a number.
pub(super) fn write(tick: u64, settings: &Settings) -> io::Result<String> {
    let change = Change { tick, settings: *settings };
    let value = toml::Value::try_from(change).map_err(io::Error::other)?;
    Ok(format!("{KEY} = {value}"))
}

/// Returns the tick and the settings of such a line; fails with a description of the problem.
pub(super) fn read(text: &str) -> Result<(u64, Settings), String> {
    let document: Document =
        toml::from_str(text).map_err(|error| format!("the change of settings is invalid: {}", error.message()))?;
    let Change { tick, settings } = document.change;
    Ok((tick, settings))
}

/// Changes that are not yet written, because their first tick has not been recorded.
#[derive(Debug, Default)]
pub(super) struct Pending(Vec<(u64, Settings)>);

impl Pending {
    /// Adds a change. If there are several changes for one tick, the last change applies.
    pub(super) fn add(&mut self, tick: u64, settings: &Settings) {
        match self.0.last_mut() {
            Some((last, waiting)) if *last == tick => *waiting = *settings,
            _ => self.0.push((tick, *settings)),
        }
    }

    /// Removes and returns the changes to write before the row of `tick`.
    pub(super) fn before(&mut self, tick: u64) -> impl Iterator<Item = (u64, Settings)> {
        let due = self.0.partition_point(|(from, _)| *from <= tick);
        self.0.drain(..due)
    }
}
