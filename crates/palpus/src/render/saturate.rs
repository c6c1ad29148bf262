//! Limits a wrench to the device's limits \[K02 §4.3, end\].

use glam::DVec3;

use crate::algebra::Wrench;
use crate::algebra::tolerance::SATURATION_ROUNDING;

/// Limits of the commanded force and torque; infinite for no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Limits {
    /// Force, N.
    pub force: f64,
    /// Torque about the grip, N·m.
    pub torque: f64,
}

impl Limits {
    /// No limits.
    pub const UNLIMITED: Self = Self { force: f64::INFINITY, torque: f64::INFINITY };
}

/// How a wrench that exceeds the limits is reduced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Saturation {
    /// Force and torque are scaled separately and keep their directions. This is the paper's rule.
    #[default]
    Separate,
    /// Force and torque are scaled by one factor, so the wrench keeps its line of action. If the
    /// torque limit is small, the force becomes small too.
    Joint,
    /// For devices that sense six degrees of freedom and drive three: only the force at the grip is
    /// commanded. The tick contains the torque for display.
    UnderActuated,
}

/// A wrench within the limits, and how it was changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saturated {
    /// The wrench, about the same point as the original wrench.
    pub wrench: Wrench,
    /// True if the force was reduced.
    pub force_cut: bool,
    /// True if the torque was reduced.
    pub torque_cut: bool,
    /// True if the original wrench was not finite; then `wrench` is zero.
    pub non_finite: bool,
}

/// Reduces `wrench` to `limits`. The result never exceeds a limit, not even by rounding.
pub fn saturate(wrench: Wrench, limits: &Limits, policy: Saturation) -> Saturated {
    if !wrench.is_finite() {
        return Saturated { wrench: Wrench::ZERO, force_cut: false, torque_cut: false, non_finite: true };
    }
    match policy {
        Saturation::Separate => {
            let (force, force_cut) = shorten(wrench.force, limits.force);
            let (torque, torque_cut) = shorten(wrench.torque, limits.torque);
            Saturated { wrench: Wrench { torque, force }, force_cut, torque_cut, non_finite: false }
        }
        Saturation::Joint => {
            let (force_share, torque_share) = (share(wrench.force, limits.force), share(wrench.torque, limits.torque));
            let share = force_share.min(torque_share);
            // If force or torque is at its limit, both count as reduced.
            let cut = share < 1.0;
            // Each part is shortened again, because a very small factor is inexact.
            let within = |v: DVec3, limit| shorten(v * share, limit).0;
            let wrench =
                Wrench { torque: within(wrench.torque, limits.torque), force: within(wrench.force, limits.force) };
            Saturated { wrench, force_cut: cut, torque_cut: cut, non_finite: false }
        }
        Saturation::UnderActuated => {
            let (force, force_cut) = shorten(wrench.force, limits.force);
            Saturated { wrench: Wrench { torque: DVec3::ZERO, force }, force_cut, torque_cut: false, non_finite: false }
        }
    }
}

/// Returns `v`, shortened to `limit` if it is longer, and true if it was longer.
fn shorten(v: DVec3, limit: f64) -> (DVec3, bool) {
    let Some((scaled, length)) = beyond(v, limit) else { return (v, false) };
    if limit < f64::MIN_POSITIVE {
        // Subnormal numbers have too few digits for scaling by a factor near 1.
        return (DVec3::ZERO, true);
    }
    (scaled * (limit * (1.0 - SATURATION_ROUNDING) / length), true)
}

/// Returns the factor (at most 1) that shortens `v` to `limit`.
fn share(v: DVec3, limit: f64) -> f64 {
    let Some((_, length)) = beyond(v, limit) else { return 1.0 };
    limit * (1.0 - SATURATION_ROUNDING) / length / v.abs().max_element()
}

/// If `v` is longer than `limit`, returns `v` divided by its largest component, and the length of
/// the quotient. Otherwise returns `None`. The division keeps squares finite.
fn beyond(v: DVec3, limit: f64) -> Option<(DVec3, f64)> {
    let largest = v.abs().max_element();
    if largest <= 0.0 {
        return None;
    }
    let scaled = v / largest;
    let length = scaled.length();
    (length * largest > limit).then_some((scaled, length))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };

    #[test]
    fn force_and_torque_keep_their_directions() {
        let wrench = Wrench { torque: DVec3::new(0.1, -0.7, 0.2), force: DVec3::new(-30.0, 4.0, 1e-3) };
        let answer = saturate(wrench, &LIMITS, Saturation::Separate);
        assert!(answer.force_cut && answer.torque_cut && !answer.non_finite);
        for (before, after, limit) in
            [(wrench.force, answer.wrench.force, LIMITS.force), (wrench.torque, answer.wrench.torque, LIMITS.torque)]
        {
            assert!(after.length() <= limit && after.length() > limit * (1.0 - 1e-12));
            assert!((before.normalize() - after.normalize()).length() < 1e-15);
        }
        let weak = Wrench { torque: wrench.torque * 0.01, force: wrench.force * 0.01 };
        assert_eq!(saturate(weak, &LIMITS, Saturation::Separate).wrench, weak);
    }

    #[test]
    fn force_and_torque_are_limited_separately() {
        let wrench = Wrench { torque: DVec3::X, force: DVec3::Y };
        let answer = saturate(wrench, &LIMITS, Saturation::Separate);
        assert!(!answer.force_cut && answer.torque_cut);
        assert_eq!(answer.wrench.force, DVec3::Y);
        assert!(answer.wrench.torque.dot(DVec3::X) > 0.18);
    }

    #[test]
    fn joint_scaling_keeps_the_line_of_action() {
        let wrench = Wrench { torque: DVec3::new(0.0, 0.4, 0.0), force: DVec3::new(8.0, 0.0, 2.0) };
        let answer = saturate(wrench, &LIMITS, Saturation::Joint);
        assert!(answer.force_cut && answer.torque_cut);
        let share = answer.wrench.torque.length() / 0.4;
        assert!((share - LIMITS.torque / 0.4).abs() < 1e-12 && answer.wrench.torque.length() <= LIMITS.torque);
        assert!((answer.wrench.force - wrench.force * share).length() < 1e-14);
        let weak = Wrench { torque: wrench.torque * 0.1, force: wrench.force * 0.1 };
        assert_eq!(saturate(weak, &LIMITS, Saturation::Joint).wrench, weak);
    }

    #[test]
    fn under_actuated_device_gets_only_the_force() {
        let wrench = Wrench { torque: DVec3::Y, force: DVec3::new(30.0, 0.0, 0.0) };
        let answer = saturate(wrench, &LIMITS, Saturation::UnderActuated);
        assert_eq!(answer.wrench.torque, DVec3::ZERO);
        assert!(answer.force_cut && !answer.torque_cut && answer.wrench.force.length() <= LIMITS.force);
    }

    #[test]
    fn extremes_stay_finite() {
        let huge = Wrench { torque: DVec3::splat(f64::MAX), force: DVec3::new(-1e300, 1e300, 0.0) };
        let answer = saturate(huge, &LIMITS, Saturation::Separate);
        assert!((answer.wrench.force.normalize() - DVec3::new(-1.0, 1.0, 0.0).normalize()).length() < 1e-15);
        assert!(answer.wrench.torque.length() > 0.187);
        let joint = saturate(huge, &LIMITS, Saturation::Joint).wrench;
        assert!(joint.is_finite() && joint.force.length() <= LIMITS.force && joint.torque.length() <= LIMITS.torque);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let wrench = Wrench { torque: DVec3::X, force: DVec3::new(0.0, bad, 0.0) };
            let answer = saturate(wrench, &LIMITS, Saturation::Separate);
            assert!(answer.non_finite);
            assert_eq!(answer.wrench, Wrench::ZERO);
        }
        let unlimited = Limits { force: f64::INFINITY, torque: 0.0 };
        let answer = saturate(Wrench { torque: DVec3::X, force: DVec3::Y * 1e9 }, &unlimited, Saturation::Separate);
        assert_eq!(answer.wrench, Wrench { torque: DVec3::ZERO, force: DVec3::Y * 1e9 });
    }
}
