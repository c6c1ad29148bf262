//! Limits of a query's work. Work is counted, not timed, so that the same query with the same limit
//! gives the same result on every machine and in a replay.

use std::cell::Cell;

/// An allowance of work, and what has been spent of it.
///
/// One unit is about the cost of examining one pair of nodes; `tolerance` lists the cost of other
/// steps. The engine never reads a clock to limit its work; a caller with a clock sets the
/// allowance ([`crate::render::Pacer`]).
#[derive(Debug, Default)]
pub struct Work {
    most: Option<u64>,
    spent: Cell<u64>,
}

/// A part of an allowance: work may go on until the total reaches this.
#[derive(Clone, Copy, Debug)]
pub struct Quota<'w> {
    work: &'w Work,
    until: u64,
}

impl Work {
    /// There is no limit.
    pub fn unlimited() -> Self {
        Self::default()
    }

    /// An allowance of about `most` units; a step that has begun is still finished.
    pub fn of(most: Option<u64>) -> Self {
        Self { most, spent: Cell::new(0) }
    }

    /// Units spent so far.
    pub fn spent(&self) -> u64 {
        self.spent.get()
    }

    /// Returns the quota that covers the whole allowance.
    pub fn all(&self) -> Quota<'_> {
        Quota { work: self, until: self.most.unwrap_or(u64::MAX) }
    }

    /// Returns an equal share of the rest for the first of `parts` remaining parts.
    pub fn share(&self, parts: u64) -> Quota<'_> {
        self.all().part(parts)
    }
}

impl Quota<'_> {
    /// Adds `units` to what has been spent.
    #[inline]
    pub fn spend(&self, units: u64) {
        self.work.spent.set(self.work.spent.get().saturating_add(units));
    }

    /// True when nothing is left.
    #[inline]
    pub fn is_spent(&self) -> bool {
        self.work.spent.get() >= self.until
    }

    /// Half of what is left.
    pub fn half(&self) -> Self {
        self.part(2)
    }

    /// One part of so many of what is left.
    fn part(&self, parts: u64) -> Self {
        let spent = self.work.spent.get();
        let until = if self.until == u64::MAX { u64::MAX } else { spent + self.until.saturating_sub(spent) / parts };
        Self { until, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_of_what_is_left() {
        let work = Work::of(Some(100));
        let half = work.all().half();
        half.spend(50);
        assert!(half.is_spent() && !work.all().is_spent());
        let third = work.share(2);
        third.spend(24);
        assert!(!third.is_spent());
        third.spend(2);
        assert!(third.is_spent() && work.spent() == 76);
    }

    #[test]
    fn without_a_limit_nothing_is_ever_spent() {
        let work = Work::unlimited();
        let part = work.all().half().half();
        part.spend(u64::MAX - 1);
        assert!(!part.is_spent());
    }
}
