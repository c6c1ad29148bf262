//! Waiting for the next tick.

use std::time::Duration;

use super::Timing;
use super::punctuality::Punctuality;
use super::time::LoopTime;

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

impl Start {
    /// Seconds since the last tick began: `nominal` for the first one and in simulated time.
    pub(super) fn elapsed(&self, nominal: f64) -> f64 {
        self.period.map_or(nominal, |period| period.as_secs_f64())
    }
}

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
        // A fast loop that only spun would never release its core; kernels take it away from such
        // threads now and then.
        let spin = spin.min(period / 2);
        Self { timing, begin, period, spin, deadline: begin, last: None, punctuality }
    }

    /// Returns when the next tick is due.
    pub(super) fn wait(&mut self, time: &dyn LoopTime) -> Start {
        if self.timing == Timing::Simulated {
            return Start { lateness: Duration::ZERO, period: None, skipped: 0 };
        }
        // A deadline is never more than a period ahead, unless the clock ran backwards: the force
        // must not be held for so long.
        self.deadline = self.deadline.min(time.now() + self.period);
        time.wait_until(self.deadline, self.spin);
        let now = time.now();
        let lateness = now.saturating_sub(self.deadline);
        // Whole periods that are already over are skipped, keeping the phase.
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

    /// Goes on after a pause since `since`: the next tick is due now, and the pause does not count.
    pub(super) fn resume(&mut self, since: Duration, time: &dyn LoopTime) {
        let now = time.now();
        self.begin += now.saturating_sub(since);
        self.deadline = now;
        self.last = None;
        self.punctuality.forget();
    }

    /// True when the next tick's deadline has passed already, which makes this one late.
    pub(super) fn is_overrun(&mut self, time: &dyn LoopTime) -> bool {
        let overrun = self.timing == Timing::RealTime && time.now() > self.deadline;
        if overrun {
            self.punctuality.is_late();
        }
        overrun
    }

    /// True while too many ticks are late, up to this one and this moment.
    pub(super) fn is_lost(&mut self, time: &dyn LoopTime) -> bool {
        self.is_overrun(time);
        self.punctuality.is_lost()
    }

    pub(super) fn elapsed(&self, time: &dyn LoopTime) -> Duration {
        time.now().saturating_sub(self.begin)
    }
}
