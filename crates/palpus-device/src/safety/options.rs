//! Options of the safety chain.

use super::{AfterFault, DEVICE_BUTTONS, Engagement, HOLD_KEY, Rearm, SafetyLimits};
use crate::device::DeviceSpec;

/// How the chain is to behave where there is a choice.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyOptions {
    /// How forces are asked for; `None`: by holding any button if the device has buttons, else
    /// automatically.
    pub engagement: Option<Engagement>,
    /// The thresholds; `None`: those of the device, [`SafetyLimits::of`]. Where others are looser,
    /// the device's count.
    pub limits: Option<SafetyLimits>,
    /// Takes looser thresholds as they are, down to none at all. For tests of what lies beyond
    /// them, not for a device that is held.
    pub loosened: bool,
    /// Behaviour after a fault that the loop survives.
    pub after_fault: AfterFault,
    /// Behaviour after a panic in the step, which may have left its state inconsistent.
    pub after_panic: AfterPanic,
    /// After three faults in ten seconds.
    pub rearm: Rearm,
}

/// Reaction to a panic in the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterPanic {
    /// The run ends, after a moment of damping.
    #[default]
    Stop,
    /// A fault like any other.
    AsFault,
}

impl SafetyOptions {
    /// How forces are asked for on a device of this `spec`.
    pub fn engagement(&self, spec: &DeviceSpec) -> Engagement {
        self.engagement.unwrap_or(match spec.buttons {
            0 => Engagement::Automatic,
            count => Engagement::DeadMan(HOLD_KEY | (DEVICE_BUTTONS & (u32::MAX >> (32 - count.min(32))))),
        })
    }

    /// The thresholds for a device of this `spec` in a loop of `rate_hz`.
    pub fn limits(&self, spec: &DeviceSpec, rate_hz: f64) -> SafetyLimits {
        let derived = SafetyLimits::of(spec, rate_hz);
        match self.limits {
            Some(given) if self.loosened => given,
            Some(given) => given.within(&derived),
            None => derived,
        }
    }
}
