//! Limits of a query's work. Work is counted, not timed, so that the same query with the same limit
//! gives the same result on every machine and in a replay.

use std::cell::Cell;

/// A limit of work, and the work that was done so far.
///
/// One unit is about the cost of a test of one pair of nodes; `tolerance` lists the cost of other
/// steps. A query never reads a clock to limit its work. A step sets the limit from the measured
/// times of earlier steps, or the caller sets it ([`crate::render::WorkLimit`]).
#[derive(Debug, Default)]
pub struct Work {
    most: Option<u64>,
    spent: Cell<u64>,
}

/// A part of the limit: work may continue until the total reaches `until`.
#[derive(Clone, Copy, Debug)]
pub struct Quota<'w> {
    work: &'w Work,
    until: u64,
}

impl Work {
    /// Creates a value without a limit.
    pub fn unlimited() -> Self {
        Self::default()
    }

    /// Creates a limit of about `most` units. A step that has begun is still finished. `None` means
    /// no limit.
    pub fn of(most: Option<u64>) -> Self {
        Self { most, spent: Cell::new(0) }
    }

    /// Returns the units spent so far.
    pub fn spent(&self) -> u64 {
        self.spent.get()
    }

    /// Returns the quota that covers the whole limit.
    pub fn all(&self) -> Quota<'_> {
        Quota { work: self, until: self.most.unwrap_or(u64::MAX) }
    }

    /// Sets the limit so that `units` remain.
    pub(crate) fn leave(&mut self, units: u64) {
        self.most = Some(self.spent.get().saturating_add(units));
    }

    /// Returns the quota that covers the first half of the limit.
    pub(crate) fn first_half(&self) -> Quota<'_> {
        Quota { work: self, until: self.most.map_or(u64::MAX, |most| most / 2) }
    }

    /// Divides the remaining units into `parts` equal quotas, and returns the first.
    pub fn share(&self, parts: u64) -> Quota<'_> {
        self.all().part(parts)
    }
}

impl Quota<'_> {
    /// Adds `units` to the units spent.
    #[inline]
    pub fn spend(&self, units: u64) {
        self.work.spent.set(self.work.spent.get().saturating_add(units));
    }

    /// Returns true if no units are left.
    #[inline]
    pub fn is_spent(&self) -> bool {
        self.work.spent.get() >= self.until
    }

    /// Returns the remaining units; `None` if there is no limit.
    pub(crate) fn left(&self) -> Option<u64> {
        (self.until < u64::MAX).then(|| self.until.saturating_sub(self.work.spent.get()))
    }

    /// Returns half of the remaining units.
    pub fn half(&self) -> Self {
        self.part(2)
    }

    /// Divides the remaining units into `parts` equal quotas, and returns one.
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
    fn quotas_divide_the_remaining_units() {
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
