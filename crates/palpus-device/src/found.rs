//! The devices found on this machine, and what is missing to use other devices.
//!
//! Each back end has a function `look() -> Vec<Finding>` that returns one finding per device. If
//! there is no device, `look` returns one finding that names the missing part, the places searched,
//! the reason and a remedy of one line. A search never moves a device, never gives a force, and
//! takes at most a second.

use crate::device::{DeviceSpec, known_devices};
use crate::simulated::SimulationSettings;

/// Result of a back end's search for one device.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Common name of the back end.
    pub backend: &'static str,
    /// Name of the device; if none was found, the devices that this back end supports.
    pub name: String,
    /// Result of the search.
    pub state: FindingState,
}

/// Result of the search for a device: its description, or the reason why it cannot be used.
#[derive(Clone, Debug, PartialEq)]
pub enum FindingState {
    /// The device can be used.
    Found {
        /// Value for `--device`.
        device: String,
        /// Description of the device.
        spec: DeviceSpec,
        /// Recommended rate of the servo loop, Hz.
        rate_hz: f64,
        /// Other remarks for the user; may be empty.
        note: String,
    },
    /// The device cannot be used.
    Missing {
        /// The searched items and places.
        looked_for: String,
        /// The missing item: a library, a service, a permission, a device.
        why: String,
        /// One line that says how to fix the problem: a command, or what to install and from where.
        mend: String,
    },
}

impl Finding {
    /// Returns a finding for a device that can be used.
    pub fn found(
        backend: &'static str,
        device: impl Into<String>,
        spec: DeviceSpec,
        rate_hz: f64,
        note: impl Into<String>,
    ) -> Self {
        let name = spec.name.to_string();
        Self { backend, name, state: FindingState::Found { device: device.into(), spec, rate_hz, note: note.into() } }
    }

    /// Returns a finding for devices that cannot be used, with the reason.
    pub fn missing(
        backend: &'static str,
        name: impl Into<String>,
        looked_for: impl Into<String>,
        why: impl Into<String>,
        mend: impl Into<String>,
    ) -> Self {
        let state = FindingState::Missing { looked_for: looked_for.into(), why: why.into(), mend: mend.into() };
        Self { backend, name: name.into(), state }
    }

    /// Returns true if the device can be used.
    pub fn is_found(&self) -> bool {
        matches!(self.state, FindingState::Found { .. })
    }
}

/// Returns the findings of all back ends of this crate.
pub fn look() -> Vec<Finding> {
    let mut findings = vec![simulated()];
    findings.extend(crate::haply::look());
    findings.extend(crate::spacemouse::look());
    findings.extend(crate::bridge::look());
    findings
}

/// Returns the known limits of the device called `name`; `None` if the name is unknown. A back end
/// starts from these limits and adds the values that the device itself reports.
pub fn known_device(name: &str) -> Option<DeviceSpec> {
    known_devices().into_iter().find(|known| known.name == name)
}

fn simulated() -> Finding {
    let settings = SimulationSettings::default();
    Finding::found(
        "simulated",
        "sim",
        settings.spec,
        settings.rate_hz,
        "a device held by a simulated operator; always available",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simulated_device_is_always_found() {
        assert!(look().iter().any(Finding::is_found));
    }
}
