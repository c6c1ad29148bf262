//! The gate: checks the states of a device for these faults.
//!
//! 1. A non-finite number or an invalid rotation. The last valid state, at rest, replaces such a
//!    state.
//! 2. A jump: a pose that a hand cannot have reached since the last read. The next read is compared
//!    with the new pose. So a device that was moved away or re-zeroed is accepted at its new pose.
//! 3. A velocity that no hand can reach.
//! 4. A frozen state: it was sampled too long ago, or it reports motion while its pose does not
//!    change.
//! 5. A sample time that runs backwards, or ahead of the loop.
//!
//! The gate only detects faults; the chain reacts to them. The gate is the only part of the
//! chain that needs the device's clock.

use palpus::algebra::Pose;

use super::{Cut, Cuts, SafetyLimits};
use crate::device::DeviceState;
use palpus::algebra::rotation_between;

/// State of the gate between ticks.
#[derive(Clone, Debug)]
pub struct Gate {
    limits: SafetyLimits,
    last: Option<DeviceState>,
    /// Time since the last new sample, s.
    age: f64,
    /// Travel (m) and rotation (rad) by the reported velocities since the pose last changed.
    travel: f64,
    turn: f64,
}

/// A state for the step, and the faults of the state that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Admitted {
    /// The state that was read if it is valid, else the last valid state, at rest; `None` before
    /// the first valid state.
    pub state: Option<DeviceState>,
    /// The state that was read, valid or not.
    pub read: DeviceState,
    /// Faults of the state.
    pub cuts: Cuts,
}

impl Gate {
    /// Returns a gate that has seen no state yet.
    pub fn new(limits: &SafetyLimits) -> Self {
        Self { limits: *limits, last: None, age: 0.0, travel: 0.0, turn: 0.0 }
    }

    /// Checks a state that was read `elapsed` seconds after the previous state.
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
            // Also counts the time of earlier reads that gave no valid state.
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
        // This form of the comparison also detects an infinite or NaN distance as a jump.
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
