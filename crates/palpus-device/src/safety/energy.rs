//! Passivity observer and controller. If the hand has received more energy than it has put in, the
//! controller damps the grip until the excess is taken back \[Hannaford and Ryu 2002, "HR02"\].
//!
//! Translation and rotation share one account: a tool that is pushed into a corner turns in the
//! hand, so work done by pushing comes back by turning. In every tick:
//!
//! 1. *Observe* the work of the wrenches that acted, over the sensed motion (`sensed_work.rs`). The
//!    work is positive if the hand has received energy. The wrench that acts now was written
//!    earlier; the device states the delay ([`SafetyLimits::delay`]).
//! 2. *Update the account* with the observed work. The account's credit is at most the energy that
//!    a spring can return at peak force. Otherwise a long slide, which puts energy in all the time,
//!    would hide a later oscillation.
//! 3. *Control*: take back the energy beyond the allowance, as far as the motion allows in the
//!    coming tick. A force and a torque act against the velocities, each in proportion to what it
//!    can take back. Force and torque are each at most the component of the wrench along the
//!    motion, plus the force of a damper that the device can render stably. Near rest, where the
//!    direction of a velocity is noise, both fade out.
//! 4. *Onset* (contact during the ramp): a contact that is pressed while the gain of the start-up
//!    ramp rises would return more energy than it took. So there is no allowance from the start of
//!    the ramp until the wrench is next near zero. The controller acts before the credit is used
//!    up: in each [`LEAD`] seconds, the hand gets back at most the credit that is left. The credit
//!    is reduced by the energy that may be wrong because the motion within a step is unknown.
//!    A load at rest is not reduced: only motion beyond the noise of a grip at rest counts, and the
//!    chain passes only the part of the velocity that agrees with the poses.
//!
//! Damping that the controller adds acts in a later tick, and its work is observed in that tick. So
//! no energy is counted twice.
//!
//! If a loop has several tools, another tool may push this tool, and the energy comes from another
//! hand. So a tool may pass on the energy that it got from contact with other tools, as long as
//! such contact gives no more energy than it takes ([`ContactAccount`]).
//!
//! Differences from HR02: the account uses the wrench that acted, with its delay, instead of the
//! commanded wrench. Step 3 bounds the energy and the force that it takes back. A small excess is
//! allowed, since sensed positions have steps.

use glam::DVec3;
use palpus::algebra::{Twist, Wrench};

use super::SafetyLimits;
use crate::device::DeviceState;
use crate::sensed_work::SensedWork;

/// Speed below which the direction of a velocity is noise, m/s: a tenth of an encoder step of 0.03
/// mm per millisecond.
const SLOW: f64 = 3e-3;
/// Rotation speed below which the direction is noise, rad/s: a tenth of a step of 2.5e-4 rad per
/// millisecond.
const SLOW_TURN: f64 = 0.025;
/// Largest damping of the controller, relative to the damping after a fault. This limit is less
/// than half of the damping at which the device would begin to oscillate.
const MOST_DAMPING: f64 = 3.0;
/// Time constant with which the credit is given back in an onset, s. It is longer than the time
/// after which a motion is counted.
const LEAD: f64 = 8e-3;
/// A wrench below this share of the peak ends an onset. A spring of 1 kN/m then stores less than
/// 0.1 µJ, at a peak of 10 N.
const RELEASED: f64 = 1e-3;
/// Travel for the credit, m: a spring with the peak force over this travel can return half of force
/// times travel.
const CREDIT_TRAVEL: f64 = 16e-3;
/// Rotation for the credit of torques, rad: a spring with the peak torque over this rotation can
/// return half of torque times rotation.
const CREDIT_TURN: f64 = 0.4;

/// Passivity observer and controller of one device.
#[derive(Clone, Debug)]
pub struct EnergyAccount {
    period: f64,
    work: SensedWork,
    /// Energy given to the hand and not yet taken back, J; negative if the hand has put in more.
    given: f64,
    /// Energy that may be given before the controller acts, J.
    allowance: f64,
    /// Largest amount by which `given` can be below zero, J; at least 0.
    credit: f64,
    /// Share of the computed wrench that the hand gets.
    gain: f64,
    /// In an onset: the largest part of `given` that may be wrong, J.
    onset: Option<f64>,
    translation: Port,
    rotation: Port,
}

/// Energy account of the contacts between the tools of a loop: they can give no more energy than
/// they have taken.
#[derive(Clone, Copy, Debug)]
pub struct ContactAccount {
    /// Energy given to all tools together and not yet taken back, J; negative if the contacts took
    /// more than they gave.
    given: f64,
    /// Energy that the contacts may give before they have taken any, J.
    allowance: f64,
    /// Largest amount by which `given` can be below zero, J; at least 0.
    credit: f64,
}

impl ContactAccount {
    /// Returns an empty account between devices with these `limits`.
    pub fn new<'a>(limits: impl Iterator<Item = &'a SafetyLimits>) -> Self {
        let least = |(force, allowance): (f64, f64), limits: &SafetyLimits| {
            (force.min(limits.force_peak), allowance.min(limits.allowance))
        };
        let (force, allowance) = limits.fold((f64::INFINITY, f64::INFINITY), least);
        Self { given: 0.0, allowance, credit: 0.5 * force * CREDIT_TRAVEL }
    }

    /// Takes the work that contact did on each tool in this tick, J, by translation and by
    /// rotation. Replaces each work by the part that the tool may pass on to its hand.
    pub fn pass(&mut self, works: &mut [[f64; 2]]) {
        let sum: f64 = works.as_flattened().iter().sum();
        if !sum.is_finite() {
            return works.fill([0.0; 2]);
        }
        self.given = (self.given + sum).max(-self.credit);
        if self.given > self.allowance {
            works.as_flattened_mut().iter_mut().for_each(|work| *work = work.min(0.0));
        }
    }
}

/// Energy that can be taken back from one kind of motion.
#[derive(Clone, Copy, Debug)]
struct Port {
    /// Damping coefficient, N·s/m or N·m·s/rad.
    damping: f64,
    /// Speed below which the direction is noise, m/s or rad/s.
    slow: f64,
    /// Smallest sensed motion, m or rad.
    step: f64,
    /// Load below which a contact is released, N or N·m.
    released: f64,
}

impl EnergyAccount {
    /// Returns an empty account for a device with these `limits`, in a loop with the nominal
    /// `period` (s).
    pub fn new(limits: &SafetyLimits, period: f64) -> Self {
        Self {
            period,
            work: SensedWork::new(limits.delay, period, [limits.position_step, limits.angle_step]),
            given: 0.0,
            allowance: limits.allowance,
            credit: 0.5 * (limits.force_peak * CREDIT_TRAVEL + limits.torque_peak * CREDIT_TURN),
            gain: 1.0,
            onset: None,
            translation: Port {
                damping: MOST_DAMPING * limits.damping,
                slow: SLOW,
                step: limits.position_step,
                released: RELEASED * limits.force_peak,
            },
            rotation: Port {
                damping: MOST_DAMPING * limits.angular_damping,
                slow: SLOW_TURN,
                step: limits.angle_step,
                released: RELEASED * limits.torque_peak,
            },
        }
    }

    /// Returns the energy that the hand has received beyond what it has put in, J; at least minus
    /// the credit.
    pub fn given(&self) -> f64 {
        self.given
    }

    /// Returns `computed`, or the wrench that may be commanded instead, for a grip in `state`.
    ///
    /// `elapsed` is the time since the last call, s. The last commanded wrench was held for this
    /// time, and the next wrench will be held as long. If no energy must be removed, the result
    /// equals `computed` bit for bit; any other result counts as [`super::Cut::Passivity`].
    pub fn limit(&mut self, computed: &Wrench, state: &DeviceState, elapsed: f64) -> Wrench {
        let [translation, rotation] = self.work.moved_to(&state.pose, elapsed);
        self.give(translation + rotation);
        let Twist { mut angular, mut linear } = state.twist;
        if self.onset.is_some() {
            [angular, linear] = [self.rotation.certain(angular), self.translation.certain(linear)];
        }
        let force = self.translation.most(computed.force, linear);
        let torque = self.rotation.most(computed.torque, angular);
        let released = self.translation.is_released(computed.force) && self.rotation.is_released(computed.torque);
        if released && self.gain >= 1.0 {
            self.onset = None;
        }
        let payable = force.dot(linear) + torque.dot(angular);
        let power = computed.power(&Twist { angular, linear });
        let share = self.share_taken(payable, power, released, elapsed.max(self.period));
        if share == 0.0 {
            return *computed;
        }
        Wrench { torque: computed.torque - share * torque, force: computed.force - share * force }
    }

    /// Takes the gain of the start-up ramp, by which the result of [`Self::limit`] is multiplied:
    /// below 1 while the device ramps. Returns true if the next result removes energy that the ramp
    /// adds; this counts as [`super::Cut::StartUp`]. Called before [`Self::limit`], whose state
    /// then has only the part of the velocity that agrees with the poses.
    pub fn ramp(&mut self, gain: f64) -> bool {
        self.gain = gain;
        if gain < 1.0 {
            self.onset.get_or_insert_default();
        }
        self.onset.is_some()
    }

    /// Adds the work that moving bodies and the tools of other devices did on this tool in this
    /// tick, J, by translation and by rotation. The work is negative if the tool did work on the
    /// others. The hand may receive this energy. The chain calls this function before
    /// [`Self::limit`].
    pub fn received(&mut self, work: [f64; 2]) {
        self.give(-work.iter().sum::<f64>());
    }

    /// Takes the wrench that was commanded in this tick, after all later stages, for the energy
    /// account.
    pub fn commanded(&mut self, wrench: &Wrench) {
        self.work.write(wrench);
        if let Some(uncertain) = &mut self.onset {
            *uncertain =
                uncertain.max(self.translation.uncertain(wrench.force) + self.rotation.uncertain(wrench.torque));
        }
    }

    /// Starts the account again while the device is not engaged.
    pub fn reset(&mut self) {
        self.work.clear();
        self.given = 0.0;
        self.onset = None;
    }

    /// Step 2: adds `work`, J, to the account.
    fn give(&mut self, work: f64) {
        if work.is_finite() {
            self.given = (self.given + work).max(-self.credit);
        }
    }

    /// Steps 3 and 4: returns the share to take back of `payable`, the largest power (W) that can
    /// be taken from both kinds of motion. `power` is the power of the computed wrench, W.
    /// `released` is true if the computed wrench is near zero. `dt` is the duration of the coming
    /// tick, s.
    fn share_taken(&self, payable: f64, power: f64, released: bool, dt: f64) -> f64 {
        let (excess, payable, dt) = match self.onset {
            None => (self.given - self.allowance, payable, dt),
            // The hand presses or rests, or there is no contact.
            Some(_) if power <= 0.0 || released => return 0.0,
            Some(uncertain) => (self.given + uncertain + self.gain * power * LEAD, self.gain * payable, LEAD),
        };
        // This form also covers NaN.
        if !(excess > 0.0 && payable > 0.0 && payable.is_finite() && dt > 0.0) {
            return 0.0;
        }
        (excess / (payable * dt)).min(1.0)
    }
}

impl Port {
    /// Returns true if a contact with this load is over.
    fn is_released(&self, load: DVec3) -> bool {
        load.length() <= self.released
    }

    /// Returns the part of the motion `rate` that cannot be the noise of a grip at rest.
    fn certain(&self, rate: DVec3) -> DVec3 {
        let speed = rate.length();
        if speed > self.slow { rate * (1.0 - self.slow / speed) } else { DVec3::ZERO }
    }

    /// Returns the energy by which the account may be wrong after a contact with this largest load,
    /// J: a step times the change of the load, which rises and falls again.
    fn uncertain(&self, load: DVec3) -> f64 {
        2.0 * self.step * load.length()
    }

    /// Returns the largest force (or torque) that may be taken off `load`: its component along the
    /// motion `rate`, plus damping.
    fn most(&self, load: DVec3, rate: DVec3) -> DVec3 {
        let speed = rate.length();
        if !(speed > 0.0 && speed.is_finite()) {
            return DVec3::ZERO;
        }
        let along = rate / speed;
        along * ((load.dot(along).max(0.0) + self.damping * speed) * (speed / self.slow).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use palpus::algebra::Pose;

    use super::*;
    use crate::simulated::{Encoder, HandImpedance, SimulatedDevice, SimulationSettings};
    use crate::{HapticDevice, SafetyLimits};

    const PERIOD: f64 = 1e-3;

    /// Simulates a wall of `stiffness` N/m below x = 0 for two seconds, with a device that a
    /// relaxed operator holds against it. Returns the largest true energy given to the hand, J,
    /// and whether any wrench was changed.
    fn wall(stiffness: f64, mut stage: Option<EnergyAccount>) -> (f64, bool) {
        let settings = SimulationSettings { hand: HandImpedance::RELAXED, ..SimulationSettings::default() };
        let mut device = SimulatedDevice::new(settings, |time: f64| {
            Pose::from_translation(DVec3::X * (3e-3 - (0.02 * time).min(8e-3)))
        })
        .expect("default settings are valid");
        let (mut given, mut most, mut changed) = (0.0, 0.0_f64, false);
        let mut last: Option<(Pose, Wrench)> = None;
        for _ in 0..2000 {
            let state = device.read().expect("a simulated device can be read");
            if let Some((pose, acted)) = last {
                given += acted.force.dot(device.true_pose().translation - pose.translation);
                most = most.max(given);
            }
            let x = state.pose.translation.x;
            let computed = Wrench { torque: DVec3::ZERO, force: DVec3::X * (-stiffness * x).clamp(0.0, 8.5) };
            let wrench = stage.as_mut().map_or(computed, |stage| stage.limit(&computed, &state, PERIOD));
            changed |= wrench != computed;
            device.write(&wrench).expect("a finite wrench is accepted");
            if let Some(stage) = &mut stage {
                stage.commanded(&wrench);
            }
            last = Some((device.true_pose(), device.applied()));
        }
        (most, changed)
    }

    fn account() -> EnergyAccount {
        EnergyAccount::new(&SafetyLimits::of(&device_spec(), 1.0 / PERIOD), PERIOD)
    }

    fn device_spec() -> crate::DeviceSpec {
        let spec = SimulationSettings::default().spec;
        crate::DeviceSpec { delay: PERIOD, ..spec }
    }

    #[test]
    fn stable_wall_is_passed_unchanged() {
        let (given, changed) = wall(300.0, Some(account()));
        assert!(!changed && given < 1e-3, "{given}");
    }

    /// Moves the grip by 10 mm and turns it by 0.2 rad in half a second, against a force and along
    /// a torque. Returns the number of changed wrenches.
    fn turned_by_a_corner(force: f64) -> usize {
        let mut stage = account();
        let twist = Twist { angular: DVec3::Z * 0.4, linear: DVec3::X * 0.02 };
        let computed = Wrench { torque: DVec3::Z * 0.15, force: DVec3::X * -force };
        let states = (0..500u32).map(|k| {
            let time = f64::from(k) * PERIOD;
            let rotation = glam::DQuat::from_rotation_z(twist.angular.z * time);
            DeviceState { pose: Pose::new(rotation, twist.linear * time), twist, buttons: 0, time, withheld: false }
        });
        states
            .filter(|state| {
                let wrench = stage.limit(&computed, state, PERIOD);
                stage.commanded(&wrench);
                wrench != computed
            })
            .count()
    }

    #[test]
    fn energy_of_pushing_may_return_by_turning() {
        // The hand puts in 40 mJ by pushing and gets back 30 mJ by turning. Without the push, the
        // device would have generated these 30 mJ.
        assert_eq!(turned_by_a_corner(4.0), 0);
        assert!(turned_by_a_corner(0.0) > 400);
    }

    #[test]
    fn oscillating_wall_is_damped() {
        let allowance = SafetyLimits::of(&device_spec(), 1.0 / PERIOD).allowance;
        let (without, _) = wall(32_000.0, None);
        let (with, changed) = wall(32_000.0, Some(account()));
        assert!(without > 6.0 * allowance, "{without}");
        assert!(changed && with < 1.5 * allowance, "{with} of {without}");
    }

    #[test]
    fn account_equals_the_true_work() {
        // With exact sensors and a steady load, the observed work must be the true work.
        let settings = SimulationSettings { encoder: Encoder::EXACT, ..SimulationSettings::default() };
        let mut device = SimulatedDevice::new(settings, |time: f64| Pose::from_translation(DVec3::X * (0.05 * time)))
            .expect("default settings are valid");
        let mut stage = EnergyAccount::new(&SafetyLimits::of(device.spec(), 1.0 / PERIOD), PERIOD);
        let mut work = 0.0;
        let mut last: Option<(Pose, Wrench)> = None;
        for k in 0..500 {
            let state = device.read().expect("a simulated device can be read");
            if let Some((pose, acted)) = last {
                work += acted.force.dot(device.true_pose().translation - pose.translation);
            }
            let computed = Wrench { torque: DVec3::ZERO, force: DVec3::X * (0.03 * (0.02 * f64::from(k)).sin()) };
            let wrench = stage.limit(&computed, &state, PERIOD);
            assert_eq!(wrench, computed);
            device.write(&wrench).expect("a finite wrench is accepted");
            stage.commanded(&wrench);
            last = Some((device.true_pose(), device.applied()));
            assert!((stage.given() - work).abs() < 1e-12, "tick {k}: {} and {work}", stage.given());
        }
    }

    #[test]
    fn no_damping_near_rest_or_at_nan_velocity() {
        let mut stage = account();
        let state = |x: f64, speed: f64| crate::DeviceState {
            pose: Pose::from_translation(DVec3::X * x),
            twist: palpus::algebra::Twist { angular: DVec3::ZERO, linear: DVec3::X * speed },
            buttons: 0,
            time: 0.0,
            withheld: false,
        };
        let push = Wrench { torque: DVec3::ZERO, force: DVec3::X };
        // A force of 1 N over 1 m gives 1 J.
        for x in [0.0, 0.0, 0.0, 1.0] {
            stage.limit(&push, &state(x, 0.0), PERIOD);
            stage.commanded(&push);
        }
        assert!(stage.given() > 0.9);
        assert_eq!(stage.limit(&push, &state(1.0, 0.0), PERIOD), push);
        let slow = stage.limit(&push, &state(1.0, 1e-6), PERIOD);
        assert!((slow.force - push.force).length() < 1e-3);
        assert_eq!(stage.limit(&push, &state(1.0, f64::NAN), PERIOD), push);
        let fast = stage.limit(&push, &state(1.0, 0.1), PERIOD);
        assert!(fast.force.x < 0.0 && fast.force.x > -1.0, "{fast:?}");
    }
}
