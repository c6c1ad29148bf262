//! Timing jitter of a servo loop.
//!
//! 1. The rate drifts: each second has a mean rate and a scatter, and the mean changes linearly
//!    from one second to the next.
//! 2. Each period differs from the mean by a random amount with a triangular distribution.
//! 3. Sometimes a tick is late, and the next tick comes earlier to catch up.
//!
//! The same seed gives the same periods.

use palpus::algebra::Random;

/// Timing jitter of a servo loop, relative to its nominal period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter {
    /// Largest deviation of the mean rate of a second, relative to the nominal rate.
    pub wander: f64,
    /// Smallest and largest standard deviation of the periods in a second, relative to the nominal
    /// period. Each second has its own value.
    pub scatter: [f64; 2],
    /// Fraction of seconds with a late tick.
    pub late_share: f64,
    /// Shortest and longest late period, in nominal periods.
    pub late: [f64; 2],
    /// Seed of the periods.
    pub seed: u64,
}

impl Jitter {
    /// Returns the jitter that was logged on a Touch at 1 kHz: means of a second from 978 to 1012
    /// Hz, standard deviations of 21 to 41 Hz, single ticks of up to 2.4 ms.
    pub fn logged(seed: u64) -> Self {
        Self { wander: 0.01, scatter: [0.021, 0.031], late_share: 0.5, late: [1.4, 2.4], seed }
    }
}

/// Shortest period, in nominal periods: the largest rate at which a late loop catches up.
const SHORTEST: f64 = 0.75;

/// Generator of the periods of a loop.
#[derive(Clone, Debug)]
pub(super) struct Periods {
    jitter: Jitter,
    nominal: f64,
    random: Random,
    /// Time since the current second began, s.
    into_second: f64,
    /// Relative deviation of the mean period at the start and at the end of the current second, and
    /// the relative standard deviation of its periods.
    means: [f64; 2],
    scatter: f64,
    /// Time of the late tick in the current second, s; infinite without a late tick.
    late_at: f64,
    /// Reduction of the next period after a late tick, in nominal periods.
    owed: f64,
}

impl Periods {
    pub(super) fn new(jitter: Jitter, nominal: f64) -> Self {
        let (into_second, means, scatter, late_at, owed) = (0.0, [0.0; 2], 0.0, 0.0, 0.0);
        let mut periods =
            Self { jitter, nominal, random: Random::new(jitter.seed), into_second, means, scatter, late_at, owed };
        periods.begin_second();
        periods
    }

    /// Returns the next period, s.
    pub(super) fn next(&mut self) -> f64 {
        if self.into_second >= 1.0 {
            self.into_second -= 1.0;
            self.begin_second();
        }
        let [from, to] = self.means;
        let mean = 1.0 + from + (to - from) * self.into_second;
        let period = if self.into_second >= self.late_at {
            self.late_at = f64::INFINITY;
            let [least, most] = self.jitter.late;
            least + (most - least) * self.random.unit()
        } else {
            // A triangular distribution from −1 to 1 has the standard deviation 1/√6.
            let triangle = self.random.unit() - self.random.unit();
            mean + triangle * self.scatter * 6f64.sqrt() - self.owed
        };
        let period = period.max(SHORTEST);
        self.owed = if period > 1.0 + LATE { 1.0 - SHORTEST } else { 0.0 };
        self.into_second += period * self.nominal;
        period * self.nominal
    }

    fn begin_second(&mut self) {
        let wander = self.jitter.wander * (2.0 * self.random.unit() - 1.0);
        self.means = [self.means[1], wander];
        let [least, most] = self.jitter.scatter;
        self.scatter = least + (most - least) * self.random.unit();
        let late = self.random.unit() < self.jitter.late_share;
        let moment = self.random.unit();
        self.late_at = if late { moment } else { f64::INFINITY };
    }
}

/// A period longer than the nominal one by this fraction counts as late, and the next periods make
/// up for it.
const LATE: f64 = 0.2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logged_jitter_matches_the_log() {
        const SEED: u64 = 1;
        let mut periods = Periods::new(Jitter::logged(SEED), 1e-3);
        let mut longest = 0.0f64;
        let (mut lowest, mut highest) = (f64::INFINITY, 0.0f64);
        for second in 0..120 {
            let rates: Vec<f64> = (0..1000).map(|_| 1.0 / periods.next()).collect();
            let seconds: f64 = rates.iter().map(|rate| 1.0 / rate).sum();
            let mean = rates.len() as f64 / seconds;
            let deviation = (rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>() / 1000.0).sqrt();
            longest = rates.iter().fold(longest, |longest, rate| longest.max(1.0 / rate));
            (lowest, highest) = (lowest.min(mean), highest.max(mean));
            assert!((978.0..1012.0).contains(&mean), "seed {SEED}, second {second}: {mean} Hz");
            assert!((20.0..42.0).contains(&deviation), "seed {SEED}, second {second}: deviation {deviation} Hz");
        }
        assert!((2.2e-3..=2.4e-3).contains(&longest), "seed {SEED}: longest {longest}");
        assert!(highest - lowest > 8.0, "seed {SEED}: {lowest} to {highest} Hz");
    }
}
