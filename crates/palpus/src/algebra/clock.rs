//! A clock that the caller provides. The engine reads no other clock.

use std::time::Instant;

/// Counts nanoseconds since any fixed instant. The engine uses only differences between two
/// readings: to report the time of each stage of a tick, and to keep a step within its time.
pub trait Clock {
    /// Returns the time since the fixed instant (ns). The value must not decrease.
    fn now_ns(&self) -> u64;

    /// Returns false if the clock always returns the same time.
    fn is_running(&self) -> bool {
        true
    }
}

/// The monotonic clock of the operating system: the clock of a loop in real time.
#[derive(Clone, Copy, Debug)]
pub struct WallClock {
    origin: Instant,
}

impl WallClock {
    /// Creates a clock that begins now.
    #[expect(clippy::new_without_default, reason = "a clock that begins when it is made has no default")]
    pub fn new() -> Self {
        Self { origin: Instant::now() }
    }
}

impl Clock for WallClock {
    #[inline]
    fn now_ns(&self) -> u64 {
        self.origin.elapsed().as_nanos() as u64
    }
}

/// A clock that always returns the same time: the clock of a simulation that may take any time. The
/// reported time of every stage is then zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoClock;

impl Clock for NoClock {
    #[inline]
    fn now_ns(&self) -> u64 {
        0
    }

    #[inline]
    fn is_running(&self) -> bool {
        false
    }
}

impl<C: Clock + ?Sized> Clock for &C {
    #[inline]
    fn now_ns(&self) -> u64 {
        (**self).now_ns()
    }

    #[inline]
    fn is_running(&self) -> bool {
        (**self).is_running()
    }
}
