//! Contacts and distances at many poses, with the same results as `palpus query`.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::{IntoPyArray, PyArray1};
use palpus::algebra::tolerance::TOLERANCE_SHARE;
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

/// Maximum number of contacts at one pose. The program uses the same value.
const CAPACITY: usize = 1 << 16;

/// Input of a batch.
struct Asked<'a> {
    a: &'a Arc<palpus::Body>,
    b: &'a Arc<palpus::Body>,
    poses: Vec<Pose>,
    settings: QuerySettings,
    threads: Threads,
}

/// Result of one run of consecutive poses.
#[derive(Default)]
struct Found {
    nearest: Vec<DistanceRow>,
    contacts: Vec<ContactRow>,
    /// Number of contacts beyond the capacity.
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
            None => TOLERANCE_SHARE * a.size().min(b.size()),
        };
        let proof = if prove { Proof::Prove } else { Proof::None };
        let settings = QuerySettings { tolerance, capacity: CAPACITY, proof, ..QuerySettings::default() };
        Ok(Self { a, b, poses: poses("poses", given)?, settings, threads: threads(workers)? })
    }

    /// Computes the results of all poses. Contacts are omitted unless `keep` is true.
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
                "{} contacts beyond {CAPACITY} at one pose were left out; a smaller tolerance gives fewer\0",
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
            // A distance is proven by the planes through its nearest points. Depths without a proof
            // are counted.
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

/// Returns the nearest points and all contacts at each pose: the results of `distance` and
/// `contacts`, computed in one pass.
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

/// Returns all contacts with a separation below `tolerance` at each pose (N, 7) of a in b's frame:
/// an array of CONTACT, in b's frame.
///
/// `point_a - point_b = separation * normal`. `separation` is negative where convex pieces overlap:
/// minus the penetration depth. The default tolerance is 1 % of the smaller body's size. Unless
/// `prove` is False, each depth is proven to be the smallest depth of its two pieces. `workers` is
/// the number of threads (default: all cores). The number of threads does not change the results.
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

/// Returns the nearest points at each pose (N, 7) of a in b's frame: an array (N,) of DISTANCE. If
/// the bodies overlap, it contains the deepest contact.
///
/// `contacts` is the number of contacts within `tolerance`; the tolerance has no other effect. The
/// other arguments are the same as for `contacts`.
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
