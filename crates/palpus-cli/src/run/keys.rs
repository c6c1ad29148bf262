//! Keys at the terminal of a run without a window.

use std::io::{IsTerminal, stdin};
use std::sync::Arc;

use palpus_device::RunControl;

/// Lets a person enable the force of a latched device with `r` and Enter.
pub(super) fn take(control: Arc<RunControl>) {
    if !stdin().is_terminal() {
        return;
    }
    // This thread is never joined: it may block in a read until the program ends.
    std::thread::spawn(move || {
        if !is_left_alone() {
            return;
        }
        let lines = stdin().lines().map_while(Result::ok);
        lines.filter(|line| line.trim() == "r").for_each(|_| control.rearm());
    });
}

/// Makes a read fail if a shell runs the program in the background. Otherwise the terminal would
/// stop the program, and the loop with it.
#[cfg(unix)]
fn is_left_alone() -> bool {
    use nix::sys::signal::{SigSet, Signal};
    let mut asked = SigSet::empty();
    asked.add(Signal::SIGTTIN);
    asked.thread_block().is_ok()
}

#[cfg(not(unix))]
fn is_left_alone() -> bool {
    true
}
