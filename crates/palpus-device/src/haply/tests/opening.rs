//! What is said of a service, its arm and its grip when it is opened, or looked for.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::super::look::look_at;
use super::super::*;
use super::drive;
use super::service::{Act, Service, frame, inventory, with};
use crate::found::FindingState;

#[test]
fn an_old_service_gets_the_old_spelling() {
    let inventory = with(inventory(), "/inverse3/0/config/device_info/device_type", json!("inverse3")).to_string();
    let service = Service::start(Some("3.4.2"), inventory, |_| Act::Answer);
    let mut device = service.open();
    drive(&mut device, 5).unwrap();
    drop(device);
    service.over.recv_timeout(Duration::from_secs(5)).unwrap();
    assert!(service.told().iter().all(|told| told.spelled == "values"));
}

#[test]
fn a_service_that_does_not_say_its_version_is_taken_for_a_new_one() {
    let service = Service::start(None, inventory().to_string(), |_| Act::Answer);
    let device = service.open();
    assert!(device.notes()[0].contains("unknown version") && device.notes()[0].contains("`vector`"));
}

#[test]
fn what_cannot_be_opened_says_why() {
    let open = |inventory: Value| {
        let service = Service::start(Some("3.5.1"), inventory.to_string(), |_| Act::Answer);
        HaplyDevice::open(&service.options()).err().unwrap().to_string()
    };
    assert!(open(json!({ "inverse3": [] })).contains("no arm: plug one in"));
    let turned =
        message::inventory(&with(inventory(), "/inverse3/0/config/basis/permutation", json!("XZY")).to_string());
    assert!(turned.unwrap().arms[0].notes.join("").contains("turns the axes"));
    assert!(open(json!({ "hello": 1 })).contains("not as the Inverse Service does"));
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
fn a_port_where_something_else_listens_is_no_service() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let options =
        HaplyOptions { address: format!("ws://{}", listener.local_addr().unwrap()), ..HaplyOptions::default() };
    // It accepts, by the system's queue, and says nothing.
    let begun = Instant::now();
    assert!(matches!(HaplyDevice::open(&options), Err(HaplyError::NotUnderstood { .. })));
    assert!(begun.elapsed() < Duration::from_secs(5));
    drop(listener);
    assert!(matches!(HaplyDevice::open(&options), Err(HaplyError::NoService { .. })));
}

#[test]
fn an_arm_without_a_grip_senses_no_rotation() {
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
fn it_is_found_or_said_what_is_missing() {
    let service = Service::usual(|_| Act::Answer);
    let found = look_at(&service.options());
    let FindingState::Found { spec, device, note, .. } = found.state else { panic!("{found:?}") };
    assert_eq!((spec.name.as_ref(), device), ("Inverse3", format!("haply:{}", service.address)));
    assert!(note.contains("3.5.1"));
    let nobody = HaplyOptions { address: "ws://127.0.0.1:1".to_owned(), ..HaplyOptions::default() };
    let FindingState::Missing { looked_for, why, mend } = look_at(&nobody).state else { panic!() };
    assert!(looked_for.contains("127.0.0.1:1") && why.contains("refused") && mend.contains("Inverse Service"));
}
