//! Holds back the messages of panics in a step while a force is on.
//!
//! A panic hook runs before the loop can catch the panic, and the usual one writes to the terminal,
//! which may take any time or wait for a reader. So the first loop of a program puts a hook before
//! the one that is there: it keeps quiet on a thread that is in a step, and leaves where the panic
//! was. The loop writes the wrench first; what the panic said stands in
//! [`RunStatistics::panic`](super::RunStatistics).

use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::sync::Once;
use std::thread::Result;

thread_local! {
    static IN_STEP: Cell<bool> = const { Cell::new(false) };
    /// Place of the last panic in a step.
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Puts the hook in place, once in a program.
pub(super) fn prepare() {
    static PREPARED: Once = Once::new();
    PREPARED.call_once(put_in_place);
}

/// Puts it before a hook that came later.
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

/// Returns the answer of `step`, or its panic.
pub(super) fn caught<T>(step: impl FnOnce() -> T) -> Result<T> {
    IN_STEP.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(step));
    IN_STEP.set(false);
    outcome
}

/// Message and place of a panic that was just caught.
pub(super) fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    let text = text.unwrap_or("a panic without a message");
    // A payload that was thrown without a panic has no place.
    let place = PLACE.take();
    if place.is_empty() { text.to_owned() } else { format!("{text} (at {place})") }
}
