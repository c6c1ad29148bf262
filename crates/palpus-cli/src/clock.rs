//! The clock that the program lends to the engine.

use std::time::Instant;

use palpus::algebra::Clock;

/// The operating system's monotonic clock.
pub(crate) struct WallClock {
    origin: Instant,
}

impl WallClock {
    /// A clock that begins now.
    pub(crate) fn new() -> Self {
        Self { origin: Instant::now() }
    }
}

impl Clock for WallClock {
    fn now_ns(&self) -> u64 {
        self.origin.elapsed().as_nanos() as u64
    }
}
