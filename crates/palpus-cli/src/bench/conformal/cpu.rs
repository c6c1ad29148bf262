//! Processor time of the calling thread.

use palpus::algebra::Clock;

/// The thread's processor time, or wall-clock time on systems without such a clock.
pub(super) struct CpuClock {
    #[cfg(not(unix))]
    wall: palpus::WallClock,
}

#[cfg(unix)]
impl CpuClock {
    pub(super) fn new() -> Self {
        Self {}
    }
}

#[cfg(unix)]
impl Clock for CpuClock {
    fn now_ns(&self) -> u64 {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
    }
}

#[cfg(not(unix))]
impl CpuClock {
    pub(super) fn new() -> Self {
        Self { wall: palpus::WallClock::new() }
    }
}

#[cfg(not(unix))]
impl Clock for CpuClock {
    fn now_ns(&self) -> u64 {
        self.wall.now_ns()
    }
}
