//! The threads of a batch, and the handling of Ctrl-C.

use std::sync::atomic::{AtomicBool, Ordering};

use palpus_io::Threads;
use pyo3::prelude::*;

use crate::refused::refused;

/// Returns the threads for the argument `workers`; without the argument, one thread per core.
pub(crate) fn threads(workers: Option<usize>) -> PyResult<Threads> {
    match workers {
        None => Ok(Threads::all()),
        Some(0) => Err(refused("workers is 0, but must be 1 or more; omit it to use all cores")),
        Some(count) => Ok(Threads::of(count)),
    }
}

/// Runs `work` while other Python threads can run. Ctrl-C ends the work early.
///
/// `work` gets a flag that requests a stop, and a function that `work` must call regularly on the
/// calling thread.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool, &mut dyn FnMut(f64)) -> T + Send,
) -> PyResult<T> {
    py.detach(|| {
        let (stop, mut raised) = (AtomicBool::new(false), None);
        let answer = work(&stop, &mut |_| {
            if raised.is_none() {
                raised = Python::attach(|py| py.check_signals()).err();
                stop.store(raised.is_some(), Ordering::Relaxed);
            }
        });
        raised.map_or(Ok(answer), Err)
    })
}
