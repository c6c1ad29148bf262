//! Idle pairs: they are within the tolerance, but cannot have a contact before some motion.
//!
//! Most pairs of pieces within the tolerance are apart and have no contact: the direction of their
//! closest points is not a normal of the meshes. The caller states how far the bodies must move and
//! turn before that can change ([`Front::set_idle`]). Until then, queries do not measure the pair.
//!
//! The front also stores the caller's reason, because it may hold for longer than this motion.

use glam::Vec3;

use super::Front;
use crate::algebra::tolerance::IDLE_RETRY;
use crate::collision::LeafPair;

/// Until when the pair at a place is idle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Idle {
    /// The motion bound's sum, and its sum of rotations (rad), until which the pair is idle.
    until: u64,
    until_turned: f64,
    /// The motion bound's sum from which on the caller may make the pair idle again.
    retry: u64,
    reason: IdleReason,
}

/// Why a pair has no contact: one of the pieces does not admit the direction of the closest points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IdleReason {
    /// The motion bound's sum of rotations (rad) until which no valley of this piece can give a
    /// contact.
    pub(crate) valleys_until: f64,
    /// The direction at some query, from this piece, in its frame.
    pub(crate) outward: Vec3,
    /// The angle (rad) between `outward` and all admissible normals of this piece.
    pub(crate) angle: f32,
    /// True if this piece is a's.
    pub(crate) is_a: bool,
}

/// A relative motion of two bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// No distance changes by more, model units.
    pub(crate) motion: f64,
    /// Rotation, rad.
    pub(crate) turn: f64,
}

impl Idle {
    /// A pair that is not idle.
    pub(super) const NONE: Self = Self { until: 0, until_turned: 0.0, retry: 0, reason: IdleReason::NONE };
}

impl IdleReason {
    /// No reason.
    const NONE: Self = Self { valleys_until: f64::NEG_INFINITY, outward: Vec3::ZERO, angle: 0.0, is_a: true };
}

impl Front {
    /// True if the pair at `place` is idle.
    #[inline]
    pub(super) fn is_idle(&self, place: u32) -> bool {
        let Idle { until, until_turned, .. } = &self.idle[place as usize];
        self.motion_bound.sum() <= *until && self.motion_bound.turned() <= *until_turned
    }

    /// Ends the idleness of the pair at `place`, which was not within the tolerance before. The
    /// caller may make it idle from the next query on: at a single pose, that would cost more than
    /// it saves.
    pub(super) fn end_idle(&mut self, place: u32) {
        self.idle[place as usize] = Idle { retry: self.motion_bound.sum(), ..Idle::NONE };
    }

    /// Returns the last reason of a pair, and the approximate motion of the bodies in a tick, if
    /// the pair may become idle now.
    pub(crate) fn idle_reason(&self, pair: &LeafPair) -> Option<(IdleReason, Pace)> {
        let Idle { retry, reason, .. } = &self.idle[pair.place? as usize];
        (self.motion_bound.sum() > *retry).then_some((*reason, self.pace))
    }

    /// Makes a pair idle for this motion, for this reason. `None` if it may have a contact too
    /// soon; the caller then asks again after some ticks.
    pub(crate) fn set_idle(&mut self, pair: &LeafPair, limit: Option<(IdleReason, Pace)>) {
        let Some(place) = pair.place else { return };
        let bound = &self.motion_bound;
        self.idle[place as usize] = match limit {
            Some((reason, Pace { motion, turn })) => {
                Idle { until: bound.due(motion), until_turned: bound.turned() + turn, retry: bound.sum(), reason }
            }
            None => Idle { retry: bound.due(IDLE_RETRY * self.pace.motion), ..Idle::NONE },
        };
    }

    /// Returns the sum of all rotations so far, rad.
    pub(crate) fn turned(&self) -> f64 {
        self.motion_bound.turned()
    }

    /// Ends the idleness of all pairs, because the limits were stated for other settings.
    pub(crate) fn end_all_idle(&mut self) {
        for k in 0..self.awake.len() {
            self.end_idle(self.awake[k]);
        }
    }

    /// Returns the number of pairs that were idle in the last query.
    pub(crate) fn idle(&self) -> u32 {
        self.idle_count
    }
}
