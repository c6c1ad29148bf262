//! Findings of `palpus devices` for Haply.

use super::{HAPLY_ADDRESS, HaplyDevice, HaplyError, HaplyOptions};
use crate::device::HapticDevice;
use crate::found::Finding;

const BACKEND: &str = "haply";
const DEVICES: &str = "Inverse3, Inverse3x, Minverse, with a VerseGrip";
/// Recommended rate of the loop, Hz: the rate of the maker's examples.
const RATE_HZ: f64 = 1000.0;

/// Searches for the service on this machine.
pub(crate) fn look() -> Vec<Finding> {
    vec![look_at(&HaplyOptions::default())]
}

pub(super) fn look_at(options: &HaplyOptions) -> Finding {
    match HaplyDevice::open(options) {
        Ok(device) => {
            let name = if options.address == HAPLY_ADDRESS {
                "haply".to_owned()
            } else {
                format!("haply:{}", options.address)
            };
            Finding::found(BACKEND, name, device.spec().clone(), RATE_HZ, device.notes().join("; "))
        }
        Err(error) => {
            let looked_for = format!("the Haply Inverse Service at {}", options.address);
            let why = match &error {
                // The address is already in `looked_for`.
                HaplyError::NoService { why, .. } => why.clone(),
                other => other.to_string(),
            };
            Finding::missing(BACKEND, DEVICES, looked_for, why, mend(&error))
        }
    }
}

fn mend(error: &HaplyError) -> &'static str {
    match error {
        HaplyError::Address(_) | HaplyError::NotHere(_) => "write the address as ws://localhost:10001",
        HaplyError::NoService { .. } => {
            "install the Haply Inverse Service (develop.haply.co) and start it, or name its address: --device haply:ws://HOST:PORT"
        }
        HaplyError::NotUnderstood { .. } => {
            "make sure that the port is the service's, and update the service to 3.5 or later"
        }
        HaplyError::NoDevice { .. } => "plug in the arm and its power supply, then look again",
        HaplyError::NotReady { .. } => "follow the advice in the message, then look again",
    }
}
