//! Tests of the client against scripted services, some of which misbehave.

mod exchange;
mod failures;
mod mischief;
mod opening;
mod service;
mod withholding;

use std::time::{Duration, Instant};

use glam::DVec3;
use palpus::algebra::Wrench;

use self::service::Received;
use super::*;

fn wrench(force: DVec3) -> Wrench {
    Wrench { torque: DVec3::ZERO, force }
}

/// Drives `device` at about 500 Hz for `ticks` ticks, or until it fails. Each written force is
/// different.
fn drive(device: &mut HaplyDevice, ticks: u32) -> Result<(), DeviceError> {
    for _ in 0..ticks {
        device.read()?;
        device.write(&wrench(DVec3::new(1.0, 0.0, 1e-3 * device.serial as f64)))?;
        std::thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}

/// Drives `device` until it is lost, for at most five seconds, and returns the reason.
fn drive_until_lost(device: &mut HaplyDevice) -> String {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(5) {
        match drive(device, 1) {
            Ok(()) => {}
            Err(DeviceError::Lost(why)) => return why.into_owned(),
            Err(other) => panic!("{other}"),
        }
    }
    panic!("the device must be lost: {:?}", device.counts());
}

/// Checks that every force was sent only once.
fn assert_no_force_twice(received: &[Received]) {
    let mut seen = Vec::new();
    for Received { force, .. } in received.iter().filter(|received| received.force != DVec3::ZERO) {
        assert!(!seen.contains(force), "{force} was sent twice");
        seen.push(*force);
    }
}
