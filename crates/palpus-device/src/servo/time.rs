//! Clocks of the loop.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::safety::{Watch, watch_until_over};

/// A clock by which the loop waits.
pub trait LoopTime {
    /// Returns the time since a fixed origin. The clock should never run backwards, but the loop
    /// stays safe if the clock runs backwards.
    fn now(&self) -> Duration;

    /// Waits until `deadline`: sleeps until `spin` before it, then spins.
    fn wait_until(&self, deadline: Duration, spin: Duration);

    /// Returns how long the machine was suspended since a fixed origin; [`Self::now`] does not
    /// count this time. The result is never too long. The result is zero if the system does not
    /// report suspensions.
    fn suspended(&self) -> Duration {
        Duration::ZERO
    }

    /// Checks `watch` by this clock until the watch ends. A real clock starts a thread for the
    /// checks, and returns its handle.
    fn guard(&self, watch: Arc<Watch>) -> Option<JoinHandle<()>>;
}

/// The monotonic wall clock. Changes of the system's date do not affect it.
#[derive(Clone, Copy, Debug)]
pub struct WallTime {
    origin: Instant,
}

impl WallTime {
    /// Returns a clock that starts now.
    pub fn new() -> Self {
        Self { origin: Instant::now() }
    }
}

impl Default for WallTime {
    fn default() -> Self {
        Self::new()
    }
}

impl LoopTime for WallTime {
    fn now(&self) -> Duration {
        self.origin.elapsed()
    }

    fn wait_until(&self, deadline: Duration, spin: Duration) {
        let ahead = deadline.saturating_sub(self.now());
        if ahead > spin {
            std::thread::sleep(ahead - spin);
        }
        while self.now() < deadline {
            std::hint::spin_loop();
        }
    }

    #[cfg(target_os = "linux")]
    fn suspended(&self) -> Duration {
        use rustix::time::{ClockId, clock_gettime};
        let read = |clock| Duration::try_from(clock_gettime(clock)).unwrap_or_default();
        // Read in this order: if the thread is interrupted between the two reads, the result is too
        // small rather than too large.
        let boot = read(ClockId::Boottime);
        boot.saturating_sub(read(ClockId::Monotonic))
    }

    fn guard(&self, watch: Arc<Watch>) -> Option<JoinHandle<()>> {
        let origin = self.origin;
        let thread = std::thread::Builder::new().name("watchdog".to_owned());
        // If no thread can be started, the loop itself still notices after a stall that it was
        // late.
        thread.spawn(move || watch_until_over(&watch, origin)).ok()
    }
}

/// A clock for fast tests of real time. The clock stands still until [`LoopTime::wait_until`] or
/// [`VirtualTime::pass`] is called.
#[derive(Clone, Debug, Default)]
pub struct VirtualTime(Arc<Virtual>);

#[derive(Default)]
struct Virtual {
    now: AtomicU64,
    /// Total time for which the machine was suspended, ns.
    suspended: AtomicU64,
    /// The watchdog of each device of a loop.
    watches: Mutex<Vec<Arc<Watch>>>,
}

impl std::fmt::Debug for Virtual {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Virtual").field("now", &self.now).finish_non_exhaustive()
    }
}

/// Interval between two checks of the watchdogs in virtual time.
const VIRTUAL_CHECK: Duration = Duration::from_millis(1);

impl VirtualTime {
    /// Advances the clock by `duration`, and checks the watchdogs on the way.
    pub fn pass(&self, duration: Duration) {
        let mut left = duration;
        while left > Duration::ZERO {
            let part = left.min(VIRTUAL_CHECK);
            self.leap(part.as_nanos() as i64);
            let watches = self.0.watches.lock().unwrap_or_else(PoisonError::into_inner);
            for watch in watches.iter() {
                watch.check(self.now());
            }
            left -= part;
        }
    }

    /// Suspends the machine for `duration`. Only [`LoopTime::suspended`] shows this.
    pub fn suspend(&self, duration: Duration) {
        self.0.suspended.fetch_add(duration.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Makes the clock jump by `nanos` nanoseconds, forwards or backwards. The watchdogs are not
    /// checked.
    pub fn leap(&self, nanos: i64) {
        let now = self.0.now.load(Ordering::Relaxed);
        self.0.now.store(now.saturating_add_signed(nanos), Ordering::Relaxed);
    }
}

impl LoopTime for VirtualTime {
    fn now(&self) -> Duration {
        Duration::from_nanos(self.0.now.load(Ordering::Relaxed))
    }

    fn suspended(&self) -> Duration {
        Duration::from_nanos(self.0.suspended.load(Ordering::Relaxed))
    }

    fn wait_until(&self, deadline: Duration, _: Duration) {
        self.pass(deadline.saturating_sub(self.now()));
    }

    fn guard(&self, watch: Arc<Watch>) -> Option<JoinHandle<()>> {
        let mut watches = self.0.watches.lock().unwrap_or_else(PoisonError::into_inner);
        // A watch without another owner belongs to a run that is over.
        watches.retain(|watch| Arc::strong_count(watch) > 1);
        watches.push(watch);
        None
    }
}
