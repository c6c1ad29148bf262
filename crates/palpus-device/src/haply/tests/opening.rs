//! Tests of opening and of searching: which service, arm and grip are accepted,
//! and which notes the device gets.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::super::look::look_at;
use super::super::*;
use super::drive;
use super::service::{Act, Service, frame, inventory, released, with};
use crate::found::FindingState;

#[test]
fn old_service_gets_the_old_force_key() {
    let inventory = with(inventory(), "/inverse3/0/config/device_info/device_type", json!("inverse3")).to_string();
    let service = Service::start(Some("3.4.2"), inventory, |_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 5).unwrap();
    drop(device);
    service.over.recv_timeout(Duration::from_secs(5)).unwrap();
    assert!(service.received().iter().all(|received| received.spelled == "values"));
}

#[test]
fn service_without_version_counts_as_new() {
    let service = Service::start(None, inventory().to_string(), |_| Act::Answer);
    let device = service.open();
    assert!(device.notes()[0].contains("unknown version") && device.notes()[0].contains("`vector`"));
}

#[test]
fn failed_opening_gives_a_reason() {
    let open = |inventory: Value| {
        let service = Service::start(Some("3.5.1"), inventory.to_string(), |_| Act::Answer);
        HaplyDevice::open(&service.options()).err().unwrap().to_string()
    };
    assert!(open(json!({ "inverse3": [] })).contains("no arm: plug one in"));
    assert!(open(with(inventory(), "/inverse3/0/config/basis/permutation", json!("XZY"))).contains("turned by"));
    let scaled = json!({ "scale": { "x": 2, "y": 2, "z": 2 } });
    assert!(open(with(inventory(), "/inverse3/0/config/mount", scaled.clone())).contains("scale"));
    assert!(open(with(inventory(), "/inverse3/0/state/transform", scaled)).contains("scale"));
    let turned = json!({ "rotation": { "w": 0.0, "x": 1.0, "y": 0.0, "z": 0.0 } });
    assert!(open(with(inventory(), "/inverse3/0/state/transform", turned)).contains("turned by"));
    assert!(open(with(inventory(), "/inverse3/0/status/in_use", json!(true))).contains("another program"));
    let mut session = inventory();
    session["session"] = json!({ "config": { "basis": { "permutation": "XZY" } } });
    assert!(open(session).contains("turned by"));
    assert!(open(json!({ "hello": 1 })).contains("does not answer as the Inverse Service does"));
    assert!(open(json!([1, 2])).contains("no list `inverse3`"));
    assert!(open(with(inventory(), "/inverse3/0/status/calibrated", json!(false))).contains("not calibrated"));
    assert!(open(with(inventory(), "/inverse3/0/status/power_supply", json!(false))).contains("without power"));
    let service = Service::usual(|_| Act::Answer);
    let options = HaplyOptions { arm: Some("FFFF".to_owned()), ..service.options() };
    assert!(HaplyDevice::open(&options).err().unwrap().to_string().contains("no arm `FFFF`; it has: 04C3"));
    let service = Service::usual(|_| Act::Silence);
    assert!(HaplyDevice::open(&service.options()).err().unwrap().to_string().contains("does not answer a command"));
}

#[test]
fn other_program_or_scaled_forces_are_refused() {
    let open = |path, answer: Value| {
        let answers = vec![(path, answer)];
        let service = Service::answering(answers, inventory().to_string(), |_| Act::Answer);
        HaplyDevice::open(&service.options()).map(|device| device.notes().join("; ")).map_err(|error| error.to_string())
    };
    assert!(open("/version", json!({ "project_name": "toaster" })).unwrap_err().contains("calls itself `toaster`"));
    assert!(open("/version", json!({ "project_version": "2.1.0" })).unwrap_err().contains("update the service"));
    let scale = "/settings/devices/force_scale";
    let refused = open(scale, json!({ "ok": true, "data": { "value": 0.5 } })).unwrap_err();
    assert!(refused.contains("0.5 times the commanded forces"), "{refused}");
    assert!(!open(scale, json!({ "value": 1.0 })).unwrap().contains("force scale"));
    assert!(open("/nothing", json!({})).unwrap().contains("does not report its force scale"));
}

#[test]
fn only_first_message_names_the_session() {
    let service = Service::usual(|_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 5).unwrap();
    let received = service.received();
    assert_eq!(received[0].session.as_deref(), Some("palpus"));
    assert!(received[1..].iter().all(|received| received.session.is_none()) && received.len() > 2);
}

#[test]
fn settings_of_the_named_session_count() {
    // The inventory has the settings of another profile. In the answer, the arm is in use by this
    // session.
    let scaled = json!({ "position": {}, "scale": { "x": 0.5, "y": 0.5, "z": 0.5 } });
    let scaled = with(inventory(), "/inverse3/0/config/mount", scaled);
    let used = with(inventory(), "/inverse3/0/status/in_use", json!(true));
    let open = |answer: Value| {
        let service = Service::usual(move |_| Act::Say(vec![answer.to_string()]));
        HaplyDevice::open(&service.options()).map(drop).map_err(|error| error.to_string())
    };
    assert!(open(scaled).unwrap_err().contains("scale"));
    assert_eq!(open(used), Ok(()));
}

/// Returns an inventory with two arms, and with two grips in the opposite order.
fn two_arms() -> Value {
    let mut inventory = inventory();
    let mut second = inventory["inverse3"][0].clone();
    second["device_id"] = json!("0001");
    inventory["inverse3"].as_array_mut().unwrap().insert(0, second);
    let mut grip = inventory["wireless_verse_grip"][0].clone();
    grip["device_id"] = json!("2203");
    inventory["wireless_verse_grip"].as_array_mut().unwrap().push(grip);
    inventory["custom_verse_grip"] = json!([]);
    inventory
}

#[test]
fn arm_gets_its_paired_grip() {
    let notes = |answers, inventory: Value| {
        let mut both = frame(0);
        both["wireless_verse_grip"] = inventory["wireless_verse_grip"].clone();
        let say = both.to_string();
        let service = Service::answering(answers, inventory.to_string(), move |_| Act::Say(vec![say.clone()]));
        let device = HaplyDevice::open(&HaplyOptions { arm: Some("04C3".to_owned()), ..service.options() }).unwrap();
        (device.notes().join("; "), device.spec().sensed.rotation)
    };
    // Without a pairing, the second arm gets the second grip.
    let (ordered, _) = notes(vec![], two_arms());
    assert!(ordered.contains("grip 2203") && ordered.contains("no pairing is stated"), "{ordered}");
    let asked = |grip| {
        let pairing = json!({ "inverse_id": "04C3", "verse_grip_id": grip, "attached": true, "force_attached": false });
        vec![("/inverse3/04C3/config/paired_with", json!({ "ok": true, "data": pairing }))]
    };
    let (paired, _) = notes(asked("1102"), two_arms());
    assert!(paired.contains("grip 1102") && paired.contains("paired with it"), "{paired}");
    // The grip of another arm must not replace a missing grip.
    let (missing, rotation) = notes(asked("9999"), two_arms());
    assert!(missing.contains("no grip") && rotation == 0, "{missing}");
    let mut said = two_arms();
    said["wireless_verse_grip"][0]["config"]["paired_with"] = json!("04C3");
    said["wireless_verse_grip"][1]["config"]["paired_with"] = json!("0001");
    let (paired, _) = notes(vec![], said);
    assert!(paired.contains("grip 1102") && paired.contains("paired with it"), "{paired}");
}

#[test]
fn opening_waits_for_the_orientation_of_the_grip() {
    let silent = |count| {
        let mut frame = frame(count);
        for grips in ["wireless_verse_grip", "custom_verse_grip"] {
            frame[grips][0]["state"].as_object_mut().unwrap().remove("orientation");
        }
        frame
    };
    let script = move |count| if count < 5 { Act::Say(vec![silent(count).to_string()]) } else { Act::Answer };
    let mut device = Service::usual(script).open();
    assert!(device.read().unwrap().pose.rotation.y > 0.79);
    let refused = |script: fn(usize) -> Value| {
        let service = Service::usual(move |count| Act::Say(vec![script(count).to_string()]));
        HaplyDevice::open(&service.options()).err().unwrap().to_string()
    };
    assert!(refused(silent).contains("the grip 1102 is not reporting its orientation"));
    let asleep = |count| with(frame(count), "/wireless_verse_grip/0/status/awake", json!(false));
    assert!(refused(asleep).contains("the grip 1102 is asleep"));
}

#[test]
fn buttons_do_not_depend_on_the_first_message() {
    let without = |count| {
        let mut frame = frame(count);
        for grips in ["wireless_verse_grip", "custom_verse_grip"] {
            frame[grips][0]["state"].as_object_mut().unwrap().remove("buttons");
        }
        frame
    };
    let mut late = inventory();
    late["wireless_verse_grip"] = without(0)["wireless_verse_grip"].clone();
    late["custom_verse_grip"] = without(0)["custom_verse_grip"].clone();
    // The buttons are held from the start, then released, then pressed.
    let script = move |count| match count {
        0..10 => Act::Say(vec![without(count).to_string()]),
        10..20 => Act::Answer,
        20..30 => Act::Say(vec![released(count).to_string()]),
        _ => Act::Answer,
    };
    let service = Service::start(Some("3.5.1"), late.to_string(), script);
    let mut device = service.open();
    assert_eq!(device.spec().buttons, 3, "forces must be enabled by a button");
    let mut seen = Vec::new();
    while seen.last() != Some(&0b101) {
        seen.push(device.read().unwrap().buttons);
        device.write(&Wrench::ZERO).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(service.received().len() > 30, "buttons held from the start must not count: {seen:?}");
}

#[test]
fn another_program_at_the_port_is_refused() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let options =
        HaplyOptions { address: format!("ws://{}", listener.local_addr().unwrap()), ..HaplyOptions::default() };
    // The system's queue accepts the connection, but nothing answers.
    let begun = Instant::now();
    assert!(matches!(HaplyDevice::open(&options), Err(HaplyError::NotUnderstood { .. })));
    assert!(begun.elapsed() < Duration::from_secs(5));
    drop(listener);
    assert!(matches!(HaplyDevice::open(&options), Err(HaplyError::NoService { .. })));
}

#[test]
fn arm_without_grip_senses_no_rotation() {
    let without = |count| {
        let mut frame = frame(count);
        frame["wireless_verse_grip"] = json!([]);
        frame["custom_verse_grip"] = json!([]);
        frame.to_string()
    };
    let service = Service::start(Some("3.5.1"), without(0), move |count| Act::Say(vec![without(count)]));
    let mut device = service.open();
    assert_eq!((device.spec().sensed.rotation, device.spec().buttons), (0, 0));
    drive(&mut device, 200).unwrap();
    assert_eq!(device.read().unwrap().pose.rotation, glam::DQuat::IDENTITY);
}

#[test]
fn look_finds_the_arm_or_names_what_is_missing() {
    let service = Service::usual(|_| Act::Answer);
    let found = look_at(&service.options());
    let FindingState::Found { spec, device, note, .. } = found.state else { panic!("{found:?}") };
    assert_eq!((spec.name.as_ref(), device), ("Inverse3", format!("haply:{}", service.address)));
    assert!(note.contains("3.5.1"));
    let nobody = HaplyOptions { address: "ws://127.0.0.1:1".to_owned(), ..HaplyOptions::default() };
    let FindingState::Missing { looked_for, why, mend } = look_at(&nobody).state else { panic!() };
    assert!(looked_for.contains("127.0.0.1:1") && why.contains("refused") && mend.contains("Inverse Service"));
}
