//! Contacts and distances at many poses, as `palpus query` finds them.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{IntoPyArray, PyArray1};
use palpus::depth::ContainmentQuery;
use palpus::detect::ContactBatch;
use palpus::{ContactQuery, Pose, Proof, QuerySettings};
use palpus_io::Threads;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;

use crate::arrays::poses;
use crate::bodies::Body;
use crate::refused::refused;
use crate::rows::{ContactRow, DistanceRow};
use crate::workers::{detached, threads};

/// Default tolerance, as a share of the smaller body's size. As the program's.
const DEFAULT_TOLERANCE: f64 = 0.01;
/// Contacts that one pose can have. As the program's.
const CAPACITY: usize = 1 << 16;

/// Input of a batch.
struct Asked<'a> {
    a: &'a Arc<palpus::Body>,
    b: &'a Arc<palpus::Body>,
    poses: Vec<Pose>,
    settings: QuerySettings,
    threads: Threads,
}

/// Result of one run of poses.
#[derive(Default)]
struct Found {
    nearest: Vec<DistanceRow>,
    contacts: Vec<ContactRow>,
    /// Contacts over the capacity.
    dropped: u64,
}

impl<'a> Asked<'a> {
    fn new(
        a: &'a Bound<'_, Body>,
        b: &'a Bound<'_, Body>,
        given: &Bound<'_, PyAny>,
        tolerance: Option<f64>,
        prove: bool,
        workers: Option<usize>,
    ) -> PyResult<Self> {
        let (a, b) = (a.get().shared(), b.get().shared());
        let tolerance = match tolerance {
            Some(t) if t.is_finite() && t >= 0.0 => t,
            Some(t) => {
                return Err(refused(format!("tolerance is {t}, but must be a length in model units, 0 or more")));
            }
            None => DEFAULT_TOLERANCE * a.size().min(b.size()),
        };
        let proof = if prove { Proof::Prove } else { Proof::None };
        let settings = QuerySettings { tolerance, capacity: CAPACITY, proof, ..QuerySettings::default() };
        Ok(Self { a, b, poses: poses("poses", given)?, settings, threads: threads(workers)? })
    }

    /// Answers all poses; the answers of contacts are left out unless `keep`.
    fn answer(&self, py: Python<'_>, keep: bool) -> PyResult<Found> {
        let found = detached(py, |stop, look| {
            let containment = ContainmentQuery::new(self.a, self.b);
            let batch = ContactBatch::new(self.a.clone(), self.b.clone(), self.settings);
            let of_run =
                |query: &mut ContactQuery, run: Range<usize>| self.answer_run(query, &containment, run, keep, stop);
            batch.run(0..self.poses.len(), &self.threads, look, of_run)
        })?;
        let mut all = Found::default();
        all.nearest.reserve_exact(self.poses.len());
        all.contacts.reserve_exact(found.iter().map(|run| run.contacts.len()).sum());
        for run in found {
            all.nearest.extend(run.nearest);
            all.contacts.extend(run.contacts);
            all.dropped += run.dropped;
        }
        if all.nearest.len() < self.poses.len() {
            return Err(refused("a body has no pieces, so there is no nearest point"));
        }
        if all.dropped > 0 {
            let text = format!(
                "{} contacts over {CAPACITY} at a pose were left out; a smaller tolerance has fewer\0",
                all.dropped
            );
            let text = std::ffi::CStr::from_bytes_with_nul(text.as_bytes()).unwrap_or_default();
            PyErr::warn(py, &py.get_type::<PyUserWarning>(), text, 1)?;
        }
        Ok(all)
    }

    fn answer_run(
        &self,
        query: &mut ContactQuery,
        containment: &ContainmentQuery<'_>,
        run: Range<usize>,
        keep: bool,
        stop: &AtomicBool,
    ) -> Found {
        let mut found = Found::default();
        for k in run {
            if stop.load(Ordering::Relaxed) {
                break;
            }
            let nearest = query.nearest(&self.poses[k]);
            let (counters, contacts) = (query.counters(), query.found());
            found.dropped += u64::from(counters.traversal.dropped);
            // Closest points prove themselves by the planes through them; depths are counted if
            // they are not proven.
            let certified = counters.unproven == 0;
            let contained = containment.run(&self.poses[k]);
            found.nearest.extend(nearest.map(|near| DistanceRow::new(&near, contacts.len(), certified, contained)));
            if keep {
                found.contacts.extend(contacts.iter().map(|contact| ContactRow::new(k, contact)));
            }
        }
        found
    }
}

type Contacts<'py> = Bound<'py, PyArray1<ContactRow>>;
type Distances<'py> = Bound<'py, PyArray1<DistanceRow>>;

/// Nearest points and all contacts at each pose: what `distance` and `contacts` return, in one
/// pass.
#[pyfunction]
#[pyo3(signature = (a, b, poses, tolerance=None, *, prove=true, workers=None))]
pub(crate) fn query<'py>(
    a: &Bound<'py, Body>,
    b: &Bound<'py, Body>,
    poses: &Bound<'py, PyAny>,
    tolerance: Option<f64>,
    prove: bool,
    workers: Option<usize>,
) -> PyResult<(Distances<'py>, Contacts<'py>)> {
    let found = Asked::new(a, b, poses, tolerance, prove, workers)?.answer(a.py(), true)?;
    Ok((found.nearest.into_pyarray(a.py()), found.contacts.into_pyarray(a.py())))
}

/// All contacts nearer than `tolerance` at each pose (N, 7) of a in b's frame: an array of CONTACT,
/// in b's frame.
///
/// `separation` is minus the depth where convex pieces overlap; `point_a - point_b = separation *
/// normal`. Without a tolerance, 1 % of the smaller body's size. Unless `prove` is False, each
/// depth is proven the least of its pieces. `workers` is the number of threads, which changes no
/// bit of the answer; all cores if it is not given.
#[pyfunction]
#[pyo3(signature = (a, b, poses, tolerance=None, *, prove=true, workers=None))]
pub(crate) fn contacts<'py>(
    a: &Bound<'py, Body>,
    b: &Bound<'py, Body>,
    poses: &Bound<'py, PyAny>,
    tolerance: Option<f64>,
    prove: bool,
    workers: Option<usize>,
) -> PyResult<Contacts<'py>> {
    let found = Asked::new(a, b, poses, tolerance, prove, workers)?.answer(a.py(), true)?;
    Ok(found.contacts.into_pyarray(a.py()))
}

/// The nearest points at each pose (N, 7) of a in b's frame, or the deepest contact: an array
/// (N,) of DISTANCE.
///
/// `contacts` counts those within `tolerance`, which makes no other difference. The other arguments
/// are those of `contacts`.
#[pyfunction]
#[pyo3(signature = (a, b, poses, tolerance=None, *, prove=true, workers=None))]
pub(crate) fn distance<'py>(
    a: &Bound<'py, Body>,
    b: &Bound<'py, Body>,
    poses: &Bound<'py, PyAny>,
    tolerance: Option<f64>,
    prove: bool,
    workers: Option<usize>,
) -> PyResult<Distances<'py>> {
    let found = Asked::new(a, b, poses, tolerance, prove, workers)?.answer(a.py(), false)?;
    Ok(found.nearest.into_pyarray(a.py()))
}
