//! The program in the package.

use std::ffi::OsString;
use std::process::ExitCode;

use pyo3::prelude::*;

/// The program counts what its servo thread allocates.
#[global_allocator]
static ALLOCATOR: palpus_alloc::CountingAllocator = palpus_alloc::CountingAllocator;

/// Runs the program with these arguments, the first of which is its name, and returns its exit
/// status.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, argv: Vec<OsString>) -> u8 {
    let status = py.detach(|| palpus_cli::main(argv));
    (0..u8::MAX).find(|&number| ExitCode::from(number) == status).unwrap_or(u8::MAX)
}
