//! Divides a query's quota of work among its parts and stages.
//!
//! 1. Each part gets a share by its work in the last query. Half of it is for due pairs.
//! 2. If some parts still have due pairs then, or late ones, they get more. The quota must suffice
//!    for the answers of the leaf pairs that were found. Of what else is left, half is divided
//!    among these parts; then half of what they leave, and so on. Without this, a tool that is
//!    lifted off would be held at surfaces that are not examined yet, although there is work left.
//!
//!    If pairs are still due, a plane between both bodies is searched. If no contact of the last
//!    query pressed, and the bodies do not part from such a plane, the first of these rounds
//!    computes the cheapest bounds of due pairs, and visits those that are nearest. A tool that
//!    nothing presses may only move as far as due pairs allow. This round may do a little work even
//!    if the quota is spent.
//! 3. If nothing is near, a share of what is left is for pairs that will soon be near.
//! 4. The rest is for the answers. Each part gets a share by the number of its leaf pairs.
//!
//! The division depends on counts of work only, so it is the same for any number of threads.

use super::super::QueryCounters;
use super::super::query_input::QueryInput;
use super::{Part, PartSearch, Search, Task};
use crate::algebra::tolerance::{BOUNDED_WORK, DUE_ROUNDS, PREPARED_WORK, WORK_ANSWER};
use crate::algebra::{Quota, Work};

/// The progress of one part in the query, or the sums over all parts.
#[derive(Clone, Copy, Debug, Default)]
struct Progress {
    spent: u64,
    /// Number of due pairs that are not visited.
    due: u64,
    /// Number of other pairs that are not visited.
    late: u64,
    /// Number of leaf pairs that were found.
    leaves: u64,
    /// Number of parts that could split pairs that will soon be near.
    preparing: u64,
}

impl Search {
    /// Returns the limit of part `k` for the first stage.
    pub(super) fn first_limit(&self, quota: &Quota<'_>, k: usize) -> Work {
        let Some(left) = quota.left().filter(|_| self.costs.len() > 1) else { return Work::of(quota.left()) };
        let (total, count) = (self.costs.iter().sum::<u64>(), self.costs.len() as u64);
        let share = (self.costs[k] + total / count + 1) as f64 / (2 * total + count) as f64;
        Work::of(Some((left as f64 * share) as u64))
    }

    /// Visits more due pairs while the quota suffices. Then sets the task and the limits of the
    /// answers.
    pub(super) fn visit_due(&mut self, input: &QueryInput<'_>, quota: &Quota<'_>, counters: &mut QueryCounters) {
        self.plane.begin();
        let Some(all) = quota.left() else { return self.parts.each(|part| part.task = Task::Answer) };
        let mut progress = self.progress();
        if progress.due > 0 {
            self.search_plane(input, quota, counters);
        }
        let is_held = progress.due > 0 && !self.pressing && !self.plane.is_receding(input.range().offset);
        for round in 0..DUE_ROUNDS {
            let half = all.saturating_sub(progress.spent + progress.leaves * self.answer_cost) / 2;
            let (task, units) = match round == 0 && is_held {
                true => (Task::Bound, half.max(BOUNDED_WORK)),
                false => (Task::GoOn, half),
            };
            let total = progress.due + progress.late;
            if total == 0 || units == 0 {
                break;
            }
            self.limit(task, |part| divided(units, part.due + part.late, total));
            self.round();
            progress = self.progress();
        }
        let is_apart = self.contacts.is_empty() && progress.leaves + progress.due == 0;
        if is_apart && progress.preparing > 0 {
            let (left, parts) = (all.saturating_sub(progress.spent) / PREPARED_WORK, progress.preparing);
            self.limit(Task::Prepare, |part| divided(left, part.preparing, parts));
            self.round();
            progress = self.progress();
        }
        let (left, total) = (all.saturating_sub(progress.spent), progress.leaves);
        self.limit(Task::Answer, |part| divided(left, part.leaves, total));
    }

    /// Searches the plane between the bodies.
    fn search_plane(&mut self, input: &QueryInput<'_>, quota: &Quota<'_>, counters: &mut QueryCounters) {
        let before = counters.work();
        self.plane.search(input, &mut counters.traversal);
        quota.spend(counters.work() - before);
    }

    /// Stores the average work of an answer.
    pub(super) fn learn_answer_cost(&mut self) {
        let (mut answered, mut work) = (0, 0);
        self.parts.each(|part| {
            answered += part.search.answered;
            work += part.answer_work;
        });
        if let Some(mean) = u64::checked_div(work, answered) {
            self.answer_cost = mean.max(WORK_ANSWER);
        }
    }

    fn progress(&self) -> Progress {
        let mut all = Progress::default();
        self.parts.each(|part| {
            let Progress { spent, due, late, leaves, preparing } = Progress::of(part);
            all.spent += spent;
            all.due += due;
            all.late += late;
            all.leaves += leaves;
            all.preparing += preparing;
        });
        all
    }

    /// Sets the task of all parts, and for each part the work that it may still do.
    fn limit(&mut self, task: Task, units: impl Fn(Progress) -> u64) {
        self.parts.each(|part| {
            part.task = task;
            let progress = Progress::of(part);
            part.work.leave(units(progress));
        });
    }
}

impl Progress {
    fn of(part: &Part) -> Self {
        let PartSearch { front, leaves, .. } = &part.search;
        Self {
            spent: part.work.spent(),
            due: u64::from(front.still_due()),
            late: front.late() as u64,
            leaves: leaves.as_slice().len() as u64,
            preparing: u64::from(front.is_preparing()),
        }
    }
}

/// Returns the share `part / total` of `units`.
fn divided(units: u64, part: u64, total: u64) -> u64 {
    (u128::from(units) * u128::from(part) / u128::from(total.max(1))) as u64
}
