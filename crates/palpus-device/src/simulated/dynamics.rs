//! Device and hand as one rigid body on a spring–damper, integrated in small steps.
//!
//! The scheme is leapfrog: half a step of position, a step of velocity with the forces at the
//! middle, half a step of position. The dampers use the trapezoidal rule. The scheme has second
//! order and is exact under a steady force.
//!
//! The order matters here: a first-order scheme shifts the phase of a held wrench by half a step.
//! The shift changes the stiffness at which a sampled wall begins to oscillate. The scheme is
//! stable for all dampers, and for all springs whose period is longer than π steps;
//! [`Dynamics::new`] chooses much shorter steps than the limit. Dry friction reduces the speed
//! after each velocity step, at most to zero, so that the body stays at rest instead of chattering.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use super::SimulationError;
use super::hand::HandImpedance;
use palpus::algebra::rotation_between;

/// Longest step, s: between ticks, device and hand are integrated at 10 kHz or more.
const LONGEST_STEP: f64 = 1e-4;
/// Upper bound of a spring's angular frequency, and of a damper's decay rate, times the step. A
/// spring then has at least 60 steps per period, 20 times the minimum for stability.
const RESOLUTION: f64 = 0.1;
/// Largest number of steps in a tick. More steps would take longer than the tick.
const MOST_STEPS: f64 = 1e4;

/// Mechanics of the device, as felt at the grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Apparatus {
    /// Mass, kg.
    pub mass: f64,
    /// Viscous damping, N·s/m.
    pub damping: f64,
    /// Dry friction, N.
    pub friction: f64,
    /// Inertia, kg·m², the same about every axis.
    pub inertia: f64,
    /// Viscous angular damping, N·m·s/rad.
    pub angular_damping: f64,
    /// Dry friction torque, N·m.
    pub angular_friction: f64,
}

impl Apparatus {
    /// A light 6-DOF arm: 0.1 kg at the grip, 0.1 N·s/m, and 0.04 N of dry friction.
    pub const LIGHT_ARM: Self =
        Self { mass: 0.10, damping: 0.1, friction: 0.04, inertia: 5e-5, angular_damping: 5e-4, angular_friction: 1e-3 };
}

/// Device and hand as one body.
#[derive(Clone, Debug)]
pub(super) struct Dynamics {
    linear: Channel,
    angular: Channel,
    /// Longest step, s.
    longest: f64,
}

/// Translation or rotation, which have the same equation of motion.
#[derive(Clone, Copy, Debug)]
struct Channel {
    inertia: f64,
    hand_damping: f64,
    damping: f64,
    stiffness: f64,
    friction: f64,
}

impl Channel {
    /// Returns the velocity after a step of `h` seconds under a steady `load`. The hand's goal is
    /// at distance `stretch` and moves with `goal_rate`.
    fn kick(&self, rate: DVec3, load: DVec3, stretch: DVec3, goal_rate: DVec3, h: f64) -> DVec3 {
        let drive = load + stretch * self.stiffness + goal_rate * self.hand_damping;
        let half_damping = 0.5 * h * (self.hand_damping + self.damping);
        let inertia = self.inertia + half_damping;
        let free = (rate * (self.inertia - half_damping) + drive * h) / inertia;
        let speed = free.length();
        let lost = self.friction * h / inertia;
        if speed > lost { free * (1.0 - lost / speed) } else { DVec3::ZERO }
    }

    /// Returns the larger of the spring's angular frequency and the dampers' decay rate, 1/s.
    fn rate(&self) -> f64 {
        (self.stiffness / self.inertia).sqrt().max((self.hand_damping + self.damping) / self.inertia)
    }

    fn is_valid(&self) -> bool {
        let all = [self.hand_damping, self.damping, self.stiffness, self.friction];
        self.inertia > 0.0 && self.inertia.is_finite() && all.iter().all(|v| *v >= 0.0 && v.is_finite())
    }
}

impl Dynamics {
    /// Makes the body of device and hand, which will be advanced by about `period` seconds at a
    /// time.
    pub(super) fn new(apparatus: &Apparatus, hand: &HandImpedance, period: f64) -> Result<Self, SimulationError> {
        let linear = Channel {
            inertia: apparatus.mass + hand.mass,
            hand_damping: hand.damping,
            damping: apparatus.damping,
            stiffness: hand.stiffness,
            friction: apparatus.friction,
        };
        let angular = Channel {
            inertia: apparatus.inertia + hand.inertia,
            hand_damping: hand.angular_damping,
            damping: apparatus.angular_damping,
            stiffness: hand.angular_stiffness,
            friction: apparatus.angular_friction,
        };
        if !(linear.is_valid() && angular.is_valid()) {
            return Err(SimulationError::Mechanics);
        }
        let longest = LONGEST_STEP.min(RESOLUTION / linear.rate().max(angular.rate()));
        if steps(period, longest) > MOST_STEPS {
            return Err(SimulationError::TooFast);
        }
        Ok(Self { linear, angular, longest })
    }

    /// Moves `pose` and `twist` on from `time` by `period` (s), under a steady `wrench` about the
    /// grip.
    pub(super) fn advance(
        &self,
        pose: &mut Pose,
        twist: &mut Twist,
        wrench: &Wrench,
        (time, period): (f64, f64),
        intended: impl Fn(f64) -> Pose,
    ) {
        let steps = steps(period, self.longest);
        let h = period / steps;
        let mut goal = intended(time);
        for k in 1..=steps as usize {
            let next = intended(time + h * k as f64);
            let goal_velocity = (next.translation - goal.translation) / h;
            let goal_spin = rotation_between(goal.rotation, next.rotation) / h;
            let middle = drift(&goal, goal_velocity, goal_spin, h / 2.0);
            goal = next;
            *pose = drift(pose, twist.linear, twist.angular, h / 2.0);
            let stretch = middle.translation - pose.translation;
            twist.linear = self.linear.kick(twist.linear, wrench.force, stretch, goal_velocity, h);
            let turn = rotation_between(pose.rotation, middle.rotation);
            twist.angular = self.angular.kick(twist.angular, wrench.torque, turn, goal_spin, h);
            *pose = drift(pose, twist.linear, twist.angular, h / 2.0);
        }
    }
}

/// Returns the number of equal steps in a period.
fn steps(period: f64, longest: f64) -> f64 {
    (period / longest).ceil().max(1.0)
}

/// Returns `pose` after `seconds` at a constant velocity.
fn drift(pose: &Pose, linear: DVec3, angular: DVec3, seconds: f64) -> Pose {
    Pose {
        rotation: (DQuat::from_scaled_axis(angular * seconds) * pose.rotation).normalize(),
        translation: pose.translation + linear * seconds,
    }
}
