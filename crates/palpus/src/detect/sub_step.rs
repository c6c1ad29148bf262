//! Fast ticks, cut into parts for the guard against tunnelling, and what is jumped.

use glam::DVec3;

use super::guard::{between, sub_steps};
use super::pair::Found;
use super::search::{Asked, PairSearch, side};
use super::{Contact, QueryCounters};
use crate::algebra::tolerance::{GUARD_THICK, JUMP, WORK_ANSWER};
use crate::algebra::{Placement, Quota};
use crate::body::{Aabb, Body};

impl PairSearch {
    /// A fast tick's poses on the way, so that nothing thin is jumped over; the quota may cut them short. What is thin then, if
    /// the tick is fast and anything is.
    ///
    /// Only pairs one of whose pieces is thin are looked at on the way; the others have the whole tick to go.
    pub(super) fn sub_steps(
        &mut self,
        asked: &Asked<'_>,
        quota: &Quota<'_>,
        counters: &mut QueryCounters,
    ) -> Option<f64> {
        let (Some(_), Some(last)) = (&self.guard, self.last_pose) else { return None };
        let way = travel(asked.a, &last.placement(), &asked.place);
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
            let Asked { a, b, place, tolerance, .. } = asked;
            let (front, leaves) = (&mut self.front, &mut self.leaves);
            front.thin_within_quota(side(a), side(b), &place, tolerance, thin, &quota, leaves);
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

    /// Notes the pose, whether the way to it is coherent, and which of the last contacts of pieces thinner than `thin` tunnel on that way.
    pub(super) fn move_to(&mut self, asked: &Asked<'_>, thin: Option<f64>) {
        let Asked { a, b, pose_ba, place, .. } = *asked;
        self.coherent = false;
        if let Some(last) = self.last_pose.replace(pose_ba) {
            let last = last.placement();
            self.coherent = travel(a, &last, &place) <= JUMP * a.size().min(b.size());
            if let (Some(guard), Some(thin)) = (&mut self.guard, thin) {
                let is_thin = |contact: &&Contact| self.front.thickness(contact.piece_a, contact.piece_b) < thin;
                guard.trace(asked, self.contacts.iter().filter(is_thin), &last);
            }
        }
    }
}

/// The farthest that any point of the body's bounding box moves from one placement to another.
///
/// The displacement field of a rigid motion is affine, so its norm is largest at a corner.
fn travel(body: &Body, from: &Placement, to: &Placement) -> f64 {
    let Aabb { min, max } = body.mesh().bounds();
    let corner = |k: u32| {
        let pick = |bit: u32, low: f64, high: f64| if k >> bit & 1 == 1 { high } else { low };
        let p = DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z));
        to.point(p).distance_squared(from.point(p))
    };
    (0..8).map(corner).fold(0.0, f64::max).sqrt()
}
