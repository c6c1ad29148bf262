//! Proven bounds of the depth at many poses, with the same results as `palpus depth`.

use std::ops::Range;
use std::sync::atomic::Ordering;

use numpy::{IntoPyArray, PyArray1};
use palpus::algebra::both;
use palpus::{GlobalDepth, GlobalMemory, GlobalSettings};
use pyo3::prelude::*;

use crate::arrays::poses;
use crate::bodies::Body;
use crate::refused::refused;
use crate::rows::DepthRow;
use crate::workers::{detached, threads};

/// Returns bounds of the penetration depth at each pose (N, 7) of a in b's frame: an array (N,) of
/// DEPTH, in b's frame.
///
/// No translation shorter than `lower` separates the bodies. Moving a by `translation`, which has
/// the length `upper`, separates them. The search at a pose ends when upper - lower is at most
/// `gap` (a length; default: 1 % of the smaller body's size), and then `certified` is true. The
/// search also ends after `budget` evaluations. With `outside`, a translation counts as free only
/// if a can then leave b along a straight line. `contained` is 1 if a lies in b, 2 if b lies in a,
/// and 0 otherwise. `distance` is the distance of the surfaces: negative if one body lies in the
/// other, and NaN if the surfaces cross.
#[pyfunction]
#[pyo3(signature = (a, b, poses, *, gap=None, budget=None, outside=false, workers=None))]
pub(crate) fn depth<'py>(
    a: &Bound<'py, Body>,
    b: &Bound<'py, Body>,
    poses: &Bound<'py, PyAny>,
    gap: Option<f64>,
    budget: Option<u64>,
    outside: bool,
    workers: Option<usize>,
) -> PyResult<Bound<'py, PyArray1<DepthRow>>> {
    let (py, a, b) = (a.py(), a.get(), b.get());
    let poses = self::poses("poses", poses)?;
    let threads = threads(workers)?;
    let default = GlobalSettings::new(a.shared(), b.shared());
    let gap = gap.unwrap_or(default.gap);
    if !(gap.is_finite() && gap > 0.0) {
        return Err(refused(format!("gap is {gap}, but must be a length greater than 0")));
    }
    let goal = GlobalSettings { gap, budget: budget.unwrap_or(default.budget), outside };
    let runs = detached(py, |stop, look| {
        let (interior_a, interior_b) = both(&threads, || a.interior(&threads), || b.interior(&threads));
        let query = GlobalDepth::new(a.shared(), interior_a, b.shared(), interior_b);
        let of_run = |numbers: Range<usize>, memory: &mut GlobalMemory| {
            let frames = poses[numbers].iter().take_while(|_| !stop.load(Ordering::Relaxed));
            frames.map(|pose_ba| DepthRow::new(&query.run(pose_ba, &goal, memory))).collect::<Vec<_>>()
        };
        GlobalDepth::run_all(poses.len(), &threads, look, of_run)
    })?;
    Ok(runs.concat().into_pyarray(py))
}
