//! Delays the message of a panic in a step until the wrench is zero.
//!
//! A panic hook runs before the loop can catch the panic. The default hook writes to the terminal,
//! which may block for any time. So the first loop of a program installs a hook in front of the
//! existing hook. On a thread that is in a step, this hook prints nothing and stores the place of
//! the panic. The loop writes the wrench first; the message is in
//! [`RunStatistics::panic`](super::RunStatistics).

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;
use std::thread::Result;

thread_local! {
    static IN_STEP: Cell<bool> = const { Cell::new(false) };
    /// Source location of the last panic in a step.
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Installs the hook, once per program.
pub(super) fn prepare() {
    static PREPARED: Once = Once::new();
    PREPARED.call_once(put_in_place);
}

/// Installs the hook again, in front of a hook that was installed later.
#[cfg(test)]
pub(super) fn prepare_anew() {
    put_in_place();
}

fn put_in_place() {
    let before = take_hook();
    set_hook(Box::new(move |panic: &PanicHookInfo<'_>| {
        if IN_STEP.get() {
            PLACE.set(panic.location().map(ToString::to_string).unwrap_or_default());
        } else {
            before(panic);
        }
    }));
}

/// Runs `step` and returns its result, or its panic.
pub(super) fn caught<T>(step: impl FnOnce() -> T) -> Result<T> {
    IN_STEP.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(step));
    IN_STEP.set(false);
    outcome
}

/// Returns the message and the source location of a panic that was just caught.
pub(super) fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    let text = text.unwrap_or("a panic without a message");
    // `resume_unwind` runs no hook, so its payload has no location.
    let place = PLACE.take();
    if place.is_empty() { text.to_owned() } else { format!("{text} (at {place})") }
}
