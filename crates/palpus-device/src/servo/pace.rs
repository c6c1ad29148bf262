//! Waiting for the next tick.

use std::time::{Duration, Instant};

use super::Timing;

/// How a tick began.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Behind the deadline.
    pub(super) lateness: Duration,
    /// Since the last tick began; `None` for the first one and in simulated time.
    pub(super) period: Option<Duration>,
    /// Whole periods that went by without a tick before this one.
    pub(super) skipped: u64,
}

#[derive(Debug)]
pub(super) struct Pace {
    timing: Timing,
    begin: Instant,
    period: Duration,
    spin: Duration,
    /// Of the tick that is waited for next.
    deadline: Instant,
    last: Option<Instant>,
}

impl Pace {
    pub(super) fn start(timing: Timing, period: f64, spin: Duration) -> Self {
        let begin = Instant::now();
        Self { timing, begin, period: Duration::from_secs_f64(period), spin, deadline: begin, last: None }
    }

    /// Returns when the next tick is due: sleeps until shortly before its deadline, then spins.
    pub(super) fn wait(&mut self) -> Start {
        if self.timing == Timing::Simulated {
            return Start { lateness: Duration::ZERO, period: None, skipped: 0 };
        }
        let ahead = self.deadline.saturating_duration_since(Instant::now());
        if ahead > self.spin {
            std::thread::sleep(ahead - self.spin);
        }
        let mut now = Instant::now();
        while now < self.deadline {
            std::hint::spin_loop();
            now = Instant::now();
        }
        let lateness = now - self.deadline;
        // Whole periods that are already over are skipped, keeping the phase.
        let skipped = (lateness.as_nanos() / self.period.as_nanos()) as u64;
        let behind = Duration::from_nanos(self.period.as_nanos() as u64 * (skipped + 1));
        self.deadline += behind;
        let period = self.last.map(|last| now - last);
        self.last = Some(now);
        Start { lateness, period, skipped }
    }

    /// True when the next tick's deadline has passed already.
    pub(super) fn is_overrun(&self) -> bool {
        self.timing == Timing::RealTime && Instant::now() > self.deadline
    }

    pub(super) fn elapsed(&self) -> Duration {
        self.begin.elapsed()
    }
}
