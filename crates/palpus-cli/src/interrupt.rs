//! Signals that end a run properly: Ctrl-C, SIGTERM, and SIGHUP of a closed terminal.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that is set from now on by Ctrl-C (SIGINT), SIGTERM and SIGHUP, which closing a terminal
/// sends.
pub(crate) fn stop_at_signal() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // When there is a handler already, the signal simply ends the process; that is no reason not to
    // run.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    stop
}
