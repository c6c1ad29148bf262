//! Findings of `palpus devices` for SpaceMouse devices.

use super::{SpaceMouse, SpaceMouseError};
use crate::device::HapticDevice;
use crate::found::Finding;

const BACKEND: &str = "spacemouse";
/// Recommended rate of the loop, Hz. The device sends some hundred reports per second.
const RATE_HZ: f64 = 1000.0;
/// Text for the user that says what the search looks for.
const LOOKED_FOR: &str = "HID devices of 3Dconnexion (256f, and 046d before) in /sys/class/hidraw";

/// Returns a finding for each connected SpaceMouse, readable or not.
pub(crate) fn look() -> Vec<Finding> {
    #[cfg(target_os = "linux")]
    {
        let plugged = super::hidraw::plugged(std::path::Path::new(super::hidraw::LIST), std::path::Path::new("/dev"));
        if !plugged.is_empty() {
            return plugged.iter().map(|device| finding(Some(&device.path.display().to_string()))).collect();
        }
    }
    vec![finding(None)]
}

fn finding(path: Option<&str>) -> Finding {
    match SpaceMouse::open(path) {
        Ok(device) => {
            let name = path.map_or_else(|| "spacemouse".to_owned(), |path| format!("spacemouse:{path}"));
            Finding::found(BACKEND, name, device.spec().clone(), RATE_HZ, "input only: it has no motors")
        }
        Err(error) => Finding::missing(
            BACKEND,
            "any 3Dconnexion cap, as input without force",
            LOOKED_FOR,
            why(&error),
            mend(&error),
        ),
    }
}

fn why(error: &SpaceMouseError) -> String {
    match error {
        // The remedy is a separate field of the finding.
        SpaceMouseError::Denied { path, why, .. } => {
            format!("{path} is a SpaceMouse, but this user may not read it ({why})")
        }
        SpaceMouseError::None if !lists_devices() => {
            "this system lists no HID devices (perhaps it is a container)".to_owned()
        }
        other => other.to_string(),
    }
}

#[cfg(target_os = "linux")]
fn lists_devices() -> bool {
    std::path::Path::new(super::hidraw::LIST).exists()
}

#[cfg(not(target_os = "linux"))]
fn lists_devices() -> bool {
    true
}

fn mend(error: &SpaceMouseError) -> String {
    match error {
        SpaceMouseError::None => "plug one in; no driver is needed".to_owned(),
        SpaceMouseError::Denied { mend, .. } => mend.clone(),
        SpaceMouseError::Unusable { .. } => "unplug the device and plug it in again".to_owned(),
        SpaceMouseError::NotHere => "use the device on Linux".to_owned(),
    }
}
