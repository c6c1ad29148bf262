//! The devices found on this machine, and the requirements of the others.
//!
//! Every back end answers for itself with a function `look() -> Vec<Finding>`: one finding for each
//! device. If it sees no device, one finding names the missing part, the places searched, the
//! reason and a remedy of one line. A search never moves a device, never gives it a force, and
//! takes at most a second.

use crate::device::{DeviceSpec, known_devices};
use crate::simulated::SimulationSettings;

/// Finding of a back end about one device.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The back end's name, as people know it.
    pub backend: &'static str,
    /// The device's name, or what devices this back end is for.
    pub name: String,
    /// There or not.
    pub state: FindingState,
}

/// Result of the search for a device.
#[derive(Clone, Debug, PartialEq)]
pub enum FindingState {
    /// It can be used.
    Found {
        /// Value for `--device`.
        device: String,
        /// Its description.
        spec: DeviceSpec,
        /// At which it likes to be driven, Hz.
        rate_hz: f64,
        /// Whatever else is worth knowing; may be empty.
        note: String,
    },
    /// It cannot.
    Missing {
        /// The searched items and places.
        looked_for: String,
        /// The missing item: a library, a service, a permission, a device.
        why: String,
        /// One line that mends it: a command, or what to install from where.
        mend: String,
    },
}

impl Finding {
    /// A device that can be used.
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

    /// Devices that cannot be used, and why.
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

    /// True when it can be used.
    pub fn is_found(&self) -> bool {
        matches!(self.state, FindingState::Found { .. })
    }
}

/// Findings of the back ends of this crate.
pub fn look() -> Vec<Finding> {
    let mut findings = vec![simulated()];
    findings.extend(crate::haply::look());
    findings.extend(crate::spacemouse::look());
    findings.extend(crate::bridge::look());
    findings
}

/// Returns the known properties of the device of this name, as a start for a spec that the device
/// itself completes.
pub fn known_device(name: &str) -> Option<DeviceSpec> {
    known_devices().into_iter().find(|known| known.name == name)
}

fn simulated() -> Finding {
    let settings = SimulationSettings::default();
    Finding::found("simulated", "sim", settings.spec, settings.rate_hz, "a device in a simulated hand; always there")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_always_a_device() {
        assert!(look().iter().any(Finding::is_found));
    }
}
