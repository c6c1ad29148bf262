//! The anchor: the point at which the coupling is attached to the device. It slips when a hand
//! presses harder than the device can push back.
//!
//! If a hand is stronger than the device, it stretches the spring beyond the force limit. Then the
//! hand would feel the full force on its whole way back. So a slip clutch attaches the coupling to
//! the device:
//!
//! 1. *Slip*: if the stretch exceeds the stretch at the force limit plus [`COUPLING_SLIP`], the
//!    anchor moves. The force is at its limit then, so it does not jump, and the hand does the
//!    work.
//! 2. *Return*: in free air, where the coupling has no force, the anchor moves back to the grip by
//!    at most [`COUPLING_RETURN`] of the device's own motion. So the tool rests while the hand
//!    rests, and the anchor alone never moves the tool into contact.
//!
//! The anchor's rotation slips and returns in the same way. Without a torque limit, it slips before
//! half a turn, because beyond half a turn the spring's direction would reverse.
//!
//! Neither slip nor return does work on the hand: a slip dissipates energy, and a return happens
//! without force.

use glam::{DQuat, DVec3};

use crate::algebra::tolerance::{COUPLING_MOST_TURN, COUPLING_RETURN, COUPLING_SLIP, COUPLING_SLIP_TURN};
use crate::algebra::{Twist, rotation_between};

/// Displacement of the anchor from the device's grip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    /// Translation of the anchor, m, in b's frame.
    slip: DVec3,
    /// Orientation of the anchor in the device's frame. If it were a rotation in b's frame, the
    /// torque after a slip by more than a quarter turn would push the device farther in the
    /// direction in which a hand tilts it.
    turn: DQuat,
}

impl Anchor {
    /// The anchor at the grip.
    pub(super) const AT_GRIP: Self = Self { slip: DVec3::ZERO, turn: DQuat::IDENTITY };

    /// Moves the anchor if it slips. Returns the coupling's stretch (m), where `ahead` is the
    /// vector from the tool to the device (m). The spring reaches its force limit at a stretch of
    /// `levelled` (m).
    pub(super) fn stretch(&mut self, ahead: DVec3, levelled: f64) -> DVec3 {
        let stretch = ahead + self.slip;
        let share = share_kept(stretch.length(), levelled + COUPLING_SLIP);
        self.slip -= stretch * (1.0 - share);
        stretch * share
    }

    /// Moves the anchor if it slips. Returns the coupling's rotation (rad) from the tool to the
    /// device. The spring reaches its torque limit at a rotation of `levelled` (rad).
    pub(super) fn turn(&mut self, tool: DQuat, device: DQuat, levelled: f64) -> DVec3 {
        let anchor = device * self.turn;
        let turn = rotation_between(tool, anchor);
        let share = share_kept(turn.length(), (levelled + COUPLING_SLIP_TURN).min(COUPLING_MOST_TURN));
        if share < 1.0 {
            let slipped = DQuat::from_scaled_axis(turn * (share - 1.0)) * anchor;
            self.turn = (device.conjugate() * slipped).normalize();
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

/// Returns the factor that shortens `length` to at most `most`.
fn share_kept(length: f64, most: f64) -> f64 {
    if length > most { most / length } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn continued_rotation_gives_no_jump() {
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

    #[test]
    fn torque_opposes_a_tilt_after_any_slip() {
        let (levelled, tilt) = (0.2, 1e-3);
        for k in 0..200 {
            let device = DQuat::from_rotation_z(0.02 * f64::from(k));
            let mut anchor = Anchor::AT_GRIP;
            for j in 0..=k {
                anchor.turn(DQuat::IDENTITY, DQuat::from_rotation_z(0.02 * f64::from(j)), levelled);
            }
            let before = anchor.turn(DQuat::IDENTITY, device, levelled);
            let after = anchor.turn(DQuat::IDENTITY, DQuat::from_rotation_x(tilt) * device, levelled);
            assert!((after - before).x > 0.9 * tilt, "after {} rad: {}", 0.02 * f64::from(k), after - before);
        }
    }
}
