//! Conversion of numbers from Python: accepts anything that numpy converts to an array.

use glam::DVec3;
use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use palpus::{Pose, Twist};
use palpus_io::pose_of;
use pyo3::prelude::*;

use crate::refused::refused;

/// Number of columns of a pose.
const POSE: usize = 7;
/// Number of columns of a twist.
const TWIST: usize = 6;

/// Returns `given` as an array of doubles. An array of doubles is not copied. `name` is the name of
/// the argument in errors.
fn doubles<'py>(name: &str, given: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given, "float64")).map_err(|error| {
        let said = error.value(given.py()).to_string();
        refused(format!("{name} is not an array of numbers ({said})"))
    })?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?.try_readonly()?)
}

/// Returns rows of `N` numbers. A single row may have no first dimension. `columns` describes the
/// columns in errors.
pub(crate) fn rows<const N: usize>(name: &str, columns: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; N]>> {
    let array = doubles(name, given)?;
    let view = array.as_array();
    let count = match *view.shape() {
        [n, columns] if columns == N => n,
        [columns] if columns == N => 1,
        [0] => 0,
        ref shape => {
            return Err(refused(format!("{name} has the shape {shape:?}, but must be (N, {N}): {columns}")));
        }
    };
    let mut rows = vec![[0.0; N]; count];
    rows.as_flattened_mut().iter_mut().zip(view.iter()).for_each(|(to, from)| *to = *from);
    Ok(rows)
}

/// Returns poses. The columns have the same order as in the files of the program.
pub(crate) fn poses(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Pose>> {
    let rows = rows::<POSE>(name, "tx, ty, tz, qx, qy, qz, qw", given)?;
    let checked = |(k, row)| pose_of(row).map_err(|problem| refused(format!("{name}[{k}]: {problem}")));
    rows.into_iter().enumerate().map(checked).collect()
}

/// Returns one pose.
pub(crate) fn pose(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Pose> {
    match poses(name, given)?[..] {
        [pose] => Ok(pose),
        ref poses => Err(refused(format!("{name} has {} rows, but must be one pose of 7 numbers", poses.len()))),
    }
}

/// Returns twists: linear (m/s), then angular (rad/s).
pub(crate) fn twists(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<Twist>> {
    let rows = rows::<TWIST>(name, "vx, vy, vz, wx, wy, wz", given)?;
    let twist = |[vx, vy, vz, wx, wy, wz]: [f64; TWIST]| Twist {
        linear: DVec3::new(vx, vy, vz),
        angular: DVec3::new(wx, wy, wz),
    };
    let twists: Vec<Twist> = rows.into_iter().map(twist).collect();
    match twists.iter().position(|twist| !(twist.linear.is_finite() && twist.angular.is_finite())) {
        Some(k) => Err(refused(format!("{name}[{k}] contains a number that is not finite; correct it"))),
        None => Ok(twists),
    }
}

/// Returns one twist, or zero if no twist is given.
pub(crate) fn twist(name: &str, given: Option<&Bound<'_, PyAny>>) -> PyResult<Twist> {
    let Some(given) = given else { return Ok(Twist::default()) };
    match twists(name, given)?[..] {
        [twist] => Ok(twist),
        ref twists => Err(refused(format!("{name} has {} rows, but must be one twist of 6 numbers", twists.len()))),
    }
}

/// Returns one point or vector.
pub(crate) fn vector(name: &str, given: &Bound<'_, PyAny>) -> PyResult<DVec3> {
    match rows::<3>(name, "x, y, z", given)?[..] {
        [vector] if vector.iter().all(|x| x.is_finite()) => Ok(DVec3::from_array(vector)),
        _ => Err(refused(format!("{name} must be three finite numbers x, y, z"))),
    }
}

/// Returns a pose as a row of numbers.
pub(crate) fn of_pose(pose: &Pose) -> [f64; POSE] {
    let [tx, ty, tz] = pose.translation.to_array();
    let [qx, qy, qz, qw] = pose.rotation.to_array();
    [tx, ty, tz, qx, qy, qz, qw]
}

/// Returns two vectors as one row of numbers.
pub(crate) fn of_pair(first: DVec3, second: DVec3) -> [f64; TWIST] {
    let ([a, b, c], [d, e, f]) = (first.to_array(), second.to_array());
    [a, b, c, d, e, f]
}
