//! The gate: checks of a device's states.
//!
//! 1. A number that is not finite, or an invalid rotation: the last good state stands in, at rest.
//! 2. A pose that a hand could not have brought about since the last read: a jump. The next read is
//!    compared with the new pose, so that a device that was moved away, or re-zeroed, is accepted
//!    again where it now is.
//! 3. A velocity that no hand has.
//! 4. A state that was sampled too long ago; or one that says that it moves while its pose does not
//!    change by a bit.
//! 5. A sample time that runs backwards, or ahead of the loop.
//!
//! The gate only finds; what follows is the chain's. It is the one part of the chain that needs the
//! device and the clock.

use palpus::algebra::Pose;

use super::{Cut, Cuts, SafetyLimits};
use crate::device::DeviceState;
use palpus::algebra::rotation_between;

/// State of the gate between ticks.
#[derive(Clone, Debug)]
pub struct Gate {
    limits: SafetyLimits,
    last: Option<DeviceState>,
    /// s since the newest sample was new.
    age: f64,
    /// m and rad by the stated velocities since the pose changed last.
    travel: f64,
    turn: f64,
}

/// A state to go on with, and the faults of the one that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Admitted {
    /// As read if it is a state at all, else the last one that was, at rest; `None` while there has
    /// been none.
    pub state: Option<DeviceState>,
    /// The state as read, accepted or not.
    pub read: DeviceState,
    /// Faults of the state.
    pub cuts: Cuts,
}

impl Gate {
    /// A gate that has seen nothing yet.
    pub fn new(limits: &SafetyLimits) -> Self {
        Self { limits: *limits, last: None, age: 0.0, travel: 0.0, turn: 0.0 }
    }

    /// Looks at a state that was read `elapsed` seconds after the last one.
    pub fn admit(&mut self, read: &DeviceState, elapsed: f64) -> Admitted {
        let mut cuts = Cuts::NONE;
        if !is_finite(read) {
            cuts.note(Cut::NonFiniteState, true);
            self.age += elapsed;
            let state = self.last.map(|last| DeviceState { twist: Default::default(), ..last });
            return Admitted { state, read: *read, cuts };
        }
        let limits = self.limits;
        cuts.note(Cut::Speed, read.twist.linear.length() > limits.speed || read.twist.angular.length() > limits.turn);
        if let Some(last) = self.last {
            // Reads that gave no state are part of the way to this one.
            let since = elapsed + self.age;
            cuts.note(Cut::PoseJump, self.is_jump(&last.pose, &read.pose, since));
            self.watch_motion(&last, read, elapsed);
            let passed = read.time - last.time;
            cuts.note(Cut::DeviceClock, passed < 0.0 || passed > since + limits.stale);
            self.age = if passed.abs() > 0.0 { 0.0 } else { since };
            let frozen =
                self.age > limits.stale || self.travel > limits.frozen_travel || self.turn > limits.frozen_turn;
            cuts.note(Cut::FrozenState, frozen);
        } else {
            self.age = 0.0;
        }
        self.last = Some(*read);
        Admitted { state: Some(*read), read: *read, cuts }
    }

    fn is_jump(&self, from: &Pose, to: &Pose, since: f64) -> bool {
        let moved = to.translation.distance(from.translation);
        let turned = rotation_between(from.rotation, to.rotation).length();
        // Also what is too far to be measured.
        !(moved <= self.limits.speed * since + self.limits.jump
            && turned <= self.limits.turn * since + self.limits.jump_angle)
    }

    fn watch_motion(&mut self, last: &DeviceState, read: &DeviceState, elapsed: f64) {
        if last.pose == read.pose {
            self.travel += read.twist.linear.length() * elapsed;
            self.turn += read.twist.angular.length() * elapsed;
        } else {
            (self.travel, self.turn) = (0.0, 0.0);
        }
    }
}

fn is_finite(state: &DeviceState) -> bool {
    let twist = &state.twist;
    state.pose.is_valid() && twist.linear.is_finite() && twist.angular.is_finite() && state.time.is_finite()
}
