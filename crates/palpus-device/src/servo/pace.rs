//! Waits for the next tick.

use std::time::Duration;

use super::Timing;
use super::punctuality::Punctuality;
use super::time::LoopTime;

/// Timing of the start of a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    /// Time from the deadline to the start.
    pub(super) lateness: Duration,
    /// Time since the last tick began; `None` for the first tick and in simulated time.
    pub(super) period: Option<Duration>,
    /// Number of whole periods without a tick before this tick.
    pub(super) skipped: u64,
}

impl Start {
    /// Returns the time since the last tick began, s; `nominal` for the first tick and in simulated
    /// time.
    pub(super) fn elapsed(&self, nominal: f64) -> f64 {
        self.period.map_or(nominal, |period| period.as_secs_f64())
    }
}

/// Deadlines of the ticks.
#[derive(Debug)]
pub(super) struct Pace {
    timing: Timing,
    begin: Duration,
    period: Duration,
    spin: Duration,
    /// Deadline of the next tick.
    deadline: Duration,
    last: Option<Duration>,
    punctuality: Punctuality,
}

impl Pace {
    pub(super) fn start(timing: Timing, period: f64, spin: Duration, time: &dyn LoopTime) -> Self {
        let begin = time.now();
        let punctuality = Punctuality::new(period);
        let period = Duration::from_secs_f64(period);
        // A thread that only spins never releases its core, and the kernel may then suspend it for
        // a while. So the loop always sleeps for at least half a period.
        let spin = spin.min(period / 2);
        Self { timing, begin, period, spin, deadline: begin, last: None, punctuality }
    }

    /// Waits until the next tick is due.
    pub(super) fn wait(&mut self, time: &dyn LoopTime) -> Start {
        if self.timing == Timing::Simulated {
            return Start { lateness: Duration::ZERO, period: None, skipped: 0 };
        }
        // If the clock ran backwards, the deadline could be far ahead and the force would be held
        // for too long. So the deadline is at most one period ahead.
        self.deadline = self.deadline.min(time.now() + self.period);
        time.wait_until(self.deadline, self.spin);
        let now = time.now();
        let lateness = now.saturating_sub(self.deadline);
        // Skips the whole periods that are already over, and keeps the phase.
        let skipped = (lateness.as_nanos() / self.period.as_nanos()) as u64;
        let behind = Duration::from_nanos((self.period.as_nanos() as u64).saturating_mul(skipped + 1));
        self.deadline += behind;
        let period = self.last.map(|last| now.saturating_sub(last));
        self.last = Some(now);
        self.punctuality.begin(period.unwrap_or_default().as_secs_f64());
        if skipped > 0 {
            self.punctuality.is_late();
        }
        Start { lateness, period, skipped }
    }

    /// Continues after a pause that began at `since`. The next tick is due now, and the pause is
    /// not counted.
    pub(super) fn resume(&mut self, since: Duration, time: &dyn LoopTime) {
        let now = time.now();
        self.begin += now.saturating_sub(since);
        self.deadline = now;
        self.last = None;
        self.punctuality.clear();
    }

    /// Returns true if the deadline of the next tick has passed already. The next tick then counts
    /// as late.
    pub(super) fn is_overrun(&mut self, time: &dyn LoopTime) -> bool {
        let overrun = self.timing == Timing::RealTime && time.now() > self.deadline;
        if overrun {
            self.punctuality.is_late();
        }
        overrun
    }

    /// Returns true while too many ticks are late, including the current one if it is late now.
    pub(super) fn is_lost(&mut self, time: &dyn LoopTime) -> bool {
        self.is_overrun(time);
        self.punctuality.is_lost()
    }

    pub(super) fn elapsed(&self, time: &dyn LoopTime) -> Duration {
        time.now().saturating_sub(self.begin)
    }
}
