//! The answers of an engine along a motion, as a file.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, bail};
use glam::DVec3;
use palpus::algebra::Wrench;

use crate::files;

/// The columns of a file of answers. `step_us` may be left out.
const COLUMNS: [&str; 7] = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "step_us"];

/// Answers to all poses of a motion.
pub(super) struct Answers {
    /// Wrenches on the probe, about its grip, along the environment's axes.
    pub(super) wrenches: Vec<Wrench>,
    /// Time of each step, µs; empty if unknown.
    pub(super) micros: Vec<f64>,
}

impl Answers {
    pub(super) fn write(&self, file: &Path) -> anyhow::Result<()> {
        let mut text = COLUMNS.join(",") + "\n";
        for (Wrench { force, torque }, micros) in self.wrenches.iter().zip(&self.micros) {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "{:?},{:?},{:?},{:?},{:?},{:?},{micros:.2}",
                force.x, force.y, force.z, torque.x, torque.y, torque.z
            );
        }
        files::write(file, text)
    }

    /// Reads a file with `count` rows.
    pub(super) fn read(file: &Path, count: usize) -> anyhow::Result<Self> {
        let text = fs::read_to_string(file)
            .with_context(|| format!("{} cannot be read; check the folder of --engine", file.display()))?;
        Self::of_text(&text, count).with_context(|| format!("{} is not a file of answers", file.display()))
    }

    fn of_text(text: &str, count: usize) -> anyhow::Result<Self> {
        let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
        let head: Vec<&str> =
            lines.next().map(|(_, line)| line.split(',').map(str::trim).collect()).unwrap_or_default();
        let place = |name: &str| head.iter().position(|column| *column == name);
        let mut places = [0; 6];
        for (slot, name) in places.iter_mut().zip(COLUMNS) {
            let Some(place) = place(name) else {
                bail!("line 1: there is no column {name}; the first line must be {}", COLUMNS.join(","))
            };
            *slot = place;
        }
        let time = place(COLUMNS[6]);
        let mut answers = Self { wrenches: Vec::with_capacity(count), micros: Vec::new() };
        for (number, line) in lines {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let value = |place: usize| -> anyhow::Result<f64> {
                let cell = cells.get(place).copied().unwrap_or_default();
                let value: Option<f64> = cell.parse().ok().filter(|value: &f64| value.is_finite());
                value.with_context(|| format!("line {number}, column {}: {cell:?} is not a finite number", head[place]))
            };
            let mut v = [0.0; 6];
            for (slot, place) in v.iter_mut().zip(places) {
                *slot = value(place)?;
            }
            answers.wrenches.push(Wrench { force: DVec3::new(v[0], v[1], v[2]), torque: DVec3::new(v[3], v[4], v[5]) });
            if let Some(time) = time {
                answers.micros.push(value(time)?);
            }
        }
        if answers.wrenches.len() != count {
            bail!(
                "it has {} rows, but the motion has {count}; write one row for each row of motion.csv",
                answers.wrenches.len()
            );
        }
        Ok(answers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "torque_x,torque_y,torque_z,force_x,force_y,force_z";

    #[test]
    fn columns_come_in_any_order_and_times_are_optional() {
        let answers = Answers::of_text(&format!("{HEAD}\n1,2,3,4,5,6\n"), 1).expect("the file can be read");
        assert_eq!(answers.wrenches[0].force, DVec3::new(4.0, 5.0, 6.0));
        assert_eq!(answers.wrenches[0].torque, DVec3::new(1.0, 2.0, 3.0));
        assert!(answers.micros.is_empty());
    }

    #[test]
    fn wrong_file_error_names_line_and_column() {
        for (text, said) in [
            ("force_x,force_y\n".to_owned(), "there is no column force_z"),
            (format!("{HEAD}\n1,2,3,4,nan,6\n"), "line 2, column force_y"),
            (format!("{HEAD}\n1,2,3\n"), "line 2, column force_x"),
            (format!("{HEAD}\n"), "it has 0 rows, but the motion has 1"),
            (String::new(), "there is no column force_x"),
        ] {
            let error = Answers::of_text(&text, 1).err().map(|error| error.to_string()).unwrap_or_default();
            assert!(error.contains(said), "{error:?} does not contain {said:?}");
        }
    }
}
