//! Signals that end a run properly: Ctrl-C, SIGTERM, and SIGHUP of a closed terminal.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Returns a flag that Ctrl-C (SIGINT), SIGTERM and SIGHUP set from now on. Closing a terminal
/// sends SIGHUP.
pub(crate) fn stop_at_signal() -> Arc<AtomicBool> {
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // Setting the handler fails if another handler exists. The run can go on without this handler;
    // a signal then ends the process.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    stop
}
