//! The watchdog: takes the force from the device when the loop does not answer any more.
//!
//! The loop *beats* whenever it has written a wrench, and *rests* after a zero wrench, which may be
//! held without limit. [`Watch::check`] is called by a thread with no other task; when the last
//! beat is longer ago than a wrench may be held, it applies the device's [`Brake`]. A
//! loop that still runs then finds the brake applied, counts a fault and releases it only when it
//! is engaged again.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::device::Brake;

/// Checks in the time that a wrench may be held.
const CHECKS: u32 = 4;

/// The beat of a loop that rests: later than any.
const RESTING: u64 = u64::MAX;

/// State that the loop and the watchdog share.
pub struct Watch {
    brake: Arc<dyn Brake>,
    /// ns for which a wrench may be held.
    stall: u64,
    /// ns of the loop's time at the last beat, or [`RESTING`].
    beat: AtomicU64,
    over: AtomicBool,
}

impl Watch {
    /// A watch over a loop that rests so far, and beats at least every `stall` while it does not.
    pub fn new(brake: Arc<dyn Brake>, stall: Duration) -> Self {
        Self { brake, stall: nanos(stall), beat: AtomicU64::new(RESTING), over: AtomicBool::new(false) }
    }

    /// A wrench was written at `now`.
    pub fn beat(&self, now: Duration) {
        self.beat.store(nanos(now), Ordering::Release);
    }

    /// Zero was written: it may be held without limit.
    pub fn rest(&self) {
        self.beat.store(RESTING, Ordering::Release);
    }

    /// Applies the brake if the last beat was too long before `now`.
    pub fn check(&self, now: Duration) {
        let held = nanos(now).saturating_sub(self.beat.load(Ordering::Acquire));
        if held > self.stall && !self.is_over() {
            self.brake.apply();
        }
    }

    /// There are no more beats to come, and none is missed.
    pub fn end(&self) {
        self.over.store(true, Ordering::Release);
    }

    /// True after the end.
    pub fn is_over(&self) -> bool {
        self.over.load(Ordering::Acquire)
    }

    /// How often to check.
    fn interval(&self) -> Duration {
        Duration::from_nanos(self.stall) / CHECKS
    }
}

/// The watchdog's thread: checks against the wall's time since `origin` until the watch is over.
pub(crate) fn watch_until_over(watch: &Watch, origin: Instant) {
    // The loop reported its rights when it made its claims; this repeats them.
    let _ = crate::realtime::outrank();
    while !watch.is_over() {
        std::thread::park_timeout(watch.interval());
        watch.check(origin.elapsed());
    }
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
