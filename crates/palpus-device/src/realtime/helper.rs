//! A thread that helps a loop with close-fitting contact.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, available_parallelism};
use std::time::{Duration, Instant};

use palpus::detect::Helper;

use super::{RealTimeClaims, leave_core, system};

/// A machine needs this many cores for a helper thread: one for the loop, one for the helper, and
/// the rest for everything else.
const CORES: usize = 4;

/// How long the thread polls without sleeping after the last work. Within a step, work comes again
/// after some microseconds.
const POLLING: Duration = Duration::from_micros(100);

/// How long the thread sleeps between two polls while steps have much work, and otherwise. The loop
/// cannot wake the thread, since that is a call of the system.
const NAPS: [Duration; 2] = [Duration::from_micros(50), Duration::from_millis(1)];

/// How long after the last work the thread still takes short naps.
const SHORT_NAPS: Duration = Duration::from_millis(200);

/// A thread that takes part in the steps of a loop. It ends when this value is dropped.
#[derive(Debug)]
pub struct HelperThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl HelperThread {
    /// Starts a thread for `helper`, with the loop's `priority`
    /// ([`RealTimeOptions`](super::RealTimeOptions)), on the cores that the loop does not have.
    /// `claims` are those of the loop's thread. Returns `None` if the helper has nothing to do, if
    /// the machine has fewer than four cores, or if the system starts no thread.
    ///
    /// Call this from a thread that is not pinned to a core, after the loop's thread has made its
    /// claims.
    pub fn start(helper: Helper, priority: Option<u8>, claims: Option<&RealTimeClaims>) -> Option<Self> {
        let cores = available_parallelism().map_or(1, usize::from);
        if cores < CORES { None } else { Self::start_anyway(helper, priority, claims) }
    }

    /// Does the same on a machine with any number of cores.
    pub fn start_anyway(helper: Helper, priority: Option<u8>, claims: Option<&RealTimeClaims>) -> Option<Self> {
        if !helper.is_useful() {
            return None;
        }
        let stop = Arc::new(AtomicBool::new(false));
        let (stopped, claims) = (Arc::clone(&stop), claims.cloned());
        let work = move || {
            if let Some(claims) = &claims {
                leave_core(claims);
            }
            if let Some(priority) = priority {
                // Without the priority the thread helps too, but may be late.
                system::claim_priority(priority);
            }
            help(&helper, &stopped);
        };
        let thread = std::thread::Builder::new().name("helper".to_owned()).spawn(work).ok()?;
        Some(Self { stop, thread: Some(thread) })
    }
}

impl Drop for HelperThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // If the helper panicked, so did the loop's step, and the loop has reported it.
            let _ = thread.join();
        }
    }
}

/// Helps until `stop` is set.
fn help(helper: &Helper, stop: &AtomicBool) {
    let mut last = Instant::now();
    while !stop.load(Ordering::Relaxed) {
        if helper.help() {
            last = Instant::now();
            continue;
        }
        let idle = last.elapsed();
        if idle < POLLING {
            std::hint::spin_loop();
        } else {
            std::thread::sleep(NAPS[usize::from(idle > SHORT_NAPS)]);
        }
    }
}
