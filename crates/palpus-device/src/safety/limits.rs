//! The thresholds of the safety chain, derived from the description of a device.
//!
//! Every threshold is a formula over the [`DeviceSpec`] and the period of the loop.
//! [`SafetyLimits::explained`] lists values, formulas and reasons for the user.

use TighterValue::{Kept, Larger, Smaller};

use crate::acting::DELAY_MAX;
use crate::device::{DeviceSpec, known_devices};

/// Largest accepted peak force, N. No desktop device gives more force, and the largest hand-held
/// arms give almost this force. A larger stated value is reduced to this limit.
const FORCE_CEILING: f64 = 40.0;
/// Largest accepted peak torque, N·m.
const TORQUE_CEILING: f64 = 5.0;
/// A stated value below this limit counts as 0 (N, N·m, s, m or rad). This value is far below what
/// a hand can feel, and squares of much smaller numbers underflow.
const LEAST_STATED: f64 = 1e-9;
/// Continuous force relative to the peak force if the maker does not state it. Stated pairs (N):
/// Phantom Premium 1.5 1.4/8.5, Premium 3.0 3/22, Touch 0.88/3.3, Touch X 1.75/7.9. The ratios of
/// these pairs are 0.14 to 0.27.
const CONTINUOUS_SHARE: f64 = 0.2;
/// Thermal time constant of the motor windings, s. Data sheets of motors of this size state tens of
/// seconds.
const HEATING_TIME: f64 = 30.0;
/// Time in which a wrench may rise from zero to the peak, s. A rise of 2 ms contains frequencies up
/// to 0.35 / 2 ms = 175 Hz, so contact transients pass. A jump from peak to opposite peak takes
/// four ticks at 1 kHz.
const RISE_TIME: f64 = 2e-3;
/// Speed of the fastest reaching movements of an arm, m/s.
const HAND_SPEED: f64 = 3.0;
/// A hand does not cross the whole workspace of a small device in this time, s.
const CROSSING_TIME: f64 = 0.1;
/// Speed of the fastest rotations of a wrist, rad/s (2000 °/s).
const HAND_TURN: f64 = 35.0;
/// Largest position error between two reads, beyond the motion, m: encoder steps and noise.
const POSITION_SLACK: f64 = 0.5e-3;
/// Largest orientation error between two reads, beyond the rotation, rad.
const ANGLE_SLACK: f64 = 5e-3;
/// Time for which a grip may repeat an orientation, s, if its sensors are slower than the loop.
/// Devices without actuated rotation have shown 50 to 60 Hz.
const ORIENTATION_HOLD: f64 = 20e-3;
/// Largest age of a state that still gets a force, s. At 0.5 m/s the hand moves 5 mm in this time.
const STALE_TIME: f64 = 10e-3;
/// Largest age of a state in periods, for slow loops.
const STALE_PERIODS: f64 = 5.0;
/// Travel by the reported velocity, m, at which an unchanged pose counts as frozen.
const FROZEN_TRAVEL: f64 = 10e-3;
/// Rotation by the reported velocity, rad, at which an unchanged pose counts as frozen.
const FROZEN_TURN: f64 = 0.5;
/// Mass of a light arm in a relaxed hand, kg: the least mass that a held force moves.
const LIGHT_MASS: f64 = 0.2;
/// Distance by which a force that is held by mistake may move a light hand, m.
const STALL_TRAVEL: f64 = 10e-3;
/// Longest time for which a wrench may be held, s, for any force.
const STALL_LONGEST: f64 = 50e-3;
/// Lower bounds of the time for which a wrench may be held, s and periods: a single late tick must
/// not trip the watchdog.
const STALL_SHORTEST: f64 = 10e-3;
const STALL_PERIODS: f64 = 5.0;
/// Largest wrench at which the device engages, as a fraction of the peak.
const ENGAGE_SHARE: f64 = 0.1;
/// Time from zero to the full wrench at a start-up, s. The ramp is longer than a hand's reaction
/// time (0.15 to 0.2 s).
const RAMP_TIME: f64 = 0.25;
/// Time without a fault before the device may be engaged again, s.
const HOLD_TIME: f64 = 0.25;
/// Damping coefficient after a fault, divided by the peak force, s/m: the damping reaches
/// [`REST_SHARE`] of the peak at 0.4 m/s. At 8.5 N the coefficient is 2.1 N·s/m, a tenth of the
/// damping at which a light arm would begin to oscillate (0.1 kg, velocity filtered at 100 Hz,
/// wrench two ticks late).
const REST_DAMPING: f64 = 0.25;
/// Angular damping coefficient after a fault, divided by the peak torque, s/rad: 9.4e-4 N·m·s/rad
/// at 0.188 N·m.
const REST_ANGULAR_DAMPING: f64 = 5e-3;
/// Largest damping wrench after a fault, as a fraction of the peak.
const REST_SHARE: f64 = 0.1;
/// Peak force times this travel, m, is the energy that the hand may receive before passivity acts.
/// This energy equals the energy of a slow oscillation of 1 mm at an eighth of the peak. Encoder
/// steps (0.03 mm) stay far below.
const ALLOWED_TRAVEL: f64 = 0.5e-3;

/// The thresholds of the safety chain. Callers can read the thresholds and set tighter thresholds.
/// By default all thresholds are 0, and no force passes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyLimits {
    /// Largest force, N.
    pub force_peak: f64,
    /// Largest torque, N·m; 0 if the device has no actuated rotation.
    pub torque_peak: f64,
    /// Force that the motors can hold continuously, N.
    pub force_continuous: f64,
    /// Torque that the motors can hold continuously, N·m.
    pub torque_continuous: f64,
    /// Thermal time constant of the motors, s.
    pub heating_time: f64,
    /// Fastest change of the force, N/s.
    pub force_slew: f64,
    /// Fastest change of the torque, N·m/s.
    pub torque_slew: f64,
    /// Fastest plausible translation of the grip, m/s.
    pub speed: f64,
    /// Fastest plausible rotation of the grip, rad/s.
    pub turn: f64,
    /// Largest plausible motion between two reads in addition to the motion at `speed`, m.
    pub jump: f64,
    /// Largest plausible rotation between two reads in addition to the rotation at `turn`, rad.
    pub jump_angle: f64,
    /// Age of a state at which it counts as frozen, s.
    pub stale: f64,
    /// Travel by the reported velocity at which an unchanged pose counts as frozen, m.
    pub frozen_travel: f64,
    /// Rotation by the reported velocity at which an unchanged pose counts as frozen, rad.
    pub frozen_turn: f64,
    /// Longest time for which a wrench may be held, s.
    pub stall: f64,
    /// Largest computed force at which the device engages, N.
    pub engage_force: f64,
    /// Largest computed torque at which the device engages, N·m; ignored if the device has no
    /// torque.
    pub engage_torque: f64,
    /// Time from zero to the full wrench at a start-up, s.
    pub ramp: f64,
    /// Time without a fault before the device may be engaged again, s.
    pub hold: f64,
    /// Damping of the grip during a fault, N·s/m.
    pub damping: f64,
    /// Angular damping of the grip during a fault, N·m·s/rad.
    pub angular_damping: f64,
    /// Largest damping force during a fault, N.
    pub rest_force: f64,
    /// Largest damping torque during a fault, N·m.
    pub rest_torque: f64,
    /// Time from a write until the wrench acts, s, not counting the one tick for which a wrench is
    /// held.
    pub delay: f64,
    /// Smallest change of a sensed position, m; 0 if the sensor has no steps or the step is
    /// unknown.
    pub position_step: f64,
    /// Smallest change of a sensed orientation, rad; 0 if the sensor has no steps or the step is
    /// unknown.
    pub angle_step: f64,
    /// Energy that the hand may receive before the passivity stage damps it, J.
    pub allowance: f64,
}

/// Description of one threshold for the user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitLine {
    /// Name of the threshold.
    pub name: &'static str,
    /// Value in SI units.
    pub value: f64,
    /// Unit of the value.
    pub unit: &'static str,
    /// The formula for the value, and its reason.
    pub why: &'static str,
}

impl SafetyLimits {
    /// Returns the limits for a device with this `spec` in a loop of `rate_hz`.
    ///
    /// The values that the device states are checked first. A peak that is negative or NaN counts
    /// as 0. For a device in [`known_devices`], the peaks are at most the listed peaks. No peak
    /// exceeds 40 N or 5 N·m, which is more than any desktop device gives.
    pub fn of(spec: &DeviceSpec, rate_hz: f64) -> Self {
        let period = 1.0 / rate_hz;
        let known = known_devices().into_iter().find(|known| known.name == spec.name);
        let (known_force, known_torque) =
            known.map_or((FORCE_CEILING, TORQUE_CEILING), |known| (known.force_max, known.torque_max));
        let force_peak = bounded(spec.force_max, known_force);
        let driven = spec.actuated.rotation > 0;
        let torque_peak = if driven { bounded(spec.torque_max, known_torque) } else { 0.0 };
        let continuous =
            |stated: Option<f64>, peak: f64| stated.map_or(CONTINUOUS_SHARE * peak, |stated| bounded(stated, peak));
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
            delay: bounded(spec.delay, DELAY_MAX as f64 * period),
            position_step: bounded(spec.position_step, POSITION_SLACK),
            angle_step: bounded(spec.angle_step, ANGLE_SLACK),
            allowance: ALLOWED_TRAVEL * force_peak,
        }
    }

    /// Returns every threshold with its value, unit, formula and reason.
    pub fn explained(&self) -> [LimitLine; LINES.len()] {
        let mut limits = *self;
        LINES.map(|(name, _, field, unit, why)| LimitLine { name, value: *field(&mut limits), unit, why })
    }

    /// Restores the limits from values by name, as [`SafetyLimits::explained`] lists them; `None`
    /// if a value is missing.
    pub fn from_values(value: impl Fn(&str) -> Option<f64>) -> Option<Self> {
        let mut limits = Self::default();
        for (name, _, field, ..) in LINES {
            *field(&mut limits) = match name {
                // Old recordings do not contain the encoder steps.
                "position_step" | "angle_step" => value(name).unwrap_or(0.0),
                _ => value(name)?,
            };
        }
        Some(limits)
    }

    /// Returns the tighter of two values for each threshold. The tighter value is the smaller
    /// value; for `ramp` and `hold` it is the longer time. A larger damping does not count as
    /// tighter, since it can make the device oscillate. The delay and the encoder steps are not
    /// thresholds and stay unchanged.
    #[must_use]
    pub fn within(&self, others: &Self) -> Self {
        let (mut limits, mut others) = (*self, *others);
        for (_, tighter, field, ..) in LINES {
            let (own, other) = (field(&mut limits), *field(&mut others));
            *own = match tighter {
                Smaller => own.min(other),
                Larger => own.max(other),
                Kept => *own,
            };
        }
        limits
    }

    /// Returns true if every threshold is a number of at least 0. An infinite threshold switches a
    /// stage off, which is meant for tests.
    pub fn is_valid(&self) -> bool {
        self.explained().iter().all(|line| line.value >= 0.0)
    }
}

/// The tighter of two values of a threshold.
#[derive(Clone, Copy)]
enum TighterValue {
    Smaller,
    Larger,
    /// The value is no threshold.
    Kept,
}

/// A threshold: its name, its tighter value, its place in [`SafetyLimits`], its unit and its
/// reason.
type Line = (&'static str, TighterValue, fn(&mut SafetyLimits) -> &mut f64, &'static str, &'static str);

/// All thresholds.
const LINES: [Line; 27] = [
    (
        "force_peak",
        Smaller,
        |limits| &mut limits.force_peak,
        "N",
        "as the device states; at most its known peak, or 40 N",
    ),
    (
        "torque_peak",
        Smaller,
        |limits| &mut limits.torque_peak,
        "N·m",
        "at most its known peak, or 5 N·m; 0 without driven rotation",
    ),
    ("force_continuous", Smaller, |limits| &mut limits.force_continuous, "N", "as stated, else 0.2 of the peak"),
    ("torque_continuous", Smaller, |limits| &mut limits.torque_continuous, "N·m", "as stated, else 0.2 of the peak"),
    (
        "heating_time",
        Smaller,
        |limits| &mut limits.heating_time,
        "s",
        "of small motors; RMS force over this time is at most continuous",
    ),
    ("force_slew", Smaller, |limits| &mut limits.force_slew, "N/s", "peak in 2 ms: transients up to 175 Hz pass"),
    ("torque_slew", Smaller, |limits| &mut limits.torque_slew, "N·m/s", "peak in 2 ms"),
    ("speed", Smaller, |limits| &mut limits.speed, "m/s", "fastest reach, 3 m/s; at most the workspace in 0.1 s"),
    ("turn", Smaller, |limits| &mut limits.turn, "rad/s", "fastest rotation of a wrist, 2000 °/s"),
    ("jump", Smaller, |limits| &mut limits.jump, "m", "extra motion between two reads: encoder steps and noise"),
    (
        "jump_angle",
        Smaller,
        |limits| &mut limits.jump_angle,
        "rad",
        "extra rotation; plus 20 ms of rotation for slow sensors",
    ),
    ("stale", Smaller, |limits| &mut limits.stale, "s", "age of a state: 5 mm at 0.5 m/s; at least 5 periods"),
    (
        "frozen_travel",
        Smaller,
        |limits| &mut limits.frozen_travel,
        "m",
        "travel by the stated velocity while the pose is unchanged",
    ),
    (
        "frozen_turn",
        Smaller,
        |limits| &mut limits.frozen_turn,
        "rad",
        "rotation by the stated velocity while the pose is unchanged",
    ),
    ("stall", Smaller, |limits| &mut limits.stall, "s", "√(2·0.2 kg·10 mm/peak): a held force moves a hand 10 mm"),
    (
        "engage_force",
        Smaller,
        |limits| &mut limits.engage_force,
        "N",
        "0.1 of the peak: the largest force at which it engages",
    ),
    (
        "engage_torque",
        Smaller,
        |limits| &mut limits.engage_torque,
        "N·m",
        "0.1 of the peak: the largest torque at which it engages",
    ),
    ("ramp", Larger, |limits| &mut limits.ramp, "s", "ramp after engaging, longer than a hand's reaction"),
    ("hold", Larger, |limits| &mut limits.hold, "s", "time without a fault before it engages again"),
    ("damping", Smaller, |limits| &mut limits.damping, "N·s/m", "0.25 s/m of the peak, during a fault"),
    (
        "angular_damping",
        Smaller,
        |limits| &mut limits.angular_damping,
        "N·m·s/rad",
        "0.005 s/rad of the peak, during a fault",
    ),
    ("rest_force", Smaller, |limits| &mut limits.rest_force, "N", "0.1 of the peak: the largest damping force"),
    ("rest_torque", Smaller, |limits| &mut limits.rest_torque, "N·m", "0.1 of the peak: the largest damping torque"),
    ("delay", Kept, |limits| &mut limits.delay, "s", "from write to action, as the device states; at most 8 periods"),
    (
        "position_step",
        Kept,
        |limits| &mut limits.position_step,
        "m",
        "encoder step, as the device states; at most 0.5 mm",
    ),
    (
        "angle_step",
        Kept,
        |limits| &mut limits.angle_step,
        "rad",
        "encoder step, as the device states; at most 0.005 rad",
    ),
    ("allowance", Smaller, |limits| &mut limits.allowance, "J", "peak over 0.5 mm: energy given before passivity acts"),
];

/// Returns `stated`, at most `most`; 0 if `stated` is NaN, negative or negligible.
fn bounded(stated: f64, most: f64) -> f64 {
    if stated >= LEAST_STATED { stated.min(most) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    #[test]
    fn implausible_device_values_are_bounded() {
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
        // Found by fuzzing: the square of such a rating underflows, so the heat could not be
        // compared with it.
        assert_eq!(of("no one knows it", 1e-160, 1e-317), (0.0, 0.0));
        // The rotation of this device is not actuated, so its torque counts as 0.
        let limits = SafetyLimits::of(&DeviceSpec { torque_max: 1.0, ..inverse3 }, 1000.0);
        assert_eq!((limits.torque_peak, limits.rest_torque), (0.0, 0.0));
    }

    #[test]
    fn given_limits_are_bounded_by_the_device_limits() {
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
    fn limits_of_every_known_device_are_consistent() {
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
