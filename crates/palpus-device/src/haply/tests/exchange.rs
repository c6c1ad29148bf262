//! Tests that states arrive, and that forces are sent as long as the loop writes them.

use std::time::Duration;

use glam::DVec3;

use super::super::*;
use super::service::{Act, Service, frame, released};
use super::{assert_no_force_twice, drive, wrench};
use crate::{WallTime, self_test};

#[test]
fn states_arrive_and_forces_are_sent() {
    let service = Service::usual(|k| if k < 5 { Act::Say(vec![released(k).to_string()]) } else { Act::Answer });
    let mut device = service.open();
    let spec = device.spec().clone();
    assert_eq!((spec.name.as_ref(), spec.force_max, spec.torque_max, spec.buttons), ("Inverse3", 10.0, 0.0, 3));
    assert_eq!((spec.actuated.rotation, spec.sensed.rotation), (0, 3));
    let notes = device.notes().join("\n");
    for noted in ["3.5.1", "force gate: {\"gain\":0.3}", "oscillation damper", "grip 1102", "axes: \"XYZ\""] {
        assert!(notes.contains(noted), "{notes}");
    }
    assert!(!notes.contains("mount") && !notes.contains("turns the axes"), "{notes}");
    drive(&mut device, 50).unwrap();
    let state = device.read().unwrap();
    assert_eq!(state.twist.linear, DVec3::new(0.0, 0.25, -0.5));
    assert_eq!((state.pose.translation.x, state.pose.translation.y), (0.01, -0.1));
    assert!(state.pose.rotation.y > 0.79 && state.twist.angular == DVec3::ZERO);
    // Button a is pressed in one array and button c in the other; both entries are the same grip.
    assert_eq!(state.buttons, 0b101);
    drop(device);
    service.over.recv_timeout(Duration::from_secs(5)).unwrap();
    let received = service.received();
    assert!(received.iter().all(|received| received.spelled == "vector"));
    assert!(received.iter().filter(|received| received.force.x == 1.0).count() >= 5, "{}", received.len());
    assert_no_force_twice(&received);
    assert_eq!(received.last().unwrap().force, DVec3::ZERO, "it must close with zero");
}

#[test]
fn zero_is_sent_when_the_loop_stops_writing() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 10).unwrap();
    std::thread::sleep(Duration::from_millis(60));
    let received = service.received();
    let last = received.iter().rposition(|received| received.force != DVec3::ZERO).unwrap();
    assert!(received.len() - last > 3, "{last} of {}", received.len());
    assert!(device.counts().idle > 3);
    assert_no_force_twice(&received);
}

#[test]
fn self_test_passes_and_commands_no_force() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    let passed = self_test(&mut device, &WallTime::new()).unwrap();
    assert!(passed.brake && passed.own_watchdog.is_some() && !passed.withheld, "{passed}");
    assert!(service.received().iter().all(|received| received.force == DVec3::ZERO));
    drive(&mut device, 20).unwrap();
    assert!(
        service.received().iter().any(|received| received.force.x == 1.0),
        "the device must work after the self test"
    );
}

#[test]
fn brake_removes_the_force() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    let brake = device.brake().unwrap();
    drive(&mut device, 5).unwrap();
    brake.apply();
    std::thread::sleep(Duration::from_millis(20));
    let before = service.received().len();
    drive(&mut device, 20).unwrap();
    assert!(service.received()[before..].iter().all(|received| received.force == DVec3::ZERO));
    brake.release();
    drive(&mut device, 20).unwrap();
    assert!(
        service.received().last().is_some()
            && service.received().iter().rev().take(10).any(|received| received.force.x == 1.0)
    );
}

#[test]
fn forces_are_finite_and_within_the_limit() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    assert!(matches!(device.write(&wrench(DVec3::NAN)), Err(DeviceError::Refused(_))));
    for _ in 0..5 {
        device.read().unwrap();
        device.write(&wrench(DVec3::new(0.0, 3e7, 4e7))).unwrap();
        std::thread::sleep(Duration::from_millis(2));
    }
    let received = service.received();
    assert!(received.iter().all(|received| received.force.length() < 10.0 + 1e-5));
    assert!(received.iter().any(|received| received.force.length() > 9.9));
}

#[test]
fn force_based_on_old_state_is_not_sent() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    device.read().unwrap();
    // The step takes long. Meanwhile zeros are sent and states arrive.
    std::thread::sleep(Duration::from_millis(80));
    device.write(&wrench(DVec3::X)).unwrap();
    std::thread::sleep(Duration::from_millis(20));
    assert!(service.received().iter().all(|received| received.force == DVec3::ZERO));
    assert_eq!(device.counts().withheld, 1);
}

#[test]
fn unrequested_frames_do_not_delay_states() {
    let service = Service::usual(|count| Act::Say(vec![frame(count).to_string(), frame(count).to_string()]));
    let mut device = service.open();
    drive(&mut device, 100).unwrap();
    let state = device.read().unwrap();
    let newest = service.received().len() as f64 * 1e-3;
    // If the unrequested frames stayed in the queue, each would delay the state by one message: a
    // hundred by now.
    assert!(newest - state.pose.translation.z < 0.01, "{} of {newest}", state.pose.translation.z);
    assert!(device.counts().extra > 50);
}

#[test]
fn repeated_state_keeps_its_time() {
    let service = Service::usual(|count| if count < 5 { Act::Answer } else { Act::Silence });
    let mut device = service.open();
    std::thread::sleep(Duration::from_millis(60));
    let first = device.read().unwrap();
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(device.read().unwrap(), first);
}
