//! A simulated device held by a simulated operator: the default device, also used in tests.
//!
//! The chain of the simulation is: intended pose → spring–damper of the hand → inertia and
//! friction of device and hand → encoders, once per tick → the loop → the written wrench → device
//! and hand. The written wrench is clipped to the device's limits, delayed by one tick by default,
//! and held for one tick.
//!
//! Simulated time is counted in reads. Every [`HapticDevice::read`] after the first read advances
//! the time by one period: the nominal period, or an uneven period ([`Jitter`]). The wall clock has
//! no influence. So a run is the same, bit for bit, at full speed and in real time.
//!
//! 1. The wrench written at tick k acts from tick k + `delay_ticks` on, for one period (zero-order
//!    hold).
//! 2. Device and hand are one body with the sum of the masses. The inertia is the same about all
//!    axes, so there is no gyroscopic term.
//! 3. While the brake is applied, the device only damps its motion, whatever wrench is written.
//! 4. The grip's pose is rounded to the encoders' steps. The velocity is the low-pass filtered
//!    difference of these poses, as in a device's driver.

mod dynamics;
mod encoder;
mod guided;
mod hand;
mod jitter;

use std::borrow::Cow;
use std::sync::Arc;

use palpus::algebra::{Pose, Twist, Wrench};

use crate::acting::DELAY_MAX;
use crate::device::{Axes, Brake, BrakeFlag, DeviceError, DeviceSpec, DeviceState, HapticDevice};
use crate::safety::SafetyLimits;
use dynamics::Dynamics;

pub use dynamics::Apparatus;
pub use encoder::Encoder;
pub use guided::{Guide, Guided};
pub use hand::{HAND_PRESETS, HandImpedance, Intent, hand_preset};
pub use jitter::Jitter;
use jitter::Periods;

/// Settings of a simulated device.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationSettings {
    /// Description of the device. Written forces and torques are each clipped to the limits of the
    /// device.
    pub spec: DeviceSpec,
    /// Number of reads per simulated second, Hz.
    pub rate_hz: f64,
    /// Impedance of the hand that holds the device.
    pub hand: HandImpedance,
    /// Mechanics of the device.
    pub apparatus: Apparatus,
    /// Sensors of the device.
    pub encoder: Encoder,
    /// Delay from a write to its effect, in ticks, not counting the hold; at most 8.
    pub delay_ticks: usize,
    /// Timing jitter of the reads; `None` for reads exactly at the rate.
    pub jitter: Option<Jitter>,
}

impl Default for SimulationSettings {
    /// Returns a light arm with the limits of the paper's device (8.5 N, continuously 1.4 N; 0.188
    /// N·m), held with an ordinary grip, at 1 kHz, with a delay of one tick.
    fn default() -> Self {
        Self {
            spec: DeviceSpec {
                name: Cow::Borrowed("simulated"),
                force_max: 8.5,
                torque_max: 0.188,
                force_continuous: Some(1.4),
                torque_continuous: Some(0.188),
                actuated: Axes::FULL,
                sensed: Axes::FULL,
                buttons: 0,
                workspace: None,
                delay: 1e-3,
                position_step: Encoder::TYPICAL.position_quantum,
                angle_step: Encoder::TYPICAL.angle_quantum,
            },
            rate_hz: 1000.0,
            hand: HandImpedance::NORMAL,
            apparatus: Apparatus::LIGHT_ARM,
            encoder: Encoder::TYPICAL,
            delay_ticks: 1,
            jitter: None,
        }
    }
}

/// The reason why a simulated device cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The rate is not a positive finite number.
    #[error("the rate must be positive, but is {0} Hz")]
    Rate(f64),
    /// The total mass or inertia is zero, or a parameter is negative or not finite.
    #[error("device and hand need positive mass and inertia; stiffness, damping and friction must not be negative")]
    Mechanics,
    /// The stiffness or damping is so large for the mass that a tick would need more than 10 000
    /// steps.
    #[error(
        "device and hand move too fast to simulate: the mass or inertia is too small for the stiffness and damping"
    )]
    TooFast,
    /// An encoder step or the filter frequency is negative or not finite.
    #[error("the encoders' steps must not be negative, and the velocity filter must be positive")]
    Encoder,
    /// The delay is too long.
    #[error("the delay must be at most {DELAY_MAX} ticks, but is {0}")]
    Delay(usize),
    /// A force or torque limit is negative or NaN.
    #[error("force and torque limits must not be negative")]
    Limits,
    /// The intended pose at time 0 is not finite.
    #[error("the intended pose at the start is not finite")]
    Start,
    /// A jitter parameter is out of range.
    #[error("jitter: wander and scatter must be from 0 to 0.1, late ticks from 1 to 10 periods")]
    Jitter,
}

/// A simulated haptic device, held by a simulated operator; the module describes the
/// model.
#[derive(Clone, Debug)]
pub struct SimulatedDevice<I> {
    settings: SimulationSettings,
    intent: I,
    dynamics: Dynamics,
    period: f64,
    uneven: Option<Periods>,
    tick: Option<u64>,
    /// Simulated time of the last read if periods are uneven, s.
    elapsed: f64,
    pose: Pose,
    twist: Twist,
    sensed: Pose,
    sensed_twist: Twist,
    /// Written wrenches, newest first.
    written: [Wrench; DELAY_MAX + 1],
    brake: OwnBrake,
}

/// A brake that is not shared with a clone of the device.
#[derive(Debug, Default)]
struct OwnBrake(Arc<BrakeFlag>);

impl Clone for OwnBrake {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<I: Intent> SimulatedDevice<I> {
    /// Returns a device at rest at the pose that `intent` has at time 0.
    ///
    /// # Errors
    /// Fails if a setting is out of range.
    pub fn new(settings: SimulationSettings, intent: I) -> Result<Self, SimulationError> {
        check(&settings)?;
        let period = 1.0 / settings.rate_hz;
        let dynamics = Dynamics::new(&settings.apparatus, &settings.hand, period)?;
        let pose = intent.pose(0.0);
        if !pose.is_valid() {
            return Err(SimulationError::Start);
        }
        let sensed = settings.encoder.sense(&pose);
        let mut settings = settings;
        settings.spec.delay = settings.delay_ticks as f64 * period;
        settings.spec.position_step = settings.encoder.position_quantum;
        settings.spec.angle_step = settings.encoder.angle_quantum;
        Ok(Self {
            uneven: settings.jitter.map(|jitter| Periods::new(jitter, period)),
            elapsed: 0.0,
            settings,
            intent,
            dynamics,
            period,
            tick: None,
            pose,
            twist: Twist::default(),
            sensed,
            sensed_twist: Twist::default(),
            written: [Wrench::ZERO; DELAY_MAX + 1],
            brake: OwnBrake::default(),
        })
    }

    /// Sets the velocity of the grip, as after a push.
    pub fn push(&mut self, twist: Twist) {
        self.twist = twist;
    }

    /// Returns the simulated time at the last read, s.
    pub fn time(&self) -> f64 {
        match self.uneven {
            Some(_) => self.elapsed,
            None => self.tick.unwrap_or(0) as f64 * self.period,
        }
    }

    /// Returns the true pose of the grip, without encoders.
    pub fn true_pose(&self) -> Pose {
        self.pose
    }

    /// Returns the true velocity of the grip (m/s at its origin, and rad/s), in the device's frame.
    pub fn true_twist(&self) -> Twist {
        self.twist
    }

    /// Returns the wrench that acts until the next read: the wrench that was written `delay_ticks`
    /// ticks before the last tick.
    pub fn applied(&self) -> Wrench {
        self.written[self.settings.delay_ticks]
    }

    fn advance(&mut self) {
        if self.brake.0.is_applied() {
            self.written = [self.braking(); DELAY_MAX + 1];
        }
        let applied = self.written[self.settings.delay_ticks];
        let time = self.time();
        let period = self.uneven.as_mut().map_or(self.period, Periods::next);
        self.intent.begin(time, &self.pose);
        let intent = &self.intent;
        self.dynamics.advance(&mut self.pose, &mut self.twist, &applied, (time, period), |t| intent.pose(t));
        self.elapsed += period;
        // Without a new write, the last wrench is held.
        self.written.copy_within(0..DELAY_MAX, 1);
        let before = self.sensed;
        self.sensed = self.settings.encoder.sense(&self.pose);
        self.sensed_twist = self.settings.encoder.estimate(&self.sensed_twist, &before, &self.sensed, period);
    }

    /// Returns the damping of the device while its brake is applied. It equals the damping after a
    /// fault.
    fn braking(&self) -> Wrench {
        let limits = SafetyLimits::of(&self.settings.spec, self.settings.rate_hz);
        Wrench {
            torque: (self.twist.angular * -limits.angular_damping).clamp_length_max(limits.rest_torque),
            force: (self.twist.linear * -limits.damping).clamp_length_max(limits.rest_force),
        }
    }
}

impl<I: Intent> HapticDevice for SimulatedDevice<I> {
    fn spec(&self) -> &DeviceSpec {
        &self.settings.spec
    }

    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.tick = match self.tick {
            None => Some(0),
            Some(tick) => {
                self.advance();
                Some(tick + 1)
            }
        };
        Ok(DeviceState { pose: self.sensed, twist: self.sensed_twist, buttons: 0, time: self.time(), withheld: false })
    }

    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if !wrench.is_finite() {
            return Err(DeviceError::Refused(Cow::Borrowed("it is not finite")));
        }
        self.written[0] = Wrench {
            torque: wrench.torque.clamp_length_max(self.settings.spec.torque_max),
            force: wrench.force.clamp_length_max(self.settings.spec.force_max),
        };
        Ok(())
    }

    fn stands_unread(&self) -> bool {
        true
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.0.clone())
    }
}

fn check(settings: &SimulationSettings) -> Result<(), SimulationError> {
    let SimulationSettings { spec, rate_hz, encoder, delay_ticks, jitter, .. } = settings;
    if !(*rate_hz > 0.0 && rate_hz.is_finite()) {
        return Err(SimulationError::Rate(*rate_hz));
    }
    if *delay_ticks > DELAY_MAX {
        return Err(SimulationError::Delay(*delay_ticks));
    }
    if !(spec.force_max >= 0.0 && spec.torque_max >= 0.0) {
        return Err(SimulationError::Limits);
    }
    let steps = [encoder.position_quantum, encoder.angle_quantum];
    let filter = encoder.velocity_cutoff_hz.unwrap_or(1.0);
    if !(steps.iter().all(|q| *q >= 0.0 && q.is_finite()) && filter > 0.0) {
        return Err(SimulationError::Encoder);
    }
    let little = |v: f64| (0.0..=0.1).contains(&v);
    let even_enough = |jitter: &Jitter| {
        let [least, most] = jitter.late;
        little(jitter.wander)
            && jitter.scatter.iter().all(|v| little(*v))
            && (0.0..=1.0).contains(&jitter.late_share)
            && (1.0..=10.0).contains(&least)
            && (least..=10.0).contains(&most)
    };
    if !jitter.iter().all(even_enough) {
        return Err(SimulationError::Jitter);
    }
    Ok(())
}

#[cfg(test)]
mod tests;
