//! States come in and forces go out, as long as the loop writes them.

use std::time::Duration;

use glam::DVec3;

use super::super::*;
use super::service::{Act, Service, frame, released};
use super::{assert_no_force_twice, drive, wrench};
use crate::{WallTime, self_test};

#[test]
fn a_state_comes_in_and_a_force_goes_out() {
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
    // Button a of one array, c of the other: it is the same grip.
    assert_eq!(state.buttons, 0b101);
    drop(device);
    service.over.recv_timeout(Duration::from_secs(5)).unwrap();
    let told = service.told();
    assert!(told.iter().all(|told| told.spelled == "vector"));
    assert!(told.iter().filter(|told| told.force.x == 1.0).count() >= 5, "{}", told.len());
    assert_no_force_twice(&told);
    assert_eq!(told.last().unwrap().force, DVec3::ZERO, "it must close with zero");
}

#[test]
fn a_loop_that_stops_writing_gets_zeros_sent() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 10).unwrap();
    std::thread::sleep(Duration::from_millis(60));
    let told = service.told();
    let last = told.iter().rposition(|told| told.force != DVec3::ZERO).unwrap();
    assert!(told.len() - last > 3, "{last} of {}", told.len());
    assert!(device.counts().idle > 3);
    assert_no_force_twice(&told);
}

#[test]
fn the_arm_passes_its_self_test_and_is_told_no_force_by_it() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    let passed = self_test(&mut device, &WallTime::new()).unwrap();
    assert!(passed.brake && passed.own_watchdog.is_some() && !passed.withheld, "{passed}");
    assert!(service.told().iter().all(|told| told.force == DVec3::ZERO));
    drive(&mut device, 20).unwrap();
    assert!(service.told().iter().any(|told| told.force.x == 1.0), "and is as good as before");
}

#[test]
fn the_brake_takes_the_force_away() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    let brake = device.brake().unwrap();
    drive(&mut device, 5).unwrap();
    brake.apply();
    std::thread::sleep(Duration::from_millis(20));
    let before = service.told().len();
    drive(&mut device, 20).unwrap();
    assert!(service.told()[before..].iter().all(|told| told.force == DVec3::ZERO));
    brake.release();
    drive(&mut device, 20).unwrap();
    assert!(service.told().last().is_some() && service.told().iter().rev().take(10).any(|told| told.force.x == 1.0));
}

#[test]
fn forces_are_kept_within_the_arm_and_are_numbers() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    assert!(matches!(device.write(&wrench(DVec3::NAN)), Err(DeviceError::Refused(_))));
    for _ in 0..5 {
        device.read().unwrap();
        device.write(&wrench(DVec3::new(0.0, 3e7, 4e7))).unwrap();
        std::thread::sleep(Duration::from_millis(2));
    }
    let told = service.told();
    assert!(told.iter().all(|told| told.force.length() < 10.0 + 1e-5));
    assert!(told.iter().any(|told| told.force.length() > 9.9));
}

#[test]
fn a_force_that_knows_only_old_states_is_withheld() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    device.read().unwrap();
    // A step that takes its time: zeros go out, and states come in, meanwhile.
    std::thread::sleep(Duration::from_millis(80));
    device.write(&wrench(DVec3::X)).unwrap();
    std::thread::sleep(Duration::from_millis(20));
    assert!(service.told().iter().all(|told| told.force == DVec3::ZERO));
    assert_eq!(device.counts().withheld, 1);
}

#[test]
fn a_state_is_never_older_for_frames_that_nobody_asked_for() {
    let service = Service::usual(|count| Act::Say(vec![frame(count).to_string(), frame(count).to_string()]));
    let mut device = service.open();
    drive(&mut device, 100).unwrap();
    let state = device.read().unwrap();
    let newest = service.told().len() as f64 * 1e-3;
    // Left in the queue, every second frame would make it a message older: a hundred by now.
    assert!(newest - state.pose.translation.z < 0.01, "{} of {newest}", state.pose.translation.z);
    assert!(device.counts().extra > 50);
}

#[test]
fn a_state_that_is_not_new_keeps_its_time() {
    let service = Service::usual(|count| if count < 5 { Act::Answer } else { Act::Silence });
    let mut device = service.open();
    std::thread::sleep(Duration::from_millis(60));
    let first = device.read().unwrap();
    std::thread::sleep(Duration::from_millis(20));
    assert_eq!(device.read().unwrap(), first);
}
