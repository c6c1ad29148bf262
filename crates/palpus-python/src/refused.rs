//! The exception of the package.

use std::fmt;

use pyo3::exceptions::PyValueError;
use pyo3::{PyErr, create_exception};

create_exception!(palpus, Error, PyValueError, "Something that palpus cannot use: what, where and what to do.");

/// The exception with this text.
pub(crate) fn refused(text: impl fmt::Display) -> PyErr {
    Error::new_err(text.to_string())
}

/// The exception with an error's text and those of its causes, as the program prints them.
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
