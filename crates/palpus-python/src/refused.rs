//! The exception of the package.

use std::fmt;

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, create_exception};

create_exception!(
    palpus,
    Error,
    PyValueError,
    "Invalid input or a failure. The text says what is wrong, where, and what to do."
);

/// Returns the exception with this text.
pub(crate) fn refused(text: impl fmt::Display) -> PyErr {
    Error::new_err(text.to_string())
}

/// Returns the exception with the text of an error and of its causes, as the program prints them.
pub(crate) fn failed(error: &dyn std::error::Error) -> PyErr {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text.push_str(": ");
        text.push_str(&error.to_string());
        cause = error.source();
    }
    refused(text)
}
