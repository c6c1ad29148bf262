//! Limits the motion of a body in an implicit step.
//!
//! The query searches contacts only as far as the body may move in the next step: twice the
//! motion of the last step, and at least two contact offsets. No step moves the body farther, so it
//! cannot pass through a surface that the query did not examine. The bound also limits the turn of
//! the body: the query finds places whose normal faces the other body only after such a turn.

use crate::algebra::Twist;
use crate::algebra::tolerance::{REACH_CREEP, REACH_FADE, REACH_GROWTH, REACH_LEAST, TOOL_FASTEST};

/// See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Distance from the centre of mass to the farthest corner of the body's box, m.
    radius: f64,
    /// Separation below which contacts push, m.
    contact_offset: f64,
    /// Bound on the motion of all points of the body in the next step, m.
    most: f64,
    /// Distance that the body may move before it can touch anything that this tick's query did not
    /// examine, m.
    clear: f64,
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
        Self { radius, contact_offset, most: REACH_LEAST * contact_offset, clear: f64::INFINITY }
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
    }

    /// Sets a bound of this tick's query: everything that it did not examine is at least `clear`
    /// (m) beyond the contact offset.
    pub(super) fn see(&mut self, clear: f64) {
        self.clear = self.clear.min(clear.max(0.0));
    }

    /// Allows a slow motion of a body in contact, even if the query did not examine everything.
    pub(super) fn touch(&mut self) {
        self.clear = self.clear.max(REACH_CREEP * self.contact_offset);
    }

    /// Returns the allowed fraction (at most 1) of a step of `h` seconds with `twist`. Within it,
    /// the body touches only contacts that the query has found.
    pub(super) fn share(&self, twist: &Twist, h: f64) -> f64 {
        let (travel, most) = (self.travel(twist, h), self.most.min(self.clear));
        if travel > most { most / travel } else { 1.0 }
    }

    /// Updates the bound after a motion with `twist` for `h` seconds.
    pub(super) fn follow(&mut self, twist: &Twist, h: f64) {
        let needed = (REACH_GROWTH * self.travel(twist, h)).max(REACH_FADE * self.most);
        self.most = needed.min(TOOL_FASTEST * h).max(REACH_LEAST * self.contact_offset);
    }

    /// Returns a bound on the motion of all points of the body in `h` seconds with `twist`, m.
    pub(super) fn travel(&self, twist: &Twist, h: f64) -> f64 {
        (twist.linear.length() + twist.angular.length() * self.radius) * h
    }
}
