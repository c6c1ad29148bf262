//! Reads files with the motion of a hand.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use super::columns::{self, Columns};
use super::{HandFile, RecordedHand};
use crate::query::read_poses_from;
use crate::table::{Cell, TableError};

/// Size of the largest file that is read: several hours of hand motion at 1 kHz.
const MOST_BYTES: u64 = 256 << 20;
/// Largest number of samples.
const MOST_SAMPLES: usize = 4_000_000;
/// Largest deviation of a quaternion's length from 1.
const QUATERNION_SLACK: f64 = 1e-3;
/// Names of the columns of TUM's format, for error messages.
const TUM: [&str; 8] = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"];
/// Largest accepted absolute value of a coordinate (m) or a time (s).
const FARTHEST: f64 = 1e6;
const LATEST: f64 = 1e12;

/// Reads a file with the motion of a hand; see [`read_hand_from`].
///
/// # Errors
/// Fails if the file cannot be read, is too large, or has none of the supported formats. The error
/// contains the line and the column.
pub fn read_hand(path: &Path) -> Result<HandFile, TableError> {
    let name = path.display().to_string();
    let unreadable = |error| TableError::at(&name, 0, format!("cannot be read ({error}); check the path"));
    let file = File::open(path).map_err(unreadable)?;
    let mut bytes = Vec::new();
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(TableError::at(&name, 0, format!("is larger than {} MB; shorten it", MOST_BYTES >> 20)));
    }
    read_hand_from(&bytes, &name)
}

/// Reads the content of a file with the motion of a hand; error messages use the file name `name`.
/// The documentation of the module `hand` lists the formats.
///
/// # Errors
/// Same as [`read_hand`].
pub fn read_hand_from(bytes: &[u8], name: &str) -> Result<HandFile, TableError> {
    let text = std::str::from_utf8(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count() as u64;
        TableError::at(name, line, "the file is not UTF-8 text; is it a list of poses?")
    })?;
    let mut lines =
        (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
    let Some((line, first)) = lines.clone().next() else {
        return Err(TableError::at(
            name,
            0,
            "the file contains no poses; see `[hand] path` in the documentation of scenes",
        ));
    };
    if !first.contains(',') {
        return recorded(lines, name, |line, text| tum(name, line, text)).map(HandFile::Recorded);
    }
    let columns = columns::find(first).map_err(|problem| {
        TableError::at(
            name,
            line,
            format!("{problem}; the first line names the columns, such as t,tx,ty,tz,qx,qy,qz,qw"),
        )
    })?;
    if columns.time.is_none() && columns.metres.is_none() {
        return read_poses_from(bytes, name).map(HandFile::Poses);
    }
    if columns.time.is_none() {
        return Err(TableError::at(
            name,
            line,
            "the header has no time, such as t_s; poses without times have the columns tx,ty,tz,qx,qy,qz,qw",
        ));
    }
    lines.next();
    let names: Vec<&str> = first.split(',').map(str::trim).collect();
    recorded(lines, name, |line, text| row(name, line, text, &columns, &names)).map(HandFile::Recorded)
}

/// Reads the samples from lines; `read` parses one line.
fn recorded<'a>(
    lines: impl Iterator<Item = (u64, &'a str)>,
    name: &str,
    read: impl Fn(u64, &'a str) -> Result<(f64, Pose), TableError>,
) -> Result<RecordedHand, TableError> {
    let mut samples: Vec<(f64, Pose)> = Vec::new();
    let (mut first, mut repeated) = (None, 0);
    for (line, text) in lines {
        let (time, pose) = read(line, text)?;
        let begun = *first.get_or_insert(time);
        let time = time - begun;
        match samples.last() {
            Some((last, _)) if time < *last => {
                let problem = format!("the time decreases here by {} s; sort the file by time", last - time);
                return Err(TableError::at(name, line, problem));
            }
            Some((last, _)) if time <= *last => repeated += 1,
            _ if samples.len() >= MOST_SAMPLES => {
                let problem = format!("there are more than {MOST_SAMPLES} samples; shorten the file");
                return Err(TableError::at(name, line, problem));
            }
            _ => samples.push((time, pose)),
        }
    }
    if samples.len() < 2 {
        let problem =
            format!("there are {} samples at different times; a recorded motion needs at least two", samples.len());
        return Err(TableError::at(name, 0, problem));
    }
    Ok(RecordedHand { samples, repeated })
}

/// Parses a line of TUM's format.
fn tum(name: &str, line: u64, text: &str) -> Result<(f64, Pose), TableError> {
    let mut words = text.split_whitespace();
    let mut numbers = [0.0; 8];
    for (number, column) in numbers.iter_mut().zip(TUM) {
        let Some(word) = words.next() else {
            let problem = format!("{column} is missing; a line is {}", TUM.join(" "));
            return Err(TableError::at(name, line, problem));
        };
        *number = finite(name, line, column, word)?;
    }
    if words.next().is_some() {
        return Err(TableError::at(name, line, format!("there is more than {}", TUM.join(" "))));
    }
    let [time, x, y, z, rotation @ ..] = numbers;
    Ok((within(name, line, time, LATEST)?, pose(name, line, [x, y, z], rotation)?))
}

/// Parses a line of a CSV file.
fn row(name: &str, line: u64, text: &str, columns: &Columns, names: &[&str]) -> Result<(f64, Pose), TableError> {
    let cells: Vec<&str> = text.split(',').collect();
    if cells.len() != names.len() {
        let problem =
            format!("there are {} cells but should be {}; correct or remove the line", cells.len(), names.len());
        return Err(TableError::at(name, line, problem));
    }
    let at = |place: usize| finite(name, line, names[place], cells[place].trim());
    let (place, seconds) = columns.time.unwrap_or_default();
    let time = within(name, line, at(place)? * seconds, LATEST)?;
    let metres = columns.metres.unwrap_or(1.0);
    let [x, y, z] = columns.position;
    let position = [at(x)? * metres, at(y)? * metres, at(z)? * metres];
    let [x, y, z, w] = columns.quaternion;
    Ok((time, pose(name, line, position, [at(x)?, at(y)?, at(z)?, at(w)?])?))
}

fn finite(name: &str, line: u64, column: &str, text: &str) -> Result<f64, TableError> {
    f64::of_text(text).filter(|number| number.is_finite()).ok_or_else(|| {
        let shown: String = text.chars().take(40).collect();
        let problem = format!("{shown:?} is not a finite number; correct it");
        TableError { column: Some(column.chars().take(40).collect()), ..TableError::at(name, line, problem) }
    })
}

fn within(name: &str, line: u64, number: f64, most: f64) -> Result<f64, TableError> {
    if number.abs() <= most {
        return Ok(number);
    }
    Err(TableError::at(name, line, format!("{number:e} is larger than {most:e}; check the unit")))
}

fn pose(name: &str, line: u64, position: [f64; 3], quaternion: [f64; 4]) -> Result<Pose, TableError> {
    let rotation = DQuat::from_array(quaternion);
    let length = rotation.length();
    if (length - 1.0).abs() > QUATERNION_SLACK {
        let problem =
            format!("the quaternion has length {length:?} but must have 1; normalise it (the order is x, y, z, w)");
        return Err(TableError::at(name, line, problem));
    }
    for coordinate in position {
        within(name, line, coordinate, FARTHEST)?;
    }
    Ok(Pose::new(rotation, DVec3::from_array(position)))
}
