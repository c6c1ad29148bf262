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
    /// µs.
    pub(crate) force_time: f64,
    pub(crate) contacts: f64,
    pub(crate) state: State,
}

/// How the bodies are: the D and P of the paper's Figure 5.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum State {
    /// No contact.
    #[default]
    Free,
    /// Contacts, and no overlap.
    Disjoint,
    /// They overlap.
    Penetrating,
}

/// A time in which the state stayed the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) state: State,
}

/// Samples of the last [`SPAN`] seconds, oldest first.
#[derive(Debug, Default)]
pub(crate) struct History(VecDeque<Sample>);

impl History {
    /// Adds a sample that is newer than all others, and forgets what is too old; an older one
    /// begins anew.
    pub(crate) fn push(&mut self, sample: Sample) {
        match self.0.back() {
            Some(last) if last.time == sample.time => return,
            Some(last) if last.time > sample.time => self.0.clear(),
            _ => {}
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

    /// Forgets everything: another scene begins.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// The newest sample.
    pub(crate) fn last(&self) -> Option<&Sample> {
        self.0.back()
    }

    /// All samples, oldest first.
    pub(crate) fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.0.iter()
    }

    /// The times of contact, oldest first.
    pub(crate) fn intervals(&self) -> Vec<Interval> {
        let mut intervals: Vec<Interval> = Vec::new();
        for sample in &self.0 {
            let (time, state) = (sample.time, sample.state);
            if let Some(last) = intervals.last_mut() {
                last.to = time;
                if last.state == state {
                    continue;
                }
            }
            intervals.push(Interval { from: time, to: time, state });
        }
        intervals.retain(|interval| interval.state != State::Free);
        intervals
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time: f64, state: State) -> Sample {
        Sample { time, force: 1.0, torque: 0.0, query: 0.0, force_time: 0.0, contacts: 0.0, state }
    }

    #[test]
    fn what_is_too_old_is_forgotten() {
        let mut history = History::default();
        for k in 0..2000 {
            let sample = at(f64::from(k) * 0.1, State::Free);
            history.push(sample);
            history.push(sample);
        }
        assert_eq!(history.samples().count(), 101);
        let first = history.samples().next().expect("there are some").time;
        assert!((first - (history.end() - SPAN)).abs() < 1e-9);
    }

    #[test]
    fn times_of_contact_are_told_apart() {
        use State::{Disjoint, Free, Penetrating};
        let mut history = History::default();
        for (time, state) in
            [(0.0, Free), (1.0, Disjoint), (2.0, Disjoint), (3.0, Penetrating), (4.0, Free), (5.0, Disjoint)]
        {
            history.push(at(time, state));
        }
        let interval = |from, to, state| Interval { from, to, state };
        let expected = [interval(1.0, 3.0, Disjoint), interval(3.0, 4.0, Penetrating), interval(5.0, 5.0, Disjoint)];
        assert_eq!(history.intervals(), expected);
    }
}
