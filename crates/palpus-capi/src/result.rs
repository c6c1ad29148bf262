//! Results of functions: a code, and the text of the thread's last error.

use std::any::Any;
use std::cell::Cell;
use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The result of a function. After any code except PALPUS_OK, palpus_last_error returns a text.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum palpus_result {
    /// Success.
    PalpusOk = 0,
    /// A pointer is NULL where it must not be, or is not aligned for its type.
    PalpusErrorPointer = 1,
    /// A handle is of another kind, was destroyed, or was never valid.
    PalpusErrorHandle = 2,
    /// Another thread is using the handle. Nothing was done.
    PalpusErrorBusy = 3,
    /// A number, size or text is not allowed.
    PalpusErrorValue = 4,
    /// The triangles or points do not form a body.
    PalpusErrorMesh = 5,
    /// A file cannot be read.
    PalpusErrorFile = 6,
    /// The header and the library have different ABI versions.
    PalpusErrorAbi = 7,
    /// A defect of palpus. The handle in use can only be destroyed.
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

    /// Returns a fault for a number, size or text that is not allowed.
    pub(crate) fn value(text: impl Into<String>) -> Self {
        Self::new(palpus_result::PalpusErrorValue, text)
    }

    /// Returns the same fault with the name of an argument's element or field in front.
    pub(crate) fn of(self, what: &str) -> Self {
        Self { text: format!("{what}: {}", self.text), ..self }
    }
}

impl From<palpus::SettingsError> for Fault {
    fn from(error: palpus::SettingsError) -> Self {
        Self::value(error.to_string())
    }
}

/// Maximum number of bytes of a text, including the final zero. Longer texts are cut.
const LONGEST_TEXT: usize = 1024;

thread_local! {
    static LAST: Cell<[u8; LONGEST_TEXT]> = const { Cell::new([0; LONGEST_TEXT]) };
}

/// Runs the body of a library function, and converts its outcome to a code.
pub(crate) fn entry(act: impl FnOnce() -> Result<(), Fault>) -> palpus_result {
    // A value that a panic left half changed stays locked: see `handle`.
    let fault = match catch_unwind(AssertUnwindSafe(act)) {
        Ok(Ok(())) => return palpus_result::PalpusOk,
        Ok(Err(fault)) => fault,
        Err(panic) => {
            let text = format!("palpus has a defect ({}); please report it", panic_text(&*panic));
            // The destructor of the panic value may panic too.
            std::mem::forget(panic);
            Fault::new(palpus_result::PalpusErrorInternal, text)
        }
    };
    remember(&fault.text);
    fault.code
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic without a message")
}

fn remember(text: &str) {
    let mut bytes = [0; LONGEST_TEXT];
    let fits = |end: &usize| *end < LONGEST_TEXT && text.is_char_boundary(*end);
    let end = (0..=text.len().min(LONGEST_TEXT)).rev().find(fits).unwrap_or(0);
    bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
    // A thread that is ending no longer has a last error.
    let _ = LAST.try_with(|last| last.set(bytes));
}

/// Returns the text of this thread's last error: UTF-8, empty if there was no error. The text is
/// valid until the thread's next error or the end of the thread; copy the text to keep it. A
/// function that succeeds leaves the text unchanged.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_last_error() -> *const c_char {
    LAST.try_with(|last| last.as_ptr().cast_const().cast()).unwrap_or(c"".as_ptr())
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    fn last() -> &'static str {
        // SAFETY: the text ends with a zero and lives as long as the thread. The thread reads the
        // text before its next error.
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
