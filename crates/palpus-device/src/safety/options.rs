//! Options of the safety chain.

use super::{AfterFault, DEVICE_BUTTONS, EnableMode, HOLD_KEY, Rearm, SafetyLimits};
use crate::device::DeviceSpec;

/// Options of the safety chain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyOptions {
    /// How the user enables forces. With `None`, the user holds any button of the device. If the
    /// device has no buttons, forces are enabled automatically.
    pub enable_mode: Option<EnableMode>,
    /// Thresholds of the chain; `None` for [`SafetyLimits::of`] the device. A threshold that is
    /// looser than the threshold of the device has no effect.
    pub limits: Option<SafetyLimits>,
    /// Accepts looser thresholds, even infinite thresholds. Use this only in tests, never with a
    /// device that a person holds.
    pub loosened: bool,
    /// Reaction to a fault that the loop survives.
    pub after_fault: AfterFault,
    /// Reaction to a panic in the step, which may have left the step's state inconsistent.
    pub after_panic: AfterPanic,
    /// How a device is enabled again after three faults in ten seconds.
    pub rearm: Rearm,
}

/// Reaction to a panic in the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterPanic {
    /// The run ends, after a moment of damping.
    #[default]
    Stop,
    /// The panic counts as an ordinary fault.
    AsFault,
}

impl SafetyOptions {
    /// Returns how forces are enabled on a device with this `spec`.
    pub fn enable_mode(&self, spec: &DeviceSpec) -> EnableMode {
        self.enable_mode.unwrap_or(match spec.buttons {
            0 => EnableMode::Automatic,
            count => EnableMode::DeadMan(HOLD_KEY | (DEVICE_BUTTONS & (u32::MAX >> (32 - count.min(32))))),
        })
    }

    /// Returns the thresholds for a device with this `spec` in a loop of `rate_hz`.
    pub fn limits(&self, spec: &DeviceSpec, rate_hz: f64) -> SafetyLimits {
        let derived = SafetyLimits::of(spec, rate_hz);
        match self.limits {
            Some(given) if self.loosened => given,
            Some(given) => given.within(&derived),
            None => derived,
        }
    }
}
