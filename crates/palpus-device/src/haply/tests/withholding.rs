//! Reports to the loop when the arm gives no force, whatever the command.

use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::{Value, json};

use super::super::*;
use super::service::{Act, Service, frame, with};
use super::{drive, drive_until_lost, wrench};

/// Reads and writes until a state is withheld, or is not, for at most five seconds.
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
    panic!("it was never {withheld}: {:?}", device.counts());
}

/// A service that says this from message 20 to 60.
fn interrupted(says: impl Fn(usize) -> Value + Send + 'static) -> Service {
    let script = move |k| if (20..60).contains(&k) { Act::Say(vec![says(k).to_string()]) } else { Act::Answer };
    Service::usual(script)
}

#[test]
fn an_arm_that_is_not_ready_or_without_power_withholds_its_force() {
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
fn a_workspace_that_is_scaled_in_mid_run_withholds_the_force() {
    let scaled = json!({ "scale": { "x": 3, "y": 3, "z": 3 } });
    let service = interrupted(move |k| with(frame(k), "/inverse3/0/state/transform", scaled.clone()));
    let mut device = service.open();
    drive_until_withheld(&mut device, true);
    drive_until_withheld(&mut device, false);
}

#[test]
fn a_grip_that_sleeps_withholds_the_force_and_lets_go_of_its_buttons() {
    for status in ["awake", "connected", "ready"] {
        let place = format!("/wireless_verse_grip/0/status/{status}");
        let service = interrupted(move |k| with(frame(k), &place, json!(false)));
        let mut device = service.open();
        let state = drive_until_withheld(&mut device, true);
        assert_eq!(state.buttons, 0, "{status}");
        let state = drive_until_withheld(&mut device, false);
        assert_eq!(state.buttons, 0, "{status}: buttons that are held when it wakes are not pressed");
    }
}

#[test]
fn a_lost_answer_is_told_and_forces_from_before_it_are_not_sent() {
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
fn a_force_is_not_sent_before_the_loop_knows_of_the_gap() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 5).unwrap();
    // A loop that stands still: zeros go out.
    std::thread::sleep(Duration::from_millis(60));
    let before = service.told().len();
    for _ in 0..5 {
        // It does not look, and so does not know.
        device.write(&wrench(DVec3::X * 5.0)).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(service.told()[before..].iter().all(|told| told.force == DVec3::ZERO));
    assert!(device.read().unwrap().withheld, "it must be told");
    device.write(&Wrench::ZERO).unwrap();
    assert!(!drive_until_withheld(&mut device, false).withheld);
}

/// A service that reports `given` of the last commanded force.
fn echoing(given: fn(DVec3) -> DVec3) -> Service {
    let script = move |_| Act::Echo(given);
    Service::usual(script)
}

#[test]
fn a_force_that_is_given_as_told_is_not_counted() {
    let service = echoing(|told| told);
    let mut device = service.open();
    drive(&mut device, 60).unwrap();
    assert_eq!(device.counts().otherwise, 0);
    // A busy machine may have held the loop up meanwhile.
    drive_until_withheld(&mut device, false);
}

#[test]
fn a_force_that_is_not_given_or_another_is_counted_and_withheld() {
    let wrongs: [fn(DVec3) -> DVec3; 3] = [|_| DVec3::ZERO, |told| told * 2.0, |told| -told];
    for wrong in wrongs {
        let service = echoing(wrong);
        let mut device = service.open();
        drive_until_withheld(&mut device, true);
        assert!(device.counts().otherwise > 5, "{:?}", device.counts());
    }
}

#[test]
fn a_force_that_nobody_told_loses_the_device() {
    let service = echoing(|_| DVec3::Z * 2.0);
    let mut device = service.open();
    let lost = drive_until_lost(&mut device);
    assert!(lost.contains("although zero is commanded"), "{lost}");
    assert_eq!(service.told().last().unwrap().force, DVec3::ZERO);
}
