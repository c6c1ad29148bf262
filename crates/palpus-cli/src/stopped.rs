//! An engine after a run.

use palpus_window::Moment;

use crate::engine::Engine;
use crate::two::TwoEngine;

/// An engine that has made its last step.
pub(crate) enum Stopped {
    /// Of one device.
    One(Box<Engine>),
    /// Of two.
    Two(Box<TwoEngine>),
}

impl Stopped {
    /// What the kept tick has to show, or the last one, if there is none; `period` is a tick's, s.
    pub(crate) fn shown(self, period: f64) -> Moment {
        match self {
            Self::One(engine) => engine.shown(period),
            Self::Two(engine) => engine.shown(period),
        }
    }
}
