//! The last seconds of a run, tick by tick, for the plots, and their moments, frame by frame.

use std::collections::VecDeque;

use super::run::{ComparedTick, SeenTick};
use crate::moment::Moment;

/// Time span of the plots, s.
pub(crate) const SPAN: f64 = 10.0;
/// Largest number of kept moments: enough for the time span at the fastest frame rate.
const MOST_MOMENTS: usize = 700;

/// State of contact: free, or disjoint (D) or penetrating (P) as in the paper's Figure 5.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum State {
    /// No contact.
    #[default]
    Free,
    /// Contacts without overlap.
    Disjoint,
    /// Overlap.
    Penetrating,
}

impl State {
    fn of(tick: &SeenTick) -> Self {
        match tick.separation {
            separation if separation < 0.0 => Self::Penetrating,
            _ if tick.contacts > 0 => Self::Disjoint,
            _ => Self::Free,
        }
    }
}

/// An interval with a constant state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) state: State,
}

/// Values of the last [`SPAN`] seconds, oldest first.
#[derive(Debug, Default)]
pub(crate) struct History {
    ticks: VecDeque<SeenTick>,
    /// The same ticks, computed with other settings.
    compared: VecDeque<ComparedTick>,
    moments: VecDeque<Moment>,
}

impl History {
    /// Adds a tick that is newer than all others, and removes old ticks. If the tick is older than
    /// the last tick, the history starts again.
    pub(crate) fn push(&mut self, tick: SeenTick) {
        if self.ticks.back().is_some_and(|last| last.time >= tick.time) {
            self.clear();
        }
        self.ticks.push_back(tick);
        let first = tick.time - SPAN;
        while self.ticks.front().is_some_and(|tick| tick.time < first) {
            self.ticks.pop_front();
        }
        while self.compared.front().is_some_and(|tick| tick.time < first) {
            self.compared.pop_front();
        }
        while self.moments.front().is_some_and(|moment| moment.time < first) {
            self.moments.pop_front();
        }
    }

    /// Adds a tick with other settings.
    pub(crate) fn push_compared(&mut self, tick: ComparedTick) {
        self.compared.push_back(tick);
    }

    /// Adds the moment of a tick.
    pub(crate) fn push_moment(&mut self, moment: &Moment) {
        if self.moments.back().is_none_or(|last| last.time < moment.time) && self.moments.len() < MOST_MOMENTS {
            self.moments.push_back(moment.clone());
        }
    }

    /// Returns the time of the newest tick, s.
    pub(crate) fn end(&self) -> f64 {
        self.ticks.back().map_or(0.0, |tick| tick.time)
    }

    /// Removes everything, because another scene starts.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Removes the comparison.
    pub(crate) fn clear_compared(&mut self) {
        self.compared.clear();
    }

    /// Returns all ticks, oldest first.
    pub(crate) fn ticks(&self) -> impl Iterator<Item = &SeenTick> {
        self.ticks.iter()
    }

    /// Returns the ticks with other settings.
    pub(crate) fn compared(&self) -> impl Iterator<Item = &ComparedTick> {
        self.compared.iter()
    }

    /// Returns the first tick from `time` on, or the newest tick.
    pub(crate) fn at(&self, time: Option<f64>) -> Option<&SeenTick> {
        let found = time.and_then(|time| self.ticks.get(self.ticks.partition_point(|tick| tick.time < time)));
        found.or(self.ticks.back())
    }

    /// Returns the first compared tick from `time` on, or the newest compared tick.
    pub(crate) fn compared_at(&self, time: Option<f64>) -> Option<&ComparedTick> {
        let found = time.and_then(|time| self.compared.get(self.compared.partition_point(|tick| tick.time < time)));
        found.or(self.compared.back())
    }

    /// Returns the moment at `time`.
    pub(crate) fn moment(&self, time: f64) -> Option<&Moment> {
        let after = self.moments.partition_point(|moment| moment.time < time);
        self.moments.get(after).or(self.moments.back())
    }

    /// Returns the intervals of contact, oldest first.
    pub(crate) fn intervals(&self) -> Vec<Interval> {
        let mut intervals: Vec<Interval> = Vec::new();
        for tick in &self.ticks {
            let (time, state) = (tick.time, State::of(tick));
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

    fn at(time: f64, state: State) -> SeenTick {
        let contacts = u32::from(state != State::Free);
        let separation = if state == State::Penetrating { -1e-3 } else { 1e-3 };
        SeenTick { time, contacts, separation, ..SeenTick::default() }
    }

    #[test]
    fn too_old_ticks_are_dropped() {
        let mut history = History::default();
        for k in 0..200 {
            history.push(at(f64::from(k) * 0.125, State::Free));
            history.push_moment(&Moment { time: f64::from(k) * 0.125, ..Moment::new(1) });
        }
        assert_eq!(history.ticks().count(), 81);
        let first = history.ticks().next().expect("the history has ticks").time;
        assert!((first - (history.end() - SPAN)).abs() < 1e-9);
        assert!((history.moment(15.0).expect("the moment is stored").time - 15.0).abs() < 0.13);
        assert!((history.at(Some(15.0)).expect("the moment is stored").time - 15.0).abs() < 0.13);
        // In a new run, the time starts again.
        history.push(at(0.0, State::Free));
        assert_eq!(history.ticks().count(), 1);
    }

    #[test]
    fn separate_contacts_are_distinguished() {
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
