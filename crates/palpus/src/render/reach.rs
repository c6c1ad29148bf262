//! Limits the motion of a body in an implicit step.
//!
//! The query searches contacts only as far as the body may move in the next step: twice the
//! motion of the last step, and at least two contact offsets. No step moves the body farther, so it
//! cannot pass through a surface that the query did not examine. The bound also limits the turn of
//! the body: the query finds places whose normal faces the other body only after such a turn.
//!
//! If the work limit ends the query before it has examined everything, the body may only creep in
//! this step, and the hand pulls it ahead in the next. Then the body would move far in a step, the
//! query would search farther, and would be ended again. So the bound of a body in contact is
//! halved after such a query, and then grows slowly.

use crate::algebra::Twist;
use crate::algebra::tolerance::{
    REACH_CREEP, REACH_CUT, REACH_FADE, REACH_GROWTH, REACH_LEAST, REACH_RECOVERY, TOOL_FASTEST,
};

/// See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Distance from the centre of mass to the farthest corner of the body's box, m.
    radius: f64,
    /// Separation below which contacts push, m.
    contact_offset: f64,
    /// Bound on the motion of all points of the body in the next step, m.
    most: f64,
    /// Bound on `most` that follows from earlier queries that the work limit ended, m. Infinite for
    /// a body that touches nothing.
    limit: f64,
    /// Distance that the body may move before it can touch anything that this tick's query did not
    /// examine, m.
    clear: f64,
    /// True if the body is in contact.
    touches: bool,
}

/// Bounds on the motion of a body in one step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MostMotion {
    /// Bound on the motion of each point, m.
    pub(super) travel: f64,
    /// Bound on the turn, rad.
    pub(super) turn: f64,
}

impl Reach {
    /// Returns the bound for a body at rest whose points are within `radius` (m) of its centre of
    /// mass. Contacts push below a separation of `contact_offset` (m).
    pub(super) fn new(radius: f64, contact_offset: f64) -> Self {
        let most = REACH_LEAST * contact_offset;
        Self { radius, contact_offset, most, limit: f64::INFINITY, clear: f64::INFINITY, touches: false }
    }

    /// Sets the contact offset (m).
    pub(super) fn set_contact_offset(&mut self, contact_offset: f64) {
        self.contact_offset = contact_offset;
        self.most = self.most.max(REACH_LEAST * contact_offset);
    }

    /// Returns the bounds on the body's motion in the next step.
    pub(super) fn most(&self) -> MostMotion {
        MostMotion { travel: self.most, turn: self.most / self.radius }
    }

    /// Starts a tick. Until [`Self::see`] is called, everything counts as examined.
    pub(super) fn begin(&mut self) {
        self.clear = f64::INFINITY;
        self.touches = false;
    }

    /// Sets a bound of this tick's query: everything that it did not examine is at least `clear`
    /// (m) beyond the contact offset.
    pub(super) fn see(&mut self, clear: f64) {
        self.clear = self.clear.min(clear.max(0.0));
    }

    /// Allows a slow motion of a body in contact, even if the query did not examine everything.
    pub(super) fn touch(&mut self) {
        self.touches = true;
    }

    /// Returns the allowed fraction (at most 1) of a step of `h` seconds with `twist`. Within it,
    /// the body touches only contacts that the query has found.
    pub(super) fn share(&self, twist: &Twist, h: f64) -> f64 {
        let creep = if self.touches { REACH_CREEP * self.contact_offset } else { 0.0 };
        let (travel, most) = (self.travel(twist, h), self.most.min(self.clear.max(creep)));
        if travel > most { most / travel } else { 1.0 }
    }

    /// Updates the bound after a motion with `twist` for `h` seconds.
    pub(super) fn follow(&mut self, twist: &Twist, h: f64) {
        self.limit = match self.touches {
            false => f64::INFINITY,
            true if self.clear < self.most => (REACH_CUT * self.most).max(self.clear),
            true => REACH_RECOVERY * self.limit,
        };
        let needed = (REACH_GROWTH * self.travel(twist, h)).max(REACH_FADE * self.most);
        self.most = needed.min(self.limit).min(TOOL_FASTEST * h).max(REACH_LEAST * self.contact_offset);
    }

    /// Returns a bound on the motion of all points of the body in `h` seconds with `twist`, m.
    pub(super) fn travel(&self, twist: &Twist, h: f64) -> f64 {
        (twist.linear.length() + twist.angular.length() * self.radius) * h
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const OFFSET: f64 = 1e-4;

    /// Does a step of a body that tries to move by `travel` (m). Its query examined everything up
    /// to `clear` (m).
    fn step(reach: &mut Reach, touches: bool, clear: f64, travel: f64) {
        reach.begin();
        reach.see(clear);
        if touches {
            reach.touch();
        }
        let twist = Twist { angular: DVec3::ZERO, linear: DVec3::X * travel };
        let allowed = Twist { linear: twist.linear * reach.share(&twist, 1.0), ..twist };
        reach.follow(&allowed, 1.0);
    }

    /// Returns the bound for a body that has moved fast for some steps.
    fn moving() -> Reach {
        let mut reach = Reach::new(0.1, OFFSET);
        for _ in 0..4 {
            step(&mut reach, true, f64::INFINITY, 1e-3);
        }
        reach
    }

    #[test]
    fn body_in_contact_looks_less_far_ahead_after_a_query_that_was_cut() {
        let mut reach = moving();
        let before = reach.most().travel;
        assert!(before > 1e-3, "{before}");
        step(&mut reach, true, 0.0, 1e-3);
        let cut = reach.most().travel;
        assert_eq!(cut, REACH_CUT * before);
        step(&mut reach, true, f64::INFINITY, 1e-3);
        let next = reach.most().travel;
        assert!((next - REACH_RECOVERY * cut).abs() < 1e-15, "{next}");
        // The body keeps the distance that the query did examine, and a least distance.
        step(&mut reach, true, 0.9 * next, 1e-3);
        assert_eq!(reach.most().travel, 0.9 * next);
        for _ in 0..20 {
            step(&mut reach, true, 0.0, 1e-3);
        }
        assert_eq!(reach.most().travel, REACH_LEAST * OFFSET);
    }

    #[test]
    fn body_in_the_air_keeps_its_speed_after_a_query_that_was_cut() {
        let mut reach = moving();
        let before = reach.most().travel;
        step(&mut reach, false, 0.0, 1e-3);
        assert!(reach.most().travel >= REACH_FADE * before);
    }
}
