//! Faults that pass, and faults that lose the device for good.

use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Wrench;
use serde_json::json;

use super::super::*;
use super::service::{Act, Service, Told, frame, inventory, with};
use super::{assert_no_force_twice, drive, drive_until_lost};

/// A name or a reason, and what the service does.
type Case = (&'static str, fn() -> Act);

/// A single failure at message 20, after which the service behaves well.
fn goes_wrong(wrong: fn() -> Act) -> Vec<Told> {
    let service = Service::usual(move |count| if count == 20 { wrong() } else { Act::Answer });
    let mut device = service.open();
    drive(&mut device, 120).unwrap();
    drop(device);
    service.over.recv_timeout(Duration::from_secs(5)).unwrap();
    service.told()
}

#[test]
fn after_a_lost_answer_no_force_goes_out_that_does_not_know_a_newer_state() {
    let wrongs: [Case; 7] = [
        ("silence", || Act::Silence),
        ("late", || Act::After(Duration::from_millis(80))),
        ("no JSON", || Act::Say(vec!["{\"inverse3\": [".to_owned()])),
        ("no arm", || Act::Say(vec![json!({ "inverse3": [] }).to_string()])),
        ("text for a number", || {
            Act::Say(vec![with(frame(20), "/inverse3/0/state/cursor_position/x", json!("0.01")).to_string()])
        }),
        ("an empty position", || {
            Act::Say(vec![with(frame(20), "/inverse3/0/state/cursor_position", json!({})).to_string()])
        }),
        ("a number beyond numbers", || Act::Say(vec![frame(20).to_string().replace("0.25", "1e999")])),
    ];
    for (name, wrong) in wrongs {
        let commands = goes_wrong(wrong);
        assert_no_force_twice(&commands);
        assert_eq!(commands[21].force, DVec3::ZERO, "{name}: the message after must carry no force");
        assert!(
            commands[22..].iter().any(|command| command.force.x == 1.0),
            "{name}: it must come back with newer states"
        );
    }
}

#[test]
fn what_does_not_come_back_is_lost_and_says_why() {
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
        ("pings without end", pings),
        ("no state for 250 ms", || Act::Silence),
        ("no JSON", || Act::Say(vec!["hello".to_owned()])),
        ("without the arm 04C3", || Act::Say(vec![json!({ "inverse3": [{ "device_id": "0001" }] }).to_string()])),
        ("gone", || Act::Drop),
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
        assert!(matches!(wrote, Err(DeviceError::Lost(_))), "{why}: it must stay lost");
        assert_no_force_twice(&service.told());
    }
}

#[test]
fn an_arm_that_is_not_ready_any_more_gets_no_force() {
    let unready = || with(inventory(), "/inverse3/0/status/ready", json!(false)).to_string();
    let service = Service::usual(move |count| if count >= 20 { Act::Say(vec![unready()]) } else { Act::Answer });
    let mut device = service.open();
    drive(&mut device, 60).unwrap();
    assert!(service.told()[22..].iter().all(|command| command.force == DVec3::ZERO));
}
