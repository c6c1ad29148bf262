//! Bindings to the makers' libraries; the only folder with `unsafe`.
//!
//! A library is opened, every function that is needed is looked up once, and each of them gets a
//! safe method that says in its `SAFETY` line why the call is sound. Declarations are written by
//! hand after the makers' published manuals; none of their files is used. Results are judged by the
//! callers.

pub(crate) mod dhd;
pub(crate) mod hd;

use std::ffi::{CStr, CString, c_char};
use std::path::{Path, PathBuf};

use crate::error::DriverError;

/// An open library.
pub(crate) struct Loaded {
    library: libloading::Library,
    path: PathBuf,
}

/// Opens the library at `path`, or of that name. The reason why it cannot be is in the system's
/// words.
pub(crate) fn load(path: &Path) -> Result<Loaded, String> {
    // SAFETY: opening a library runs its initialisers, which are code of others. It is one that the
    // user has installed or named for this purpose; the user's trust in it is what using the device
    // means.
    match unsafe { libloading::Library::new(path) } {
        Ok(library) => Ok(Loaded { library, path: path.to_owned() }),
        Err(error) => Err(std::error::Error::source(&error).map_or(error.to_string(), ToString::to_string)),
    }
}

impl Loaded {
    /// The function `name`.
    ///
    /// # Safety
    /// `F` must be the type of a pointer to that function as the library has it, and what is
    /// returned must not outlive `self`.
    unsafe fn function<F: Copy>(&self, name: &'static str, mend: &str) -> Result<F, DriverError> {
        // SAFETY: the caller answers for the type.
        unsafe { self.optional(name) }.ok_or_else(|| DriverError::SymbolMissing {
            path: self.path.clone(),
            symbol: name,
            mend: mend.to_owned(),
        })
    }

    /// The function `name` of a library that may be too old to have it.
    ///
    /// # Safety
    /// As [`Loaded::function`].
    unsafe fn optional<F: Copy>(&self, name: &'static str) -> Option<F> {
        let name = CString::new(name).ok()?;
        // SAFETY: the caller answers for the type.
        unsafe { self.library.get::<F>(name.as_bytes_with_nul()) }.ok().map(|symbol| *symbol)
    }
}

/// Text returned by a library; empty for a null pointer.
///
/// # Safety
/// `text` is null or ends with a zero byte and stays as it is during the call.
unsafe fn words(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: the caller answers for it.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().trim().to_owned()
}
