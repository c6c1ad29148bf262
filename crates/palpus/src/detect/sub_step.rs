//! Sub-steps of fast ticks for the guard against tunnelling.

use super::QueryCounters;
use super::guard::{between, sub_steps};
use super::part::Task;
use super::query_input::QueryInput;
use super::search::Search;
use crate::algebra::tolerance::GUARD_THICK;

impl Search {
    /// Queries the intermediate poses of a fast tick, until half of the quota is spent, so that no
    /// thin part is passed without a contact. Returns the thickness below which a part counts as
    /// thin in this tick. `None` if the tick is slow or no part is thin.
    ///
    /// The intermediate queries examine only pairs with a thin piece; for other pairs, the query at
    /// the tick's end is enough.
    pub(super) fn sub_steps(&mut self, input: &QueryInput<'_>, counters: &mut QueryCounters) -> Option<f64> {
        let (Some(_), Some(last)) = (&self.guard, self.last_pose) else { return None };
        let (way, thinnest) = self.motion_to(input)?;
        let (parts, thin) = (sub_steps(way, input.tolerance), GUARD_THICK * way);
        if parts <= 1 || thinnest >= thin {
            return None;
        }
        counters.sub_steps = parts;
        for part in 1..parts {
            if self.are_sub_steps_spent() {
                break;
            }
            let pose = between(&last, &input.pose_ba, f64::from(part) / f64::from(parts));
            self.move_to(&input.at(&pose), Some(thin));
            self.set(Task::SubStep { thin }, &pose);
            self.round();
            self.join_sub_step();
            self.compare_sides();
        }
        Some(thin)
    }

    /// Stores the pose. Lists the last contacts of pieces thinner than `thin` that tunnel on the
    /// way to this pose.
    pub(super) fn move_to(&mut self, input: &QueryInput<'_>, thin: Option<f64>) {
        let last = self.last_pose.replace(input.pose_ba);
        if let (Some(last), Some(thin)) = (last, thin) {
            self.trace(input, thin, &last.placement());
        }
    }
}
