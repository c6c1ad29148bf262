//! The last seconds of the numbers, for the plots.

use std::collections::VecDeque;

/// s that the plots reach back.
pub(crate) const SPAN: f64 = 10.0;

/// One frame's numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    /// s since the run began.
    pub(crate) time: f64,
    /// N.
    pub(crate) force: f64,
    /// mN·m.
    pub(crate) torque: f64,
    /// µs.
    pub(crate) query: f64,
    pub(crate) contacts: f64,
    pub(crate) overlapping: f64,
}

/// Samples of the last [`SPAN`] seconds, oldest first.
#[derive(Debug, Default)]
pub(crate) struct History(VecDeque<Sample>);

impl History {
    /// Adds a sample that is newer than all others, and forgets what is too old.
    pub(crate) fn push(&mut self, sample: Sample) {
        if self.0.back().is_some_and(|last| last.time >= sample.time) {
            return;
        }
        self.0.push_back(sample);
        while self.0.front().is_some_and(|first| first.time < sample.time - SPAN) {
            self.0.pop_front();
        }
    }

    /// Of the newest sample, s.
    pub(crate) fn end(&self) -> f64 {
        self.0.back().map_or(0.0, |sample| sample.time)
    }

    /// A curve over time.
    pub(crate) fn curve(&self, of: impl Fn(&Sample) -> f64) -> Vec<[f64; 2]> {
        self.0.iter().map(|sample| [sample.time, of(sample)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_old_is_forgotten() {
        let mut history = History::default();
        for k in 0..2000 {
            let sample = Sample {
                time: f64::from(k) * 0.1,
                force: 1.0,
                torque: 0.0,
                query: 0.0,
                contacts: 0.0,
                overlapping: 0.0,
            };
            history.push(sample);
            history.push(sample);
        }
        let curve = history.curve(|sample| sample.force);
        assert_eq!(curve.len(), 101);
        assert!((curve[0][0] - (history.end() - SPAN)).abs() < 1e-9);
    }
}
