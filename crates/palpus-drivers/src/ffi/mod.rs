//! Bindings to the makers' libraries. No other folder of this crate has `unsafe`.
//!
//! A library is loaded, and every function that is needed is looked up once. Each function gets a
//! safe method, whose `SAFETY` comment says why the call is sound. The declarations are written by
//! hand from the makers' published manuals; none of the makers' files is used. The callers check
//! the results.

pub(crate) mod dhd;
pub(crate) mod hd;

use std::ffi::{CStr, CString, c_char};
use std::path::{Path, PathBuf};

use crate::error::DriverError;

/// A loaded library.
pub(crate) struct Loaded {
    library: libloading::Library,
    path: PathBuf,
}

/// Loads the library at `path`, or the library with that name. The error is the system's message.
pub(crate) fn load(path: &Path) -> Result<Loaded, String> {
    // SAFETY: loading a library runs its initialisers, which are foreign code. The user has
    // installed or named the library for this purpose, and must trust it to use the device.
    match unsafe { libloading::Library::new(path) } {
        Ok(library) => Ok(Loaded { library, path: path.to_owned() }),
        Err(error) => Err(std::error::Error::source(&error).map_or(error.to_string(), ToString::to_string)),
    }
}

impl Loaded {
    /// Returns the function `name`.
    ///
    /// # Safety
    /// `F` must be the type of a pointer to that function in the library. The result must not
    /// outlive `self`.
    unsafe fn function<F: Copy>(&self, name: &'static str, mend: &str) -> Result<F, DriverError> {
        // SAFETY: the caller guarantees the type.
        unsafe { self.optional(name) }.ok_or_else(|| DriverError::SymbolMissing {
            path: self.path.clone(),
            symbol: name,
            mend: mend.to_owned(),
        })
    }

    /// Returns the function `name`. `None` if the library is too old to have this function.
    ///
    /// # Safety
    /// As [`Loaded::function`].
    unsafe fn optional<F: Copy>(&self, name: &'static str) -> Option<F> {
        let name = CString::new(name).ok()?;
        // SAFETY: the caller guarantees the type.
        unsafe { self.library.get::<F>(name.as_bytes_with_nul()) }.ok().map(|symbol| *symbol)
    }
}

/// Returns a text from a library. Empty for a null pointer.
///
/// # Safety
/// `text` is null, or ends with a zero byte and does not change during the call.
unsafe fn words(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: the caller guarantees the conditions above.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().trim().to_owned()
}
