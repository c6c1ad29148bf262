//! Reads the files that the steps wrote, for the page. Missing files give `None`.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::ran::{FILE, Outcome, Ran};

/// The folder of a reproduction.
pub(super) struct Data<'a> {
    pub(super) folder: &'a Path,
}

impl Data<'_> {
    pub(super) fn path(&self, id: &str, file: &str) -> PathBuf {
        self.folder.join("data").join(id).join(file)
    }

    pub(super) fn bytes(&self, id: &str, file: &str) -> Option<Vec<u8>> {
        fs::read(self.path(id, file)).ok()
    }

    pub(super) fn text(&self, id: &str, file: &str) -> Option<String> {
        fs::read_to_string(self.path(id, file)).ok()
    }

    pub(super) fn json<T: DeserializeOwned>(&self, id: &str, file: &str) -> Option<T> {
        serde_json::from_str(&self.text(id, file)?).ok()
    }

    /// Returns the outcome of a step.
    pub(super) fn ran(&self, id: &str) -> Option<Ran> {
        self.json(id, FILE)
    }

    pub(super) fn is_done(&self, id: &str) -> bool {
        self.ran(id).is_some_and(|ran| ran.outcome == Outcome::Done)
    }

    /// Returns the columns of a table of numbers, by name.
    pub(super) fn columns(&self, id: &str, file: &str) -> Option<Columns> {
        let text = self.text(id, file)?;
        let mut lines = text.lines();
        let names: Vec<String> = lines.next()?.split(',').map(str::to_owned).collect();
        let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect::<Vec<f64>>();
        Some(Columns { names, rows: lines.map(row).collect() })
    }
}

/// A table of numbers.
pub(super) struct Columns {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Columns {
    /// Returns the values under a name; empty if the name is missing.
    pub(super) fn of(&self, name: &str) -> Vec<f64> {
        let place = self.names.iter().position(|known| known == name);
        let value = |row: &Vec<f64>| place.and_then(|place| row.get(place)).copied();
        self.rows.iter().filter_map(value).collect()
    }
}

/// Returns a quantile of the finite `values`; NaN without any.
pub(super) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    palpus::algebra::quantile(&mut finite, share).unwrap_or(f64::NAN)
}

/// Returns a number in a document, by its path of names.
pub(super) fn number(document: &Value, way: &[&str]) -> Option<f64> {
    way.iter().try_fold(document, |value, name| value.get(name))?.as_f64()
}

/// Returns a text in a document.
pub(super) fn word<'v>(document: &'v Value, way: &[&str]) -> Option<&'v str> {
    way.iter().try_fold(document, |value, name| value.get(name))?.as_str()
}
