//! Limits the work of a step, so that the step ends within its time.
//!
//! The engine counts work and has no clock ([`crate::algebra::Work`]). A pacer reads the measured
//! time of each step and computes the allowed work of the next step:
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

use super::{Settings, StageTimes, Tick};
use crate::algebra::tolerance::{
    PACE_CHEAPER, PACE_COLD_PRICE, PACE_DEARER, PACE_FIRST_PRICE, PACE_GROWTH, PACE_LEAST_WORK, PACE_SHARE, PACE_SPIKE,
    PACE_TELLING,
};

/// Computes the work allowance of one renderer. See the module's description.
#[derive(Clone, Copy, Debug)]
pub struct Pacer {
    /// Target time of a step, ns.
    target: f64,
    /// Price of a unit of work, ns.
    price: f64,
    /// Time of a step without its query, ns.
    rest: f64,
    /// Work of the last step.
    last: u64,
}

impl Pacer {
    /// Returns a pacer for a loop of `rate_hz`. The target is `time_budget` of `settings`, or a
    /// fixed fraction of the period.
    pub fn of(settings: &Settings, rate_hz: f64) -> Self {
        Self::new(settings.time_budget.unwrap_or((PACE_SHARE * 1e9 / rate_hz) as u64))
    }

    /// Returns a pacer for steps of at most about `target_ns`.
    pub fn new(target_ns: u64) -> Self {
        Self { target: target_ns as f64, price: PACE_FIRST_PRICE, rest: 0.0, last: 0 }
    }

    /// Returns the allowed work of the next step's query, in units of [`crate::algebra::Work`].
    pub fn allowance(&self) -> u64 {
        let time = self.target - self.rest;
        let sudden = time / PACE_COLD_PRICE + PACE_GROWTH * self.last as f64;
        let affordable = (time / self.price).min(sudden.max(0.0));
        (affordable as u64).clamp(PACE_LEAST_WORK, u64::from(u32::MAX))
    }

    /// Updates the estimates with the measured times of a step.
    pub fn learn(&mut self, tick: &Tick) {
        let StageTimes { force, couple, saturate, total, .. } = tick.times;
        // The times of the query and of the depth are those of one tool, but the work is that of
        // the whole world.
        let rest = (force + couple + saturate) as f64;
        let query = total as f64 - rest;
        self.last = tick.work;
        // If the work is small, much of the time is spent on what is not counted.
        if tick.work >= PACE_TELLING {
            let seen = query / tick.work as f64;
            self.price = followed(self.price, seen.min(PACE_SPIKE * self.price));
        }
        self.rest = followed(self.rest, rest.min(self.target));
    }
}

fn followed(known: f64, seen: f64) -> f64 {
    known + (seen - known) * if seen > known { PACE_DEARER } else { PACE_CHEAPER }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(work: u64, query: u64, rest: u64) -> Tick {
        let mut tick = Tick::new(0);
        tick.work = work;
        // The queries of objects are not in the times of a tool's queries.
        tick.times.force = rest;
        tick.times.total = query + rest;
        tick
    }

    /// Returns a pacer that has measured the same step `count` times.
    fn after(count: usize, step: &Tick) -> Pacer {
        let mut pacer = Pacer::new(600_000);
        (0..count).for_each(|_| pacer.learn(step));
        pacer
    }

    #[test]
    fn allowance_converges_to_the_budget() {
        let pacer = after(20_000, &step(5_000, 400_000, 100_000));
        // A unit takes 80 ns, and half a millisecond remains for the query.
        assert!((6200..6300).contains(&pacer.allowance()), "{}", pacer.allowance());
    }

    #[test]
    fn price_rises_fast_and_falls_slowly() {
        let mut pacer = after(20_000, &step(5_000, 400_000, 0));
        let before = pacer.allowance();
        for _ in 0..10 {
            pacer.learn(&step(5_000, 800_000, 0));
        }
        let dear = pacer.allowance();
        assert!(dear < before * 6 / 10, "{dear} of {before}");
        for _ in 0..3 {
            pacer.learn(&step(5_000, 400_000, 0));
        }
        assert!(pacer.allowance() < dear * 12 / 10);
    }

    #[test]
    fn allowance_always_permits_progress() {
        let pacer = after(100, &step(5_000, 400_000, 5_000_000));
        assert_eq!(pacer.allowance(), PACE_LEAST_WORK);
        // Steps with little work do not change the price.
        assert_eq!(after(1000, &step(1, 40_000, 0)).price, PACE_FIRST_PRICE);
    }

    #[test]
    fn one_interrupted_step_limits_the_work_for_few_steps() {
        let mut pacer = after(2_000, &step(2_000, 400_000, 0));
        let before = pacer.allowance();
        pacer.learn(&step(2_000, 40_000_000, 0));
        assert!(pacer.allowance() > before / 2, "{} of {before}", pacer.allowance());
        // A step with the least allowance is measured too.
        let mut late = Pacer { price: 1e6, ..pacer };
        assert_eq!(late.allowance(), PACE_LEAST_WORK);
        (0..2000).for_each(|_| late.learn(&step(PACE_LEAST_WORK, 40_000, 0)));
        (0..10).for_each(|_| late.learn(&step(2_000, 400_000, 0)));
        assert!(late.allowance() > before * 9 / 10, "{} of {before}", late.allowance());
    }

    #[test]
    fn sudden_work_begins_small_and_grows_within_few_steps() {
        let mut pacer = after(2_000, &step(5_000, 400_000, 0));
        let warm = pacer.allowance();
        pacer.learn(&step(0, 5_000, 0));
        let mut grown = vec![pacer.allowance()];
        while grown.len() < 7 {
            let work = pacer.allowance();
            pacer.learn(&step(work, 80 * work, 0));
            grown.push(pacer.allowance());
        }
        assert!(grown[0] <= 600 && grown[1] <= 1_400 && grown[6] > warm * 9 / 10, "{grown:?}, {warm}");
    }
}
