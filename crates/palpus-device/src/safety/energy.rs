//! Passivity by account: a grip that was given more energy than it gave is damped until it has been
//! paid back \[Hannaford and Ryu 2002, "HR02"\].
//!
//! Translation and rotation have one account: a tool that is pushed into a corner turns in the
//! hand, and what the hand gave by pushing comes back by turning. In every tick:
//!
//! 1. *Observe*: the work of the wrenches that acted, over the sensed motion (`sensed_work.rs`).
//!    Positive when the hand was given energy. What acts now was written a while ago: the device
//!    says how long ([`SafetyLimits::delay`]).
//! 2. *Keep the account*. A credit is bounded by what an elastic thing at peak could give back: a
//!    long slide, which pays all the time, must not hide a later hum.
//! 3. *Control*: beyond the allowance, take back as much as the motion allows in the coming tick,
//!    by a force and a torque against the velocities, each by its share of what both could take.
//!    That is at most the part of the wrench that pushes along, plus a damper that the device
//!    bears; and near rest, where the direction of a velocity is noise, it fades out.
//!
//! Energy that is taken back acts later and is observed then like everything else, so nothing is
//! counted twice.
//!
//! If a hand holds one of several tools, another tool may push it, and the energy comes from
//! another hand. So a tool's port may pass on the energy that contact between tools gave it, as
//! long as such contact gives no more than it takes ([`ContactAccount`]).
//!
//! Deviations from HR02: the applied wrench and its delay in place of the commanded one; both
//! bounds in step 3; the allowance, since sensed positions come in steps.

use glam::DVec3;
use palpus::algebra::{Twist, Wrench};

use super::{Passivity, SafetyLimits};
use crate::device::DeviceState;
use crate::sensed_work::SensedWork;

/// m/s: below this, directions of velocities fade into noise: a tenth of an encoder's step of 0.03
/// mm a millisecond.
const SLOW: f64 = 3e-3;
/// rad/s, likewise of 2.5e-4 rad.
const SLOW_TURN: f64 = 0.025;
/// Times the damping at rest: the most that is added to what the wrench itself pushes. Less than
/// half of what hums.
const MOST_DAMPING: f64 = 3.0;
/// m: peak force over this travel, halved, is what a spring at peak can give back.
pub(super) const CREDIT_TRAVEL: f64 = 16e-3;
/// rad, likewise.
pub(super) const CREDIT_TURN: f64 = 0.4;

/// Observer and controller.
#[derive(Clone, Debug)]
pub struct EnergyAccount {
    period: f64,
    work: SensedWork,
    /// J given and not yet taken back; negative: taken.
    given: f64,
    /// J.
    allowance: f64,
    /// J, not negative: how far below zero `given` can be.
    credit: f64,
    translation: Port,
    rotation: Port,
}

/// The account of the contacts between the tools of a loop: they may hand over what they took, and
/// no more.
#[derive(Clone, Copy, Debug)]
pub struct ContactAccount {
    /// J given to all tools together and not yet taken back; negative: taken.
    given: f64,
    /// J.
    allowance: f64,
    /// J, not negative.
    credit: f64,
}

impl ContactAccount {
    /// Nothing given, nothing taken; between devices of these limits.
    pub fn new<'a>(limits: impl Iterator<Item = &'a SafetyLimits>) -> Self {
        let least = |(force, allowance): (f64, f64), limits: &SafetyLimits| {
            (force.min(limits.force_peak), allowance.min(limits.allowance))
        };
        let (force, allowance) = limits.fold((f64::INFINITY, f64::INFINITY), least);
        Self { given: 0.0, allowance, credit: 0.5 * force * CREDIT_TRAVEL }
    }

    /// Replaces the work that contact gave each tool in this tick, J, by moving and by turning it,
    /// by the part of it that the tool may pass on to its hand.
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
    /// N·s/m or N·m·s/rad.
    damping: f64,
    /// m/s or rad/s.
    slow: f64,
}

impl EnergyAccount {
    /// Nothing given, nothing taken; in a loop whose ticks are `period` seconds apart when it keeps
    /// its time.
    pub fn new(limits: &SafetyLimits, period: f64) -> Self {
        Self {
            period,
            work: SensedWork::new(limits.delay, period, [limits.position_step, limits.angle_step]),
            given: 0.0,
            allowance: limits.allowance,
            credit: 0.5 * (limits.force_peak * CREDIT_TRAVEL + limits.torque_peak * CREDIT_TURN),
            translation: Port { damping: MOST_DAMPING * limits.damping, slow: SLOW },
            rotation: Port { damping: MOST_DAMPING * limits.angular_damping, slow: SLOW_TURN },
        }
    }

    /// J that the hand was given beyond what it gave, no less than minus the credit.
    pub fn given(&self) -> f64 {
        self.given
    }

    /// Step 2.
    fn give(&mut self, work: f64) {
        if work.is_finite() {
            self.given = (self.given + work).max(-self.credit);
        }
    }

    /// Step 3: the share of what both kinds of motion could pay in `dt` seconds that is asked for.
    fn asked(&self, payable: f64, dt: f64) -> f64 {
        let excess = self.given - self.allowance;
        // Covers what is no number, too.
        if !(excess > 0.0 && payable > 0.0 && payable.is_finite() && dt > 0.0) {
            return 0.0;
        }
        (excess / (payable * dt)).min(1.0)
    }
}

impl Port {
    /// The most that is taken off `load` at this `rate` of motion, along it.
    fn most(&self, load: DVec3, rate: DVec3) -> DVec3 {
        let speed = rate.length();
        if !(speed > 0.0 && speed.is_finite()) {
            return DVec3::ZERO;
        }
        let along = rate / speed;
        along * ((load.dot(along).max(0.0) + self.damping * speed) * (speed / self.slow).min(1.0))
    }
}

impl Passivity for EnergyAccount {
    fn limit(&mut self, computed: &Wrench, state: &DeviceState, elapsed: f64) -> Wrench {
        let [translation, rotation] = self.work.moved_to(&state.pose, elapsed);
        self.give(translation + rotation);
        let Twist { angular, linear } = state.twist;
        let force = self.translation.most(computed.force, linear);
        let torque = self.rotation.most(computed.torque, angular);
        let share = self.asked(force.dot(linear) + torque.dot(angular), elapsed.max(self.period));
        if share == 0.0 {
            return *computed;
        }
        Wrench { torque: computed.torque - share * torque, force: computed.force - share * force }
    }

    fn received(&mut self, work: [f64; 2]) {
        self.give(-work.iter().sum::<f64>());
    }

    fn commanded(&mut self, wrench: &Wrench) {
        self.work.write(wrench);
    }

    fn reset(&mut self) {
        self.work.forget();
        self.given = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use palpus::algebra::Pose;

    use super::*;
    use crate::simulated::{Encoder, HandImpedance, SimulatedDevice, SimulationSettings};
    use crate::{HapticDevice, SafetyLimits};

    const PERIOD: f64 = 1e-3;

    /// A wall of `stiffness` below x = 0 felt for two seconds by a device that a relaxed hand holds
    /// against it; answers the energy that the hand was truly given at most, J, and whether any
    /// wrench was changed.
    fn wall(stiffness: f64, mut stage: Option<EnergyAccount>) -> (f64, bool) {
        let settings = SimulationSettings { hand: HandImpedance::RELAXED, ..SimulationSettings::default() };
        let mut device = SimulatedDevice::new(settings, |time: f64| {
            Pose::from_translation(DVec3::X * (3e-3 - (0.02 * time).min(8e-3)))
        })
        .expect("usual settings");
        let (mut given, mut most, mut changed) = (0.0, 0.0_f64, false);
        let mut last: Option<(Pose, Wrench)> = None;
        for _ in 0..2000 {
            let state = device.read().expect("it is simulated");
            if let Some((pose, acted)) = last {
                given += acted.force.dot(device.true_pose().translation - pose.translation);
                most = most.max(given);
            }
            let x = state.pose.translation.x;
            let computed = Wrench { torque: DVec3::ZERO, force: DVec3::X * (-stiffness * x).clamp(0.0, 8.5) };
            let wrench = stage.as_mut().map_or(computed, |stage| stage.limit(&computed, &state, PERIOD));
            changed |= wrench != computed;
            device.write(&wrench).expect("it is finite");
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
    fn a_wall_that_is_quiet_is_left_alone_to_the_bit() {
        let (given, changed) = wall(300.0, Some(account()));
        assert!(!changed && given < 1e-3, "{given}");
    }

    /// Half a second in which the grip is moved by 10 mm and turned by 0.2 rad, against a force and
    /// along a torque; how often the wrench was changed.
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
    fn what_is_given_by_pushing_may_come_back_by_turning() {
        // 40 mJ are pushed in, and 30 mJ come back as a turn; without the push they come from
        // nowhere.
        assert_eq!(turned_by_a_corner(4.0), 0);
        assert!(turned_by_a_corner(0.0) > 400);
    }

    #[test]
    fn a_wall_that_hums_is_made_to_pay() {
        let allowance = SafetyLimits::of(&device_spec(), 1.0 / PERIOD).allowance;
        let (without, _) = wall(32_000.0, None);
        let (with, changed) = wall(32_000.0, Some(account()));
        assert!(without > 6.0 * allowance, "{without}");
        assert!(changed && with < 1.5 * allowance, "{with} of {without}");
    }

    #[test]
    fn the_books_are_those_of_the_device() {
        // With exact sensors and steady load, the observed work is the true work.
        let settings = SimulationSettings { encoder: Encoder::EXACT, ..SimulationSettings::default() };
        let mut device = SimulatedDevice::new(settings, |time: f64| Pose::from_translation(DVec3::X * (0.05 * time)))
            .expect("usual");
        let mut stage = EnergyAccount::new(&SafetyLimits::of(device.spec(), 1.0 / PERIOD), PERIOD);
        let mut work = 0.0;
        let mut last: Option<(Pose, Wrench)> = None;
        for k in 0..500 {
            let state = device.read().expect("it is simulated");
            if let Some((pose, acted)) = last {
                work += acted.force.dot(device.true_pose().translation - pose.translation);
            }
            let computed = Wrench { torque: DVec3::ZERO, force: DVec3::X * (0.03 * (0.02 * f64::from(k)).sin()) };
            let wrench = stage.limit(&computed, &state, PERIOD);
            assert_eq!(wrench, computed);
            device.write(&wrench).expect("it is finite");
            stage.commanded(&wrench);
            last = Some((device.true_pose(), device.applied()));
            assert!((stage.given() - work).abs() < 1e-12, "tick {k}: {} and {work}", stage.given());
        }
    }

    #[test]
    fn near_rest_and_on_nonsense_nothing_is_added() {
        let mut stage = account();
        let state = |x: f64, speed: f64| crate::DeviceState {
            pose: Pose::from_translation(DVec3::X * x),
            twist: palpus::algebra::Twist { angular: DVec3::ZERO, linear: DVec3::X * speed },
            buttons: 0,
            time: 0.0,
            withheld: false,
        };
        let push = Wrench { torque: DVec3::ZERO, force: DVec3::X };
        // Pushed a metre along by one newton: a joule given.
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
