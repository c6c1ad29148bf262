//! The anchor: where the coupling is tied to the device. It slips when a hand presses harder than
//! the device can push back.
//!
//! A spring that has levelled off stretches on under a hand that is stronger than the device, and
//! the hand would feel the full force on all of its way back. So the coupling is tied to the device
//! by a clutch:
//!
//! 1. *Slip*: a stretch beyond that of the force which is there, and [`COUPLING_SLIP`], shifts the
//!    anchor. The force has levelled off by then, so nothing jumps, and the hand has paid for the
//!    way.
//! 2. *Return*: in free air, where the coupling is slack, the anchor goes back to the grip, by at
//!    most [`COUPLING_RETURN`] of the device's own motion: a hand that is still sees its tool
//!    still, and a tool is never moved into contact by its anchor alone.
//!
//! Rotation likewise, and also where no torque limit levels the spring off: it slips before half a
//! turn, at which the shortest way back would be the other way round. Neither does work on the hand: a slip takes energy, and a return moves
//! nothing that pulls.

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

    /// Returns the coupling's stretch for a device `ahead` (m) of the tool; its spring levels off
    /// at `levelled` (m). Slips.
    pub(super) fn stretch(&mut self, ahead: DVec3, levelled: f64) -> DVec3 {
        let stretch = ahead + self.slip;
        let share = share_kept(stretch.length(), levelled + COUPLING_SLIP);
        self.slip -= stretch * (1.0 - share);
        stretch * share
    }

    /// Returns the coupling's turn (rad) from the tool's rotation to the device's; its spring
    /// levels off at `levelled`. Slips.
    pub(super) fn turn(&mut self, tool: DQuat, device: DQuat, levelled: f64) -> DVec3 {
        let turn = rotation_between(tool, self.turn * device);
        let share = share_kept(turn.length(), (levelled + COUPLING_SLIP_TURN).min(COUPLING_MOST_TURN));
        if share < 1.0 {
            self.turn = (DQuat::from_scaled_axis(turn * (share - 1.0)) * self.turn).normalize();
        }
        turn * share
    }

    /// Goes back to the grip while the device moves with `twist` for `h` seconds.
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
