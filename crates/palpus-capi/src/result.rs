//! Results of functions: a code, and the text of the thread's last error.

use std::any::Any;
use std::cell::Cell;
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The result of a function. For all but PALPUS_OK, palpus_last_error has a text.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum palpus_result {
    /// Done.
    PalpusOk = 0,
    /// A pointer is NULL where it must not be, or not aligned for what it points to.
    PalpusErrorPointer = 1,
    /// A handle is of another kind, was destroyed, or never was one.
    PalpusErrorHandle = 2,
    /// Another thread is using the handle. Nothing was done.
    PalpusErrorBusy = 3,
    /// A number, size or text is not allowed.
    PalpusErrorValue = 4,
    /// The triangles or points make no body.
    PalpusErrorMesh = 5,
    /// A file cannot be read.
    PalpusErrorFile = 6,
    /// Header and library do not fit together.
    PalpusErrorAbi = 7,
    /// A defect of palpus. The handle that was in use can only be destroyed.
    PalpusErrorInternal = 8,
}

/// Why a function failed.
#[derive(Debug)]
pub(crate) struct Fault {
    code: palpus_result,
    text: String,
}

impl Fault {
    pub(crate) fn new(code: palpus_result, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }

    /// A number, size or text that is not allowed.
    pub(crate) fn value(text: impl Into<String>) -> Self {
        Self::new(palpus_result::PalpusErrorValue, text)
    }

    /// The same for one element or field of an argument.
    pub(crate) fn of(self, what: &str) -> Self {
        Self { text: format!("{what}: {}", self.text), ..self }
    }
}

impl From<palpus::SettingsError> for Fault {
    fn from(error: palpus::SettingsError) -> Self {
        Self::value(error.to_string())
    }
}

/// Bytes of the longest text, its end included; longer ones are cut.
const LONGEST_TEXT: usize = 1024;

thread_local! {
    static LAST: Cell<[u8; LONGEST_TEXT]> = const { Cell::new([0; LONGEST_TEXT]) };
}

/// Does what a function of the library does, and turns what came of it into a code.
pub(crate) fn entry(act: impl FnOnce() -> Result<(), Fault>) -> palpus_result {
    // A value that a panic left half changed stays locked: see `handle`.
    let fault = match catch_unwind(AssertUnwindSafe(act)) {
        Ok(Ok(())) => return palpus_result::PalpusOk,
        Ok(Err(fault)) => fault,
        Err(panic) => {
            let text = format!("palpus has a defect ({}); please report it", panic_text(&*panic));
            // Its destructor may panic as well.
            std::mem::forget(panic);
            Fault::new(palpus_result::PalpusErrorInternal, text)
        }
    };
    remember(&fault.text);
    fault.code
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("a panic without a text")
}

fn remember(text: &str) {
    let mut bytes = [0; LONGEST_TEXT];
    let fits = |end: &usize| *end < LONGEST_TEXT && text.is_char_boundary(*end);
    let end = (0..=text.len().min(LONGEST_TEXT)).rev().find(fits).unwrap_or(0);
    bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
    // A thread that is ending has no last error any more.
    let _ = LAST.try_with(|last| last.set(bytes));
}

/// Text of this thread's last error: UTF-8, empty if there was no error. Valid until the thread's
/// next error or its end; copy it to keep it. A function that succeeds leaves it unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_last_error() -> *const c_char {
    LAST.try_with(|last| last.as_ptr().cast_const().cast()).unwrap_or(c"".as_ptr())
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    fn last() -> &'static str {
        // SAFETY: the text ends with a zero and lives as long as the thread, which reads it before
        // its next error.
        unsafe { CStr::from_ptr(palpus_last_error()) }.to_str().unwrap()
    }

    #[test]
    fn panics_and_errors_become_codes() {
        assert_eq!(entry(|| Ok(())), palpus_result::PalpusOk);
        assert_eq!(last(), "");
        assert_eq!(entry(|| panic!("{} sides", 3)), palpus_result::PalpusErrorInternal);
        assert_eq!(last(), "palpus has a defect (3 sides); please report it");
        assert_eq!(entry(|| Err(Fault::value("ä".repeat(1000)))), palpus_result::PalpusErrorValue);
        assert_eq!(last(), "ä".repeat(511));
    }
}
