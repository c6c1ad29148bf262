//! The thresholds of the safety chain, derived from what a device is.
//!
//! Every threshold is a formula over the [`DeviceSpec`] and the loop's period.
//! [`SafetyLimits::explained`] lists values, formulas and reasons, for people.

use crate::acting::DELAY_MAX;
use crate::device::{DeviceSpec, known_devices};

/// N: more than any of the desktop devices gives; the largest arms sold for a hand are near it. A
/// larger stated value is reduced to this.
const FORCE_BELIEVED: f64 = 40.0;
/// N·m, likewise.
const TORQUE_BELIEVED: f64 = 5.0;
/// N, N·m, s: a smaller value that a device states counts as 0. Far below what can be felt;
/// squares of much smaller numbers vanish.
const LEAST_BELIEVED: f64 = 1e-9;
/// Continuous force over peak force when the maker does not state it. Stated pairs: Phantom Premium
/// 1.5 1.4/8.5, Premium 3.0 3/22, Touch 0.88/3.3, Touch X 1.75/7.9: 0.14 to 0.27.
const CONTINUOUS_SHARE: f64 = 0.2;
/// s: thermal time constant of the windings of motors of this size (tens of seconds in their data
/// sheets).
const HEATING_TIME: f64 = 30.0;
/// s in which a wrench may go from nothing to the peak. A rise of 2 ms has content to 0.35 / 2 ms =
/// 175 Hz: contact transients pass, a jump from one end to the other takes four ticks at 1 kHz.
const RISE_TIME: f64 = 2e-3;
/// m/s: the fastest reaching movements of an arm.
const HAND_SPEED: f64 = 3.0;
/// s in which a hand does not cross the whole workspace of a small device.
const CROSSING_TIME: f64 = 0.1;
/// rad/s (2000 °/s): the fastest turns of a wrist.
const HAND_TURN: f64 = 35.0;
/// m that a position may be off between two reads, beyond the motion: steps of encoders and noise.
const POSITION_SLACK: f64 = 0.5e-3;
/// rad, likewise.
const ANGLE_SLACK: f64 = 5e-3;
/// s for which an orientation is held by grips whose sensors are slower than the loop (50 to 60 Hz
/// have been seen on devices that do not drive the rotation).
const ORIENTATION_HOLD: f64 = 20e-3;
/// Largest age of a state (s) that still gets a force; at 0.5 m/s the hand moves 5 mm in that time.
const STALE_TIME: f64 = 10e-3;
/// Periods that a state may be old, for slow loops.
const STALE_PERIODS: f64 = 5.0;
/// m travelled, by the velocity that the device states, without the pose changing by a bit.
const FROZEN_TRAVEL: f64 = 10e-3;
/// rad, likewise.
const FROZEN_TURN: f64 = 0.5;
/// kg: a light arm in a relaxed hand, the least that a held force has to move.
const LIGHT_MASS: f64 = 0.2;
/// m that a force which is held by mistake may move a light hand.
const STALL_TRAVEL: f64 = 10e-3;
/// s, whatever the force.
const STALL_LONGEST: f64 = 50e-3;
/// s and periods: not even a strong device's watchdog bites on one late tick.
const STALL_SHORTEST: f64 = 10e-3;
const STALL_PERIODS: f64 = 5.0;
/// Largest wrench at which it engages, as a share of the peak.
const ENGAGE_SHARE: f64 = 0.1;
/// s from engagement to the full wrench: longer than a hand's reaction (0.15 to 0.2 s).
const RAMP_TIME: f64 = 0.25;
/// s without a fault before it may be engaged again.
const HOLD_TIME: f64 = 0.25;
/// s/m: damping at rest over peak force, so that it reaches [`REST_SHARE`] at 0.4 m/s. At 8.5 N it
/// is 2.1 N·s/m, a tenth of what a light arm of 0.1 kg, its velocity filtered at 100 Hz and its
/// wrench two ticks late, would begin to hum with.
const REST_DAMPING: f64 = 0.25;
/// s/rad, likewise, over peak torque: 9.4e-4 N·m·s/rad at 0.188 N·m.
const REST_ANGULAR_DAMPING: f64 = 5e-3;
/// Largest damping wrench at rest, as a share of the peak.
const REST_SHARE: f64 = 0.1;
/// m: peak force over it is the energy that a port may give. What a slow oscillation of a
/// millimetre at an eighth of the peak turns over; steps of encoders (0.03 mm) stay far below it.
const ALLOWED_TRAVEL: f64 = 0.5e-3;

/// The thresholds of the chain. Every one is public, to be read and to be set tighter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyLimits {
    /// Largest force, N.
    pub force_peak: f64,
    /// Largest torque, N·m; 0 when the device has none.
    pub torque_peak: f64,
    /// Force that the motors bear continuously, N.
    pub force_continuous: f64,
    /// Torque that the motors bear continuously, N·m.
    pub torque_continuous: f64,
    /// Thermal time constant of the motors, s.
    pub heating_time: f64,
    /// Fastest change of the force, N/s.
    pub force_slew: f64,
    /// Fastest change of the torque, N·m/s.
    pub torque_slew: f64,
    /// Fastest plausible motion of the grip, m/s.
    pub speed: f64,
    /// Fastest rotation, rad/s.
    pub turn: f64,
    /// Motion between two reads beyond that at `speed`, m.
    pub jump: f64,
    /// Rotation between two reads beyond that at `turn`, rad.
    pub jump_angle: f64,
    /// Age at which a state is frozen, s.
    pub stale: f64,
    /// Travel by the stated velocity, m, at which a pose that does not change is frozen.
    pub frozen_travel: f64,
    /// Turn by the stated velocity, rad, likewise.
    pub frozen_turn: f64,
    /// Longest time for which a wrench may be held, s.
    pub stall: f64,
    /// Largest computed force at which it is engaged, N.
    pub engage_force: f64,
    /// Largest computed torque at which it is engaged, N·m; not looked at when the device has no
    /// torque.
    pub engage_torque: f64,
    /// From engagement to the full wrench, s.
    pub ramp: f64,
    /// Free of faults before it may be engaged again, s.
    pub hold: f64,
    /// Damping of the grip while a fault lasts, N·s/m.
    pub damping: f64,
    /// N·m·s/rad.
    pub angular_damping: f64,
    /// Most of that, N.
    pub rest_force: f64,
    /// N·m.
    pub rest_torque: f64,
    /// From a write until it acts, beyond being held for a tick, s.
    pub delay: f64,
    /// Smallest change of a sensed position, m; 0 when there is none or it is not known.
    pub position_step: f64,
    /// Smallest change of a sensed orientation, rad, likewise.
    pub angle_step: f64,
    /// Energy that translation, and rotation, may have given to the hand before it is damped, J.
    pub allowance: f64,
}

/// One threshold for people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitLine {
    /// Name of the threshold.
    pub name: &'static str,
    /// In SI units.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
    /// How it follows from the device, and why.
    pub why: &'static str,
}

impl SafetyLimits {
    /// For a device of this `spec` in a loop of `rate_hz`.
    ///
    /// Limits from the values that a device states, after checks. Peaks that are negative or not
    /// numbers count as 0. Those of a device that [`known_devices`] lists are at most the listed
    /// ones, and none is larger than that of any desktop device.
    pub fn of(spec: &DeviceSpec, rate_hz: f64) -> Self {
        let period = 1.0 / rate_hz;
        let known = known_devices().into_iter().find(|known| known.name == spec.name);
        let (known_force, known_torque) =
            known.map_or((FORCE_BELIEVED, TORQUE_BELIEVED), |known| (known.force_max, known.torque_max));
        let force_peak = believed(spec.force_max, known_force);
        let driven = spec.actuated.rotation > 0;
        let torque_peak = if driven { believed(spec.torque_max, known_torque) } else { 0.0 };
        let continuous =
            |stated: Option<f64>, peak: f64| stated.map_or(CONTINUOUS_SHARE * peak, |stated| believed(stated, peak));
        let speed = spec
            .workspace
            .filter(|sides| sides.is_finite() && sides.min_element() > 0.0)
            .map_or(HAND_SPEED, |sides| HAND_SPEED.min(sides.length() / CROSSING_TIME));
        let stall = (2.0 * LIGHT_MASS * STALL_TRAVEL / force_peak).sqrt();
        Self {
            force_peak,
            torque_peak,
            force_continuous: continuous(spec.force_continuous, force_peak),
            torque_continuous: continuous(spec.torque_continuous, torque_peak),
            heating_time: HEATING_TIME,
            force_slew: force_peak / RISE_TIME,
            torque_slew: torque_peak / RISE_TIME,
            speed,
            turn: HAND_TURN,
            jump: POSITION_SLACK,
            jump_angle: if driven { ANGLE_SLACK } else { ANGLE_SLACK + HAND_TURN * ORIENTATION_HOLD },
            stale: STALE_TIME.max(STALE_PERIODS * period),
            frozen_travel: FROZEN_TRAVEL,
            frozen_turn: FROZEN_TURN,
            stall: stall.clamp(STALL_SHORTEST, STALL_LONGEST).max(STALL_PERIODS * period),
            engage_force: ENGAGE_SHARE * force_peak,
            engage_torque: ENGAGE_SHARE * torque_peak,
            ramp: RAMP_TIME,
            hold: HOLD_TIME,
            damping: REST_DAMPING * force_peak,
            angular_damping: REST_ANGULAR_DAMPING * torque_peak,
            rest_force: REST_SHARE * force_peak,
            rest_torque: REST_SHARE * torque_peak,
            delay: believed(spec.delay, DELAY_MAX as f64 * period),
            position_step: believed(spec.position_step, POSITION_SLACK),
            angle_step: believed(spec.angle_step, ANGLE_SLACK),
            allowance: ALLOWED_TRAVEL * force_peak,
        }
    }

    /// Every threshold with its value, formula and reason.
    pub fn explained(&self) -> [LimitLine; 27] {
        let line = |name, value, unit, why| LimitLine { name, value, unit, why };
        [
            line("force_peak", self.force_peak, "N", "as the device states; at most what is known of it, or 40 N"),
            line("torque_peak", self.torque_peak, "N·m", "likewise, or 5 N·m; 0 when its rotation is not driven"),
            line("force_continuous", self.force_continuous, "N", "as stated, else 0.2 of the peak"),
            line("torque_continuous", self.torque_continuous, "N·m", "as stated, else 0.2 of the peak"),
            line("heating_time", self.heating_time, "s", "windings of small motors; RMS over it stays at continuous"),
            line("force_slew", self.force_slew, "N/s", "peak in 2 ms: transients to 175 Hz pass"),
            line("torque_slew", self.torque_slew, "N·m/s", "peak in 2 ms"),
            line("speed", self.speed, "m/s", "fastest reaching 3 m/s; no crossing of the workspace in 0.1 s"),
            line("turn", self.turn, "rad/s", "fastest turn of a wrist, 2000 °/s"),
            line("jump", self.jump, "m", "between two reads beyond that speed: encoders and noise"),
            line("jump_angle", self.jump_angle, "rad", "likewise; 20 ms of turning more for grips with slow sensors"),
            line("stale", self.stale, "s", "5 mm at 0.5 m/s; at least 5 periods"),
            line("frozen_travel", self.frozen_travel, "m", "by the stated velocity, with the same pose to the bit"),
            line("frozen_turn", self.frozen_turn, "rad", "likewise"),
            line("stall", self.stall, "s", "√(2·0.2 kg·10 mm/peak): a held force moves a light hand 10 mm"),
            line("engage_force", self.engage_force, "N", "0.1 of the peak"),
            line("engage_torque", self.engage_torque, "N·m", "0.1 of the peak"),
            line("ramp", self.ramp, "s", "longer than a hand's reaction"),
            line("hold", self.hold, "s", "without a fault before it engages again"),
            line("damping", self.damping, "N·s/m", "0.25 s/m of the peak, while a fault lasts"),
            line("angular_damping", self.angular_damping, "N·m·s/rad", "0.005 s/rad of the peak"),
            line("rest_force", self.rest_force, "N", "0.1 of the peak: the most of that damping"),
            line("rest_torque", self.rest_torque, "N·m", "0.1 of the peak"),
            line("delay", self.delay, "s", "from a write until it acts, as the device states; at most 8 periods"),
            line("position_step", self.position_step, "m", "of the encoders, as the device states; at most 0.5 mm"),
            line("angle_step", self.angle_step, "rad", "likewise; at most 0.005 rad"),
            line(
                "allowance",
                self.allowance,
                "J",
                "peak over 0.5 mm: given to the hand before passivity takes it back",
            ),
        ]
    }

    /// Again from values by name, such as [`SafetyLimits::explained`] gives; `None` if one is
    /// missing.
    pub fn from_values(value: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        Some(Self {
            force_peak: value("force_peak")?,
            torque_peak: value("torque_peak")?,
            force_continuous: value("force_continuous")?,
            torque_continuous: value("torque_continuous")?,
            heating_time: value("heating_time")?,
            force_slew: value("force_slew")?,
            torque_slew: value("torque_slew")?,
            speed: value("speed")?,
            turn: value("turn")?,
            jump: value("jump")?,
            jump_angle: value("jump_angle")?,
            stale: value("stale")?,
            frozen_travel: value("frozen_travel")?,
            frozen_turn: value("frozen_turn")?,
            stall: value("stall")?,
            engage_force: value("engage_force")?,
            engage_torque: value("engage_torque")?,
            ramp: value("ramp")?,
            hold: value("hold")?,
            damping: value("damping")?,
            angular_damping: value("angular_damping")?,
            rest_force: value("rest_force")?,
            rest_torque: value("rest_torque")?,
            delay: value("delay")?,
            // Recordings made before the account knew of encoder steps do not say.
            position_step: value("position_step").unwrap_or(0.0),
            angle_step: value("angle_step").unwrap_or(0.0),
            allowance: value("allowance")?,
        })
    }

    /// These where they are tighter than `others`, and `others` where not. Tighter is shorter and
    /// smaller, but for the ramp and the time without faults; more damping is not tighter, it may
    /// hum. The delay and the encoders' steps are no thresholds and stay.
    #[must_use]
    pub fn within(&self, others: &Self) -> Self {
        Self {
            force_peak: self.force_peak.min(others.force_peak),
            torque_peak: self.torque_peak.min(others.torque_peak),
            force_continuous: self.force_continuous.min(others.force_continuous),
            torque_continuous: self.torque_continuous.min(others.torque_continuous),
            heating_time: self.heating_time.min(others.heating_time),
            force_slew: self.force_slew.min(others.force_slew),
            torque_slew: self.torque_slew.min(others.torque_slew),
            speed: self.speed.min(others.speed),
            turn: self.turn.min(others.turn),
            jump: self.jump.min(others.jump),
            jump_angle: self.jump_angle.min(others.jump_angle),
            stale: self.stale.min(others.stale),
            frozen_travel: self.frozen_travel.min(others.frozen_travel),
            frozen_turn: self.frozen_turn.min(others.frozen_turn),
            stall: self.stall.min(others.stall),
            engage_force: self.engage_force.min(others.engage_force),
            engage_torque: self.engage_torque.min(others.engage_torque),
            ramp: self.ramp.max(others.ramp),
            hold: self.hold.max(others.hold),
            damping: self.damping.min(others.damping),
            angular_damping: self.angular_damping.min(others.angular_damping),
            rest_force: self.rest_force.min(others.rest_force),
            rest_torque: self.rest_torque.min(others.rest_torque),
            delay: self.delay,
            position_step: self.position_step,
            angle_step: self.angle_step,
            allowance: self.allowance.min(others.allowance),
        }
    }

    /// True when every threshold is a number from 0 up. Infinite ones switch a stage off, which is
    /// for tests.
    pub fn is_valid(&self) -> bool {
        self.explained().iter().all(|line| line.value >= 0.0)
    }
}

/// `stated`, if it is a number up to `most`; `most` if it is larger, and nothing if it is no such
/// number or next to nothing.
fn believed(stated: f64, most: f64) -> f64 {
    if stated >= LEAST_BELIEVED { stated.min(most) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    #[test]
    fn a_device_that_lies_is_not_believed() {
        let [premium, .., inverse3] = known_devices();
        let of = |name: &'static str, force_max, torque_max| {
            let spec = DeviceSpec { name: Cow::Borrowed(name), force_max, torque_max, ..premium.clone() };
            let limits = SafetyLimits::of(&spec, 1000.0);
            assert!(limits.is_valid() && limits.explained().iter().all(|line| line.value.is_finite()), "{limits:?}");
            (limits.force_peak, limits.torque_peak)
        };
        assert_eq!(of("Phantom Premium 1.5/6DOF", 300.0, 9.0), (8.5, 0.188));
        assert_eq!(of("Phantom Premium 1.5/6DOF", 2.0, 0.1), (2.0, 0.1));
        assert_eq!(of("no one knows it", 300.0, f64::INFINITY), (40.0, 5.0));
        assert_eq!(of("no one knows it", f64::NAN, -1.0), (0.0, 0.0));
        // Found by fuzzing: the square of such a rating is no number that heat can be held against.
        assert_eq!(of("no one knows it", 1e-160, 1e-317), (0.0, 0.0));
        // Its rotation is not driven, whatever it says.
        let limits = SafetyLimits::of(&DeviceSpec { torque_max: 1.0, ..inverse3 }, 1000.0);
        assert_eq!((limits.torque_peak, limits.rest_torque), (0.0, 0.0));
    }

    #[test]
    fn limits_that_are_given_are_held_to_those_of_the_device() {
        use crate::safety::SafetyOptions;
        let [premium, ..] = known_devices();
        let derived = SafetyLimits::of(&premium, 1000.0);
        let of = |given, loosened| {
            SafetyOptions { limits: Some(given), loosened, ..SafetyOptions::default() }.limits(&premium, 1000.0)
        };
        let looser = SafetyLimits {
            force_peak: 100.0,
            force_slew: f64::INFINITY,
            stall: 10.0,
            ramp: 0.0,
            hold: 0.0,
            damping: 50.0,
            allowance: 1.0,
            ..derived
        };
        assert_eq!((of(looser, false), of(looser, true)), (derived, looser));
        let tighter = SafetyLimits { force_peak: 1.0, ramp: 2.0, allowance: 0.0, speed: 0.5, ..derived };
        assert_eq!(of(tighter, false), tighter);
    }

    #[test]
    fn every_known_device_has_limits_that_fit_each_other() {
        for spec in known_devices() {
            for rate in [500.0, 1000.0, 10_000.0] {
                let limits = SafetyLimits::of(&spec, rate);
                assert!(limits.is_valid(), "{}", spec.name);
                let lines = limits.explained();
                let value = |name: &str| lines.iter().find(|line| line.name == name).map(|line| line.value);
                assert_eq!(SafetyLimits::from_values(value), Some(limits));
                assert!(limits.force_continuous <= limits.force_peak && limits.rest_force <= limits.force_peak);
                assert!((0.01..=0.05).contains(&limits.stall) && limits.stall * rate >= 5.0, "{}", spec.name);
                assert!(limits.speed > 1.0 && limits.force_slew / rate < limits.force_peak * 1.001);
            }
        }
    }
}
