//! A device in a simulated hand: the default, and every test's hand.
//!
//! intended pose → hand's spring–damper → inertia and friction of device and hand → encoders, once
//! a tick → the loop → the written wrench, clipped to what the device can do, held for a tick and
//! applied one tick late → device and hand.
//!
//! Simulated time is counted in reads: every [`HapticDevice::read`] after the first moves it on by
//! one period, the nominal one or as uneven as a servo's ([`Jitter`]), whatever the clock on the
//! wall says. So a run is the same, bit for bit, at full speed and in real time.
//!
//! 1. The wrench written at tick k acts from tick k + `delay_ticks` on, for one period (zero-order
//!    hold).
//! 2. Device and hand are one body of summed mass; rotation has one inertia about all axes, so no
//!    gyroscopic term.
//! 3. While its brake is applied it damps its motion and nothing else, whatever is written.
//! 4. The grip's pose is rounded to the encoders' steps; velocity is differenced from that and
//!    low-pass filtered, as in a device's driver.

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
    /// The device's description. Written forces and torques are each clipped to its limits.
    pub spec: DeviceSpec,
    /// Reads per simulated second, Hz.
    pub rate_hz: f64,
    /// The hand that holds it.
    pub hand: HandImpedance,
    /// Its own mechanics.
    pub apparatus: Apparatus,
    /// Its sensors.
    pub encoder: Encoder,
    /// Ticks from a write to its effect, beyond the hold; at most 8.
    pub delay_ticks: usize,
    /// How unevenly it is read; `None`: exactly at the rate.
    pub jitter: Option<Jitter>,
}

impl Default for SimulationSettings {
    /// A light arm with the limits of the paper's device (8.5 N, continuously 1.4 N; 0.188 N·m), in
    /// an ordinary hand, at 1 kHz, one tick late.
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

/// Why a simulated device cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// Not a positive finite number.
    #[error("the rate must be positive, and is {0} Hz")]
    Rate(f64),
    /// A mass or an inertia sums to nothing, or a number is negative or not finite.
    #[error("device and hand need positive mass and inertia, and no negative stiffness, damping or friction")]
    Mechanics,
    /// So stiff or so strongly damped for its mass that a tick would take more than 10 000 steps.
    #[error("device and hand move too fast to simulate: too little mass or inertia for the stiffness and damping")]
    TooFast,
    /// A quantum or the filter is negative or not finite.
    #[error("the encoders' steps must not be negative, and the velocity filter must be positive")]
    Encoder,
    /// More than a simulated device can hold back.
    #[error("at most {DELAY_MAX} ticks of delay, not {0}")]
    Delay(usize),
    /// A limit is negative or not a number.
    #[error("force and torque limits must not be negative")]
    Limits,
    /// The intended pose at time 0 is not a pose.
    #[error("the intended pose at the start is not finite")]
    Start,
    /// A number of the jitter is negative or not finite, or periods would be.
    #[error("jitter: wander and scatter must be from 0 to a tenth, late ticks from 1 to 10 periods")]
    Jitter,
}

/// A haptic device and the hand that holds it; see the module's outline.
#[derive(Clone, Debug)]
pub struct SimulatedDevice<I> {
    settings: SimulationSettings,
    intent: I,
    dynamics: Dynamics,
    period: f64,
    uneven: Option<Periods>,
    tick: Option<u64>,
    /// s: of the last read, when periods are uneven.
    elapsed: f64,
    pose: Pose,
    twist: Twist,
    sensed: Pose,
    sensed_twist: Twist,
    /// The newest written wrench first.
    written: [Wrench; DELAY_MAX + 1],
    brake: OwnBrake,
}

/// A brake that is not shared with a copy of the device.
#[derive(Debug, Default)]
struct OwnBrake(Arc<BrakeFlag>);

impl Clone for OwnBrake {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<I: Intent> SimulatedDevice<I> {
    /// A device at rest at the pose that `intent` has at time 0.
    ///
    /// # Errors
    /// When a setting is out of range.
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

    /// Gives the device a velocity, as a push would.
    pub fn push(&mut self, twist: Twist) {
        self.twist = twist;
    }

    /// Simulated seconds at the last read.
    pub fn time(&self) -> f64 {
        match self.uneven {
            Some(_) => self.elapsed,
            None => self.tick.unwrap_or(0) as f64 * self.period,
        }
    }

    /// True pose of the grip, before the encoders.
    pub fn true_pose(&self) -> Pose {
        self.pose
    }

    /// How the grip truly moves.
    pub fn true_twist(&self) -> Twist {
        self.twist
    }

    /// The wrench that the device will push with until the next read: what was written as many
    /// ticks ago as it is late.
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
        // A wrench that is not written anew is held.
        self.written.copy_within(0..DELAY_MAX, 1);
        let before = self.sensed;
        self.sensed = self.settings.encoder.sense(&self.pose);
        self.sensed_twist = self.settings.encoder.estimate(&self.sensed_twist, &before, &self.sensed, period);
    }

    /// Damping of the device while its brake is applied: the same as at a fault.
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
