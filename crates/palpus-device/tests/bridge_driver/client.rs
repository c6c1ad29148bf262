//! The client side of a bridge, for tests.

use std::time::{Duration, Instant};

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus_device::{BridgeAddress, BridgeDevice, BridgeError, BridgeOptions};

use super::StandIn;

pub(crate) fn open(driver: &StandIn) -> BridgeDevice {
    try_open(&driver.address).expect("the session opens")
}

pub(crate) fn try_open(address: &BridgeAddress) -> Result<BridgeDevice, BridgeError> {
    BridgeDevice::open(&BridgeOptions { address: address.clone(), priority: None })
}

/// Waits until `what` returns true; returns false after two seconds.
pub(crate) fn comes_to(mut what: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(2) {
        if what() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

pub(crate) fn up(newtons: f64) -> Wrench {
    Wrench { force: DVec3::Z * newtons, torque: DVec3::ZERO }
}
