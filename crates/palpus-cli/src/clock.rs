//! The clock that the program passes to the engine.

use std::time::Instant;

use palpus::algebra::Clock;

/// The operating system's monotonic clock.
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
    fn now_ns(&self) -> u64 {
        self.origin.elapsed().as_nanos() as u64
    }
}
