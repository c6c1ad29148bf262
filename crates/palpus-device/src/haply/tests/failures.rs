//! Tests of faults from which the client recovers, and of faults that lose the device.

use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Wrench;
use serde_json::json;

use super::super::*;
use super::service::{Act, Received, Service, frame, inventory, with};
use super::{assert_no_force_twice, drive, drive_until_lost};

/// A name or an expected reason, and the action of the service.
type Case = (&'static str, fn() -> Act);

/// Runs a service that fails once, at message 20. Returns the messages that the service received.
fn goes_wrong(wrong: fn() -> Act) -> Vec<Received> {
    let service = Service::usual(move |count| if count == 20 { wrong() } else { Act::Answer });
    let mut device = service.open();
    drive(&mut device, 120).unwrap();
    drop(device);
    service.over.recv_timeout(Duration::from_secs(5)).unwrap();
    service.received()
}

#[test]
fn forces_after_a_lost_answer_need_a_newer_state() {
    let wrongs: [Case; 7] = [
        ("silence", || Act::Silence),
        ("late", || Act::After(Duration::from_millis(80))),
        ("invalid JSON", || Act::Say(vec!["{\"inverse3\": [".to_owned()])),
        ("no arm", || Act::Say(vec![json!({ "inverse3": [] }).to_string()])),
        ("a string for a number", || {
            Act::Say(vec![with(frame(20), "/inverse3/0/state/cursor_position/x", json!("0.01")).to_string()])
        }),
        ("an empty position", || {
            Act::Say(vec![with(frame(20), "/inverse3/0/state/cursor_position", json!({})).to_string()])
        }),
        ("a number that overflows", || Act::Say(vec![frame(20).to_string().replace("0.25", "1e999")])),
    ];
    for (name, wrong) in wrongs {
        let commands = goes_wrong(wrong);
        assert_no_force_twice(&commands);
        assert_eq!(commands[21].force, DVec3::ZERO, "{name}: the next message must command zero");
        assert!(
            commands[22..].iter().any(|command| command.force.x == 1.0),
            "{name}: the force must return with newer states"
        );
    }
}

#[test]
fn lasting_failure_loses_the_device_with_a_reason() {
    let huge = || Act::Say(vec![format!("\"{}\"", "x".repeat(2 << 20))]);
    let flood = || Act::Say(vec!["{}".to_owned(); 500]);
    let no_grip = || {
        let mut frame = frame(20);
        frame["wireless_verse_grip"] = json!([]);
        frame["custom_verse_grip"] = json!([]);
        Act::Say(vec![frame.to_string()])
    };
    let binary = || Act::Binary;
    let pings = || Act::Pings;
    let cases: [Case; 10] = [
        ("a binary message", binary),
        ("too many pings", pings),
        ("no state for 250 ms", || Act::Silence),
        ("not JSON", || Act::Say(vec!["hello".to_owned()])),
        ("without the arm 04C3", || Act::Say(vec![json!({ "inverse3": [{ "device_id": "0001" }] }).to_string()])),
        ("is lost", || Act::Drop),
        ("closed the connection", || Act::Close),
        ("more than 1024 kB", huge),
        ("unrequested messages", flood),
        ("the grip 1102", no_grip),
    ];
    for (why, wrong) in cases {
        let service = Service::usual(move |count| if count >= 20 { wrong() } else { Act::Answer });
        let mut device = service.open();
        let lost = drive_until_lost(&mut device);
        assert!(lost.contains(why), "{why}: {lost}");
        assert!(lost.contains("start the run again"), "{lost}");
        let wrote = device.write(&Wrench::ZERO);
        assert!(matches!(wrote, Err(DeviceError::Lost(_))), "{why}: the device must stay lost");
        assert_no_force_twice(&service.received());
    }
}

#[test]
fn arm_that_becomes_unready_gets_no_force() {
    let unready = || with(inventory(), "/inverse3/0/status/ready", json!(false)).to_string();
    let service = Service::usual(move |count| if count >= 20 { Act::Say(vec![unready()]) } else { Act::Answer });
    let mut device = service.open();
    drive(&mut device, 60).unwrap();
    assert!(service.received()[22..].iter().all(|command| command.force == DVec3::ZERO));
}
