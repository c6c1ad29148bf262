//! Bounds how far an implicit step may move a body.
//!
//! The query looks ahead only as far as the body may move in the next step: twice the motion of the
//! last step, and at least two contact offsets. No step moves farther, so no step passes
//! anything that was not examined.

use crate::algebra::Twist;
use crate::algebra::tolerance::{REACH_CREEP, REACH_FADE, REACH_GROWTH, REACH_LEAST, TOOL_FASTEST};

/// See the module's description.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// m: from the centre of mass to the farthest corner of the body's box.
    radius: f64,
    /// m.
    skin: f64,
    /// m: no point of the body moves farther in the next step.
    most: f64,
    /// m: the body may move this far before it can meet anything that this tick's query did not
    /// examine.
    clear: f64,
}

impl Reach {
    /// Reach of a body at rest whose points are within `radius` (m) of its centre of mass. Contacts
    /// push below a separation of `skin` (m).
    pub(super) fn new(radius: f64, skin: f64) -> Self {
        Self { radius, skin, most: REACH_LEAST * skin, clear: f64::INFINITY }
    }

    /// Sets the contact offset `skin` (m).
    pub(super) fn set_skin(&mut self, skin: f64) {
        self.skin = skin;
        self.most = self.most.max(REACH_LEAST * skin);
    }

    /// m: no point of the body moves farther in the next step.
    pub(super) fn most(&self) -> f64 {
        self.most
    }

    /// Starts a tick, in which everything counts as examined until [`Self::see`] is called.
    pub(super) fn begin(&mut self) {
        self.clear = f64::INFINITY;
    }

    /// Tells that everything this tick's query left out is at least `clear` (m) beyond the skin.
    pub(super) fn see(&mut self, clear: f64) {
        self.clear = self.clear.min(clear.max(0.0));
    }

    /// Something touches: the body may move on slowly, even if something was not examined.
    pub(super) fn touch(&mut self) {
        self.clear = self.clear.max(REACH_CREEP * self.skin);
    }

    /// The share of a step of `h` seconds with `twist`, at most 1, that keeps the body within its
    /// reach and away from regions that no query covered. The body then meets only contacts that
    /// the query has found.
    pub(super) fn share(&self, twist: &Twist, h: f64) -> f64 {
        let (travel, most) = (self.travel(twist, h), self.most.min(self.clear));
        if travel > most { most / travel } else { 1.0 }
    }

    /// The body has moved with `twist` for `h` seconds.
    pub(super) fn follow(&mut self, twist: &Twist, h: f64) {
        let needed = (REACH_GROWTH * self.travel(twist, h)).max(REACH_FADE * self.most);
        self.most = needed.min(TOOL_FASTEST * h).max(REACH_LEAST * self.skin);
    }

    /// m: no point of the body moves farther in `h` seconds with `twist`.
    pub(super) fn travel(&self, twist: &Twist, h: f64) -> f64 {
        (twist.linear.length() + twist.angular.length() * self.radius) * h
    }
}
