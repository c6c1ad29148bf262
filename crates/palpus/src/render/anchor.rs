//! The anchor: the point at which the coupling is attached to the device. It slips when a hand
//! presses harder than the device can push back.
//!
//! If a hand is stronger than the device, a spring at its force limit stretches further, and the
//! hand would feel the full force on all of its way back. So the coupling is attached to the device
//! by a slip clutch:
//!
//! 1. *Slip*: if the spring stretches beyond the stretch of its force limit plus [`COUPLING_SLIP`],
//!    the anchor moves. The force is at its limit then, so it does not jump, and the hand does the
//!    work.
//! 2. *Return*: in free air, where the coupling is slack, the anchor moves back to the grip by at
//!    most [`COUPLING_RETURN`] of the device's own motion. So the tool is at rest while the hand is
//!    at rest, and the anchor alone never moves the tool into contact.
//!
//! The same holds for rotation. Where no torque limit levels the angular spring off, it slips as
//! well, before half a turn: beyond half a turn the shortest way back would be the other way round.
//!
//! Neither does work on the hand: a slip takes energy, and a return moves nothing that pulls.

use glam::{DQuat, DVec3};

use crate::algebra::tolerance::{COUPLING_MOST_TURN, COUPLING_RETURN, COUPLING_SLIP, COUPLING_SLIP_TURN};
use crate::algebra::{Twist, rotation_between};

/// How far the anchor has slipped from the device's grip, in b's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    /// m.
    slip: DVec3,
    turn: DQuat,
}

impl Anchor {
    /// At the grip.
    pub(super) const AT_GRIP: Self = Self { slip: DVec3::ZERO, turn: DQuat::IDENTITY };

    /// Moves the anchor if it slips, and returns the coupling's stretch for a device that is
    /// `ahead` (m) of the tool. The spring reaches its force limit at a stretch of `levelled` (m).
    pub(super) fn stretch(&mut self, ahead: DVec3, levelled: f64) -> DVec3 {
        let stretch = ahead + self.slip;
        let share = share_kept(stretch.length(), levelled + COUPLING_SLIP);
        self.slip -= stretch * (1.0 - share);
        stretch * share
    }

    /// Moves the anchor if it slips, and returns the coupling's rotation (rad) from the tool to the
    /// device. The spring reaches its torque limit at a rotation of `levelled` (rad).
    pub(super) fn turn(&mut self, tool: DQuat, device: DQuat, levelled: f64) -> DVec3 {
        let turn = rotation_between(tool, self.turn * device);
        let share = share_kept(turn.length(), (levelled + COUPLING_SLIP_TURN).min(COUPLING_MOST_TURN));
        if share < 1.0 {
            self.turn = (DQuat::from_scaled_axis(turn * (share - 1.0)) * self.turn).normalize();
        }
        turn * share
    }

    /// Moves the anchor back to the grip while the device moves with `twist` for `h` seconds.
    pub(super) fn come_back(&mut self, twist: &Twist, h: f64) {
        let left =
            |away: f64, rate: f64| if away > 0.0 { (1.0 - COUPLING_RETURN * rate * h / away).max(0.0) } else { 0.0 };
        self.slip *= left(self.slip.length(), twist.linear.length());
        let turn = rotation_between(DQuat::IDENTITY, self.turn);
        self.turn = DQuat::from_scaled_axis(turn * left(turn.length(), twist.angular.length()));
    }
}

/// The share of `length` that is within `most`.
fn share_kept(length: f64, most: f64) -> f64 {
    if length > most { most / length } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_goes_on_turning_feels_no_jump() {
        let (step, ticks) = (0.01, 1500);
        let mut anchor = Anchor::AT_GRIP;
        let mut last = DVec3::ZERO;
        for k in 1..=ticks {
            let device = DQuat::from_rotation_z(step * f64::from(k));
            let turn = anchor.turn(DQuat::IDENTITY, device, f64::INFINITY);
            assert!((turn - last).length() < 1.01 * step, "at {} rad: from {last} to {turn}", step * f64::from(k));
            last = turn;
        }
        assert!((last.z - COUPLING_MOST_TURN).abs() < 1e-9, "{last}");
    }
}
