//! The watchdog: removes the device's force when the loop stops responding.
//!
//! The loop *beats* whenever it has written a wrench. The loop *rests* after a zero wrench, which
//! may be held without limit. A separate thread calls [`Watch::check`]. If the last beat is older
//! than the longest time for which a wrench may be held, the check applies the device's [`Brake`].
//! A loop that still runs then finds the brake applied, counts a fault, and releases the brake only
//! when the device is engaged again.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::device::Brake;

/// Number of checks during the longest time for which a wrench may be held.
const CHECKS: u32 = 4;

/// Beat of a resting loop, which is never too old.
const RESTING: u64 = u64::MAX;

/// State that the loop and the watchdog share.
pub struct Watch {
    brake: Arc<dyn Brake>,
    /// Longest time for which a wrench may be held, ns.
    stall: u64,
    /// Time of the last beat by the loop's clock, ns, or [`RESTING`].
    beat: AtomicU64,
    over: AtomicBool,
}

impl Watch {
    /// Returns a watch over a loop that rests at first. While the loop runs, its beats must be at
    /// most `stall` apart.
    pub fn new(brake: Arc<dyn Brake>, stall: Duration) -> Self {
        Self { brake, stall: nanos(stall), beat: AtomicU64::new(RESTING), over: AtomicBool::new(false) }
    }

    /// Records that a wrench was written at `now`.
    pub fn beat(&self, now: Duration) {
        self.beat.store(nanos(now), Ordering::Release);
    }

    /// Records that zero was written, which may be held without limit.
    pub fn rest(&self) {
        self.beat.store(RESTING, Ordering::Release);
    }

    /// Applies the brake if the last beat is too old at `now`.
    pub fn check(&self, now: Duration) {
        let held = nanos(now).saturating_sub(self.beat.load(Ordering::Acquire));
        if held > self.stall && !self.is_over() {
            self.brake.apply();
        }
    }

    /// Ends the watch: no more beats are expected.
    pub fn end(&self) {
        self.over.store(true, Ordering::Release);
    }

    /// Returns true after [`Self::end`].
    pub fn is_over(&self) -> bool {
        self.over.load(Ordering::Acquire)
    }

    /// Returns the time between two checks.
    fn interval(&self) -> Duration {
        Duration::from_nanos(self.stall) / CHECKS
    }
}

/// Runs the watchdog thread: checks the watch by the wall clock since `origin`, until the watch is
/// over.
pub(crate) fn watch_until_over(watch: &Watch, origin: Instant) {
    // The result is ignored, since `claim` has already reported whether this succeeds.
    let _ = crate::realtime::outrank();
    while !watch.is_over() {
        std::thread::park_timeout(watch.interval());
        watch.check(origin.elapsed());
    }
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
