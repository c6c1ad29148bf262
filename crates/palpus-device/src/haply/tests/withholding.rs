//! Tests that states are withheld while the arm gives no force.

use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::{Value, json};

use super::super::*;
use super::service::{Act, Service, frame, with};
use super::{drive, drive_until_lost, wrench};

/// Reads and writes until a state has this value of `withheld`, for at most five seconds.
fn drive_until_withheld(device: &mut HaplyDevice, withheld: bool) -> DeviceState {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(5) {
        let state = device.read().unwrap();
        if state.withheld == withheld {
            return state;
        }
        device.write(&wrench(DVec3::X)).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("no state with withheld = {withheld}: {:?}", device.counts());
}

/// Returns a service that sends `says` from message 20 to 59.
fn interrupted(says: impl Fn(usize) -> Value + Send + 'static) -> Service {
    let script = move |k| if (20..60).contains(&k) { Act::Say(vec![says(k).to_string()]) } else { Act::Answer };
    Service::usual(script)
}

#[test]
fn unready_or_unpowered_arm_withholds_its_force() {
    for status in ["ready", "power_supply", "calibrated"] {
        let place = format!("/inverse3/0/status/{status}");
        let service = interrupted(move |k| with(frame(k), &place, json!(false)));
        let mut device = service.open();
        drive_until_withheld(&mut device, false);
        drive_until_withheld(&mut device, true);
        drive_until_withheld(&mut device, false);
    }
}

#[test]
fn scaling_during_a_run_withholds_the_force() {
    let scaled = json!({ "scale": { "x": 3, "y": 3, "z": 3 } });
    let service = interrupted(move |k| with(frame(k), "/inverse3/0/state/transform", scaled.clone()));
    let mut device = service.open();
    drive_until_withheld(&mut device, true);
    drive_until_withheld(&mut device, false);
}

#[test]
fn sleeping_grip_withholds_force_and_releases_buttons() {
    for status in ["awake", "connected", "ready"] {
        let place = format!("/wireless_verse_grip/0/status/{status}");
        let service = interrupted(move |k| with(frame(k), &place, json!(false)));
        let mut device = service.open();
        let state = drive_until_withheld(&mut device, true);
        assert_eq!(state.buttons, 0, "{status}");
        let state = drive_until_withheld(&mut device, false);
        assert_eq!(state.buttons, 0, "{status}: buttons held at waking must not count as pressed");
    }
}

#[test]
fn lost_answer_withholds_the_force() {
    let wrongs: [fn() -> Act; 3] =
        [|| Act::Silence, || Act::After(Duration::from_millis(20)), || Act::Say(vec!["{".to_owned()])];
    for wrong in wrongs {
        let service = Service::usual(move |count| if count == 20 { wrong() } else { Act::Answer });
        let mut device = service.open();
        drive_until_withheld(&mut device, true);
        drive_until_withheld(&mut device, false);
    }
}

#[test]
fn force_is_not_sent_before_the_loop_saw_the_gap() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 5).unwrap();
    // While the loop stands still, zeros are sent.
    std::thread::sleep(Duration::from_millis(60));
    let before = service.received().len();
    for _ in 0..5 {
        // The loop does not read, so it has not seen the gap.
        device.write(&wrench(DVec3::X * 5.0)).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(service.received()[before..].iter().all(|received| received.force == DVec3::ZERO));
    assert!(device.read().unwrap().withheld, "the gap must withhold the state");
    device.write(&Wrench::ZERO).unwrap();
    assert!(!drive_until_withheld(&mut device, false).withheld);
}

/// Returns a service whose reported force is `given` applied to the last commanded force.
fn echoing(given: fn(DVec3) -> DVec3) -> Service {
    let script = move |_| Act::Echo(given);
    Service::usual(script)
}

#[test]
fn correct_force_report_is_not_counted() {
    let service = echoing(|commanded| commanded);
    let mut device = service.open();
    drive(&mut device, 60).unwrap();
    assert_eq!(device.counts().otherwise, 0);
    // On a busy machine the loop may have been delayed, which withholds the force for a while.
    drive_until_withheld(&mut device, false);
}

#[test]
fn wrong_force_report_is_counted_and_withholds() {
    let wrongs: [fn(DVec3) -> DVec3; 3] = [|_| DVec3::ZERO, |commanded| commanded * 2.0, |commanded| -commanded];
    for wrong in wrongs {
        let service = echoing(wrong);
        let mut device = service.open();
        let begun = Instant::now();
        // On a busy machine a delay of the loop may withhold the state before the reports do.
        while device.counts().otherwise <= 5 {
            assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", device.counts());
            drive_until_withheld(&mut device, true);
            device.write(&wrench(DVec3::X)).unwrap();
            std::thread::sleep(Duration::from_millis(1));
        }
        drive_until_withheld(&mut device, true);
    }
}

#[test]
fn uncommanded_force_loses_the_device() {
    let service = echoing(|_| DVec3::Z * 2.0);
    let mut device = service.open();
    let lost = drive_until_lost(&mut device);
    assert!(lost.contains("although zero is commanded"), "{lost}");
    assert_eq!(service.received().last().unwrap().force, DVec3::ZERO);
}
