//! Whose clock the loop goes by.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::safety::{Watch, watch_until_over};

/// A clock that the loop waits by.
pub trait LoopTime {
    /// Since some beginning. Meant never to run backwards; the loop survives it when it does.
    fn now(&self) -> Duration;

    /// Returns not before `deadline`: sleeps until `spin` before it, then spins.
    fn wait_until(&self, deadline: Duration, spin: Duration);

    /// For how long the machine has been suspended since some beginning, which [`Self::now`] does
    /// not count. Never too long; zero where the system does not say.
    fn suspended(&self) -> Duration {
        Duration::ZERO
    }

    /// Has `watch` checked by this clock until it is over, by a thread that is answered or by other
    /// means.
    fn guard(&self, watch: Arc<Watch>) -> Option<JoinHandle<()>>;
}

/// The clock on the wall: monotonic, and what the system's own hands do to the date does not reach
/// it.
#[derive(Clone, Copy, Debug)]
pub struct WallTime {
    origin: Instant,
}

impl WallTime {
    /// Begins now.
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
        // In this order, so that a pause between the two makes the answer smaller and not larger.
        let boot = read(ClockId::Boottime);
        boot.saturating_sub(read(ClockId::Monotonic))
    }

    fn guard(&self, watch: Arc<Watch>) -> Option<JoinHandle<()>> {
        let origin = self.origin;
        let thread = std::thread::Builder::new().name("watchdog".to_owned());
        // Without a thread to spare the loop still notices by itself that it was late.
        thread.spawn(move || watch_until_over(&watch, origin)).ok()
    }
}

/// A clock for tests of real time that take none: it stands still until someone waits or
/// [`VirtualTime::pass`] is called.
#[derive(Clone, Debug, Default)]
pub struct VirtualTime(Arc<Virtual>);

#[derive(Default)]
struct Virtual {
    now: AtomicU64,
    /// ns.
    suspended: AtomicU64,
    /// One for each device of a loop.
    watches: Mutex<Vec<Arc<Watch>>>,
}

impl std::fmt::Debug for Virtual {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Virtual").field("now", &self.now).finish_non_exhaustive()
    }
}

/// The watchdog of virtual time looks this often.
const VIRTUAL_CHECK: Duration = Duration::from_millis(1);

impl VirtualTime {
    /// Time goes by, and the watchdog looks at it as it does.
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

    /// Suspends the machine for this long; only the clock that counts suspension notices.
    pub fn suspend(&self, duration: Duration) {
        self.0.suspended.fetch_add(duration.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Lets the clock jump by so many ns, forwards or backwards, between reads.
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
        // Watches without another owner belong to a run that is over.
        watches.retain(|watch| Arc::strong_count(watch) > 1);
        watches.push(watch);
        None
    }
}
