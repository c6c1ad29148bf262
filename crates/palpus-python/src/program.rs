//! The command-line program in the package.

use std::ffi::OsString;
use std::process::ExitCode;

use pyo3::prelude::*;

/// Counts the allocations of the servo thread.
#[global_allocator]
static ALLOCATOR: palpus_alloc::CountingAllocator = palpus_alloc::CountingAllocator;

/// Runs the program with these arguments and returns its exit status. The first argument is the
/// program's name.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, argv: Vec<OsString>) -> u8 {
    let status = py.detach(|| palpus_cli::main(argv));
    (0..u8::MAX).find(|&number| ExitCode::from(number) == status).unwrap_or(u8::MAX)
}
