//! Limits the work of a step, so that the step ends within its time.
//!
//! Queries count their work and read no clock ([`crate::algebra::Work`]). A pacer reads the
//! measured time of each step and computes the allowed work of the next step:
//!
//! 1. *Price*: the time of a unit of work, ns. The estimate rises within a few steps and falls
//!    within about 10, so one quick step hardly changes it. A step that the system has
//!    interrupted raises it by a limited factor.
//! 2. *Rest*: the time of a step without its query, estimated in the same way.
//! 3. *Allowance*: (target − rest) / price, but at least the work with which a query makes
//!    progress.
//! 4. *Growth*: a step that suddenly needs more work than the step before, as when two bodies touch
//!    again, reads memory that the processor's caches have lost. A unit of this work takes several
//!    times as long. So the allowance grows from step to step by a limited factor, except for a
//!    first part that is affordable at the price of such work.
//!
//! The allowances depend on measured times, so a recording must store them. A run with equal
//! allowances gives bit-identical results.

use crate::algebra::tolerance::{
    PACE_CHEAPER, PACE_COLD_PRICE, PACE_DEARER, PACE_FIRST_PRICE, PACE_GROWTH, PACE_LEAST_WORK, PACE_SPIKE,
    PACE_TELLING,
};

/// Limits the work of the queries in each step of a world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WorkLimit {
    /// The work that a step with a running clock can do in the least
    /// [`time_budget`](super::Settings::time_budget) of its tools. No limit if no tool has a time
    /// budget, or if the clock does not run ([`NoClock`](crate::algebra::NoClock)). The allowed
    /// work depends on measured times, so two runs are not bit-identical.
    #[default]
    TimeBudget,
    /// This number of units ([`crate::algebra::Work`]). With equal limits, runs are bit-identical.
    Units(u64),
    /// No limit.
    Unlimited,
}

impl From<Option<u64>> for WorkLimit {
    /// Returns the limit of a recorded step ([`super::Tick::work_allowed`]).
    fn from(allowed: Option<u64>) -> Self {
        allowed.map_or(Self::Unlimited, Self::Units)
    }
}

/// Computes the work allowance of one world. See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pacer {
    /// Price of a unit of work, ns.
    price: f64,
    /// Time of a step without its queries, ns.
    rest: f64,
    /// Work of the last step.
    last: u64,
}

impl Pacer {
    /// A pacer that has not measured a step.
    pub(super) const NEW: Self = Self { price: PACE_FIRST_PRICE, rest: 0.0, last: 0 };

    /// Returns the work that the queries of the next step may do so that the step takes at most
    /// about `target_ns`.
    pub(super) fn allowance(&self, target_ns: u64) -> u64 {
        let time = target_ns as f64 - self.rest;
        let sudden = time / PACE_COLD_PRICE + PACE_GROWTH * self.last as f64;
        let affordable = (time / self.price).min(sudden.max(0.0));
        (affordable as u64).clamp(PACE_LEAST_WORK, u64::from(u32::MAX))
    }

    /// Updates the estimates: in a step that should take at most `target_ns`, the queries did
    /// `work` units of work in `query_ns`, and the rest of the step took `rest_ns`.
    pub(super) fn learn(&mut self, target_ns: u64, work: u64, query_ns: u64, rest_ns: u64) {
        self.last = work;
        // If the work is small, much of the time is spent on what is not counted.
        if work >= PACE_TELLING {
            let seen = query_ns as f64 / work as f64;
            self.price = followed(self.price, seen.min(PACE_SPIKE * self.price));
        }
        self.rest = followed(self.rest, rest_ns.min(target_ns) as f64);
    }
}

fn followed(known: f64, seen: f64) -> f64 {
    known + (seen - known) * if seen > known { PACE_DEARER } else { PACE_CHEAPER }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET: u64 = 600_000;

    /// A step: the work of its queries, their time and the time of the rest, ns.
    type Step = (u64, u64, u64);

    fn learn(pacer: &mut Pacer, count: usize, (work, query, rest): Step) {
        (0..count).for_each(|_| pacer.learn(TARGET, work, query, rest));
    }

    /// Returns a pacer that has measured the same step `count` times.
    fn after(count: usize, step: Step) -> Pacer {
        let mut pacer = Pacer::NEW;
        learn(&mut pacer, count, step);
        pacer
    }

    #[test]
    fn allowance_converges_to_the_budget() {
        let pacer = after(20_000, (5_000, 400_000, 100_000));
        // A unit takes 80 ns, and half a millisecond remains for the query.
        assert!((6200..6300).contains(&pacer.allowance(TARGET)), "{}", pacer.allowance(TARGET));
    }

    #[test]
    fn price_rises_fast_and_falls_slowly() {
        let mut pacer = after(20_000, (5_000, 400_000, 0));
        let before = pacer.allowance(TARGET);
        learn(&mut pacer, 10, (5_000, 800_000, 0));
        let dear = pacer.allowance(TARGET);
        assert!(dear < before * 6 / 10, "{dear} of {before}");
        learn(&mut pacer, 3, (5_000, 400_000, 0));
        assert!(pacer.allowance(TARGET) < dear * 12 / 10);
    }

    #[test]
    fn allowance_always_permits_progress() {
        let pacer = after(100, (5_000, 400_000, 5_000_000));
        assert_eq!(pacer.allowance(TARGET), PACE_LEAST_WORK);
        // Steps with little work do not change the price.
        assert_eq!(after(1000, (1, 40_000, 0)).price, PACE_FIRST_PRICE);
    }

    #[test]
    fn one_interrupted_step_limits_the_work_for_few_steps() {
        let mut pacer = after(2_000, (2_000, 400_000, 0));
        let before = pacer.allowance(TARGET);
        learn(&mut pacer, 1, (2_000, 40_000_000, 0));
        assert!(pacer.allowance(TARGET) > before / 2, "{} of {before}", pacer.allowance(TARGET));
        // A step with the least allowance is measured too.
        let mut late = Pacer { price: 1e6, ..pacer };
        assert_eq!(late.allowance(TARGET), PACE_LEAST_WORK);
        learn(&mut late, 2000, (PACE_LEAST_WORK, 40_000, 0));
        learn(&mut late, 10, (2_000, 400_000, 0));
        assert!(late.allowance(TARGET) > before * 9 / 10, "{} of {before}", late.allowance(TARGET));
    }

    #[test]
    fn sudden_work_begins_small_and_grows_within_few_steps() {
        let mut pacer = after(2_000, (5_000, 400_000, 0));
        let warm = pacer.allowance(TARGET);
        learn(&mut pacer, 1, (0, 5_000, 0));
        let mut grown = vec![pacer.allowance(TARGET)];
        while grown.len() < 7 {
            let work = pacer.allowance(TARGET);
            learn(&mut pacer, 1, (work, 80 * work, 0));
            grown.push(pacer.allowance(TARGET));
        }
        assert!(grown[0] <= 600 && grown[1] <= 1_400 && grown[6] > warm * 9 / 10, "{grown:?}, {warm}");
    }
}
