//! Sub-steps of fast ticks for the guard against tunnelling.

use super::guard::{between, sub_steps};
use super::pair::Found;
use super::search::{Asked, PairSearch};
use super::{Contact, QueryCounters};
use crate::algebra::Quota;
use crate::algebra::tolerance::{GUARD_THICK, WORK_ANSWER};
use crate::collision::PlacedPair;

impl PairSearch {
    /// Queries the intermediate poses of a fast tick, until the quota is spent, so that no thin
    /// part is passed without a contact. Returns the thickness below which a part counts as thin in
    /// this tick. `None` if the tick is slow or no part is thin.
    ///
    /// The intermediate queries examine only pairs with a thin piece; for other pairs, the query at
    /// the tick's end is enough.
    pub(super) fn sub_steps(
        &mut self,
        asked: &Asked<'_>,
        quota: &Quota<'_>,
        counters: &mut QueryCounters,
    ) -> Option<f64> {
        let (Some(_), Some(last)) = (&self.guard, self.last_pose) else { return None };
        let way = self.front.motion_to(&asked.place)?;
        let (parts, thin) = (sub_steps(way, asked.tolerance), GUARD_THICK * way);
        if parts <= 1 || self.front.thinnest() >= thin {
            return None;
        }
        counters.sub_steps = parts;
        let quota = quota.half();
        for part in 1..parts {
            if quota.is_spent() {
                break;
            }
            let pose = between(&last, &asked.pose_ba, f64::from(part) / f64::from(parts));
            let asked = asked.at(&pose);
            self.move_to(&asked, Some(thin));
            let placed = PlacedPair { thinner_than: thin, ..asked.placed() };
            self.front.within_quota(&placed, &quota, &mut self.leaves);
            self.contacts.clear();
            for k in 0..self.leaves.as_slice().len() {
                let leaf = self.leaves.as_slice()[k];
                let before = counters.work();
                if let Found::Admissible(contact) | Found::Moved(contact, _) = self.contact(&asked, &leaf, counters) {
                    self.contacts.push(contact);
                }
                quota.spend(WORK_ANSWER + counters.work() - before);
            }
            if let Some(guard) = &mut self.guard {
                guard.compare(&self.contacts);
            }
        }
        Some(thin)
    }

    /// Stores the pose. Lists the last contacts of pieces thinner than `thin` that tunnel on the
    /// way to this pose.
    pub(super) fn move_to(&mut self, asked: &Asked<'_>, thin: Option<f64>) {
        let last = self.last_pose.replace(asked.pose_ba);
        if let (Some(last), Some(guard), Some(thin)) = (last, &mut self.guard, thin) {
            let is_thin = |contact: &&Contact| self.front.thickness(contact.piece_a, contact.piece_b) < thin;
            guard.trace(asked, self.contacts.iter().filter(is_thin), &last.placement());
        }
    }
}
