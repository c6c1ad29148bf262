//! Reads lists of poses.

use std::path::Path;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;

use crate::table::{Cell, TableError};

/// The columns that a file of poses must have: the translation and the unit quaternion.
pub const POSE_COLUMNS: [&str; 7] = ["tx", "ty", "tz", "qx", "qy", "qz", "qw"];

/// Largest deviation of a quaternion's length from 1: large enough for numbers with three decimals,
/// and too small for a missing column.
const QUATERNION_SLACK: f64 = 1e-3;

/// Reads a file of poses; see [`read_poses_from`].
pub fn read_poses(path: &Path) -> Result<Vec<Pose>, TableError> {
    let name = path.display().to_string();
    let unreadable = |error| TableError::at(&name, 0, format!("cannot be read ({error}); check the path"));
    let bytes = std::fs::read(path).map_err(unreadable)?;
    read_poses_from(&bytes, &name)
}

/// Reads poses; `name` is the name of the file in error messages.
///
/// The first line names the columns, in any order. Other columns, blank lines and lines that start
/// with `#` are ignored. Quaternions must have unit length within 1e-3 and are normalised.
pub fn read_poses_from(bytes: &[u8], name: &str) -> Result<Vec<Pose>, TableError> {
    let text = std::str::from_utf8(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count() as u64;
        TableError::at(name, line, "the file is not UTF-8 text; is it a CSV file?")
    })?;
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let expected = POSE_COLUMNS.join(",");
    let Some((line, header)) = lines.next() else {
        return Err(TableError::at(name, 0, format!("the file has no header; the first line must be {expected}")));
    };
    let places = columns(header).map_err(|missing| {
        TableError::at(name, line, format!("the header has no column {missing}; it must be {expected}"))
    })?;
    let width = header.split(',').count();
    lines
        .map(|(line, text)| {
            pose(text, &places, width).map_err(|(column, problem)| TableError {
                column: column.map(str::to_owned),
                ..TableError::at(name, line, problem)
            })
        })
        .collect()
}

/// Returns the indices of [`POSE_COLUMNS`], or the name of the first missing column.
fn columns(header: &str) -> Result<[usize; 7], &'static str> {
    let mut places = [0; 7];
    for (place, column) in places.iter_mut().zip(POSE_COLUMNS) {
        *place = header.split(',').position(|name| name.trim() == column).ok_or(column)?;
    }
    Ok(places)
}

/// Parses the pose on a line; fails with the column and a description of the problem.
fn pose(text: &str, places: &[usize; 7], width: usize) -> Result<Pose, (Option<&'static str>, String)> {
    let cells: Vec<&str> = text.split(',').collect();
    if cells.len() != width {
        return Err((
            None,
            format!("there are {} cells but should be {width}; correct or remove the line", cells.len()),
        ));
    }
    let mut numbers = [0.0; 7];
    for ((number, &place), column) in numbers.iter_mut().zip(places).zip(POSE_COLUMNS) {
        let text = cells[place].trim();
        *number = f64::of_text(text).filter(|x| x.is_finite()).ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            (Some(column), format!("{shown:?} is not a finite number; correct it"))
        })?;
    }
    pose_of(numbers).map_err(|problem| (Some("qx"), problem))
}

/// Returns the pose with these numbers, which are in the order of [`POSE_COLUMNS`].
///
/// # Errors
/// Fails with a description of the problem if a number is not finite or if the length of the
/// quaternion differs from 1 by more than 1e-3.
pub fn pose_of(numbers: [f64; 7]) -> Result<Pose, String> {
    if let Some((number, column)) = numbers.iter().zip(POSE_COLUMNS).find(|(number, _)| !number.is_finite()) {
        return Err(format!("{column} is {number:?}, which is not a finite number; correct it"));
    }
    let [tx, ty, tz, qx, qy, qz, qw] = numbers;
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    let length = rotation.length();
    if (length - 1.0).abs() > QUATERNION_SLACK {
        return Err(format!(
            "the quaternion has length {length:?} but must have 1; normalise it (the order is x, y, z, w)"
        ));
    }
    Ok(Pose::new(rotation, DVec3::new(tx, ty, tz)))
}
