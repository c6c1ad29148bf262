//! The client against scripted services, some of which misbehave.

use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glam::DVec3;
use palpus::algebra::Wrench;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use super::look::look_at;
use super::*;
use crate::found::FindingState;

/// A message as the service got it.
#[derive(Clone, Debug)]
struct Told {
    force: DVec3,
    spelled: String,
}

/// What a scripted service does with message `k` (0 is the one of opening).
enum Act {
    /// Answers as it should.
    Answer,
    /// Answers with these texts.
    Say(Vec<String>),
    /// Answers so much later.
    After(Duration),
    Silence,
    /// Answers with bytes.
    Binary,
    /// Answers with nothing but pings.
    Pings,
    /// Breaks the connection off.
    Drop,
    /// Closes it politely.
    Close,
}

/// A name or a reason, and what the service does.
type Case = (&'static str, fn() -> Act);

struct Service {
    address: String,
    told: Arc<Mutex<Vec<Told>>>,
    /// Said once the connection is over.
    over: Receiver<()>,
}

impl Service {
    /// A service that says `inventory`, has this version, and acts by `script` with the number of the message.
    fn start(version: Option<&'static str>, inventory: String, script: impl Fn(usize) -> Act + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("ws://{}", listener.local_addr().unwrap());
        let told = Arc::new(Mutex::new(Vec::new()));
        let (done, over) = channel();
        let log = Arc::clone(&told);
        std::thread::spawn(move || serve(&listener, version, &inventory, &script, &log, &done));
        Self { address, told, over }
    }

    /// One that behaves but for `script`.
    fn usual(script: impl Fn(usize) -> Act + Send + 'static) -> Self {
        Self::start(Some("3.5.1"), inventory().to_string(), script)
    }

    fn options(&self) -> HaplyOptions {
        HaplyOptions { address: self.address.clone(), ..HaplyOptions::default() }
    }

    fn open(&self) -> HaplyDevice {
        HaplyDevice::open(&self.options()).unwrap()
    }

    fn told(&self) -> Vec<Told> {
        self.told.lock().unwrap().clone()
    }
}

fn serve(
    listener: &TcpListener,
    version: Option<&str>,
    inventory: &str,
    script: &dyn Fn(usize) -> Act,
    told: &Mutex<Vec<Told>>,
    done: &Sender<()>,
) {
    let (stream, _) = listener.accept().unwrap();
    stream.set_nodelay(true).unwrap();
    let Ok(mut socket) = tungstenite::accept(stream) else { return };
    let _ = socket.send(Message::text(inventory));
    if let Some(version) = version {
        // In a thread of its own, as long as the test lasts.
        let (listener, version) = (listener.try_clone().unwrap(), version.to_owned());
        std::thread::spawn(move || answer_version(&listener, &version));
    }
    let mut count = 0;
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => {
                told.lock().unwrap().push(understood(text.as_str()));
                if !act(&mut socket, script(count), count) {
                    break;
                }
                count += 1;
            }
            Ok(_) => {}
            Err(_) => break,
        }
    }
    let _ = done.send(());
}

fn answer_version(listener: &TcpListener, version: &str) {
    use std::io::{Read, Write};
    while let Ok((mut stream, _)) = listener.accept() {
        let mut request = [0; 1024];
        let _ = stream.read(&mut request);
        let body = json!({ "project_version": version }).to_string();
        let head = format!("HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
        let _ = stream.write_all(format!("{head}{body}").as_bytes());
    }
}

/// False when the connection is over.
fn act(socket: &mut WebSocket<TcpStream>, act: Act, count: usize) -> bool {
    let texts = match act {
        Act::Answer => vec![frame(count).to_string()],
        Act::Say(texts) => texts,
        Act::After(pause) => {
            std::thread::sleep(pause);
            vec![frame(count).to_string()]
        }
        Act::Silence => Vec::new(),
        Act::Binary => return socket.send(Message::binary(vec![1, 2, 3])).is_ok(),
        Act::Pings => return (0..200).all(|_| socket.send(Message::Ping(Vec::new().into())).is_ok()),
        Act::Drop => return false,
        Act::Close => {
            let _ = socket.close(None);
            let _ = socket.flush();
            return false;
        }
    };
    texts.into_iter().all(|text| socket.send(Message::text(text)).is_ok())
}

/// The force of a message, which must be the message that it should be.
fn understood(text: &str) -> Told {
    let value: Value = serde_json::from_str(text).unwrap();
    assert_eq!(value["inverse3"][0]["device_id"], "04C3");
    let command = value["inverse3"][0]["commands"]["set_cursor_force"].as_object().unwrap();
    assert_eq!(command.len(), 1);
    let (spelled, vector) = command.iter().next().unwrap();
    let part = |key: &str| vector[key].as_f64().unwrap();
    Told { force: DVec3::new(part("x"), part("y"), part("z")), spelled: spelled.clone() }
}

/// The first message: a state with the configurations.
fn inventory() -> Value {
    let mut inventory = frame(0);
    inventory["inverse3"][0]["config"] = json!({
        "type": "inverse3",
        "device_info": {
            "id": "04C3", "device_type": 4, "major_version": 7, "minor_version": 1, "uuid": "9AB19C4B5E655E32B4F00F8A59FD04C3"
        },
        "port": "COM15",
        "extended_device_id": "9AB19C4B5E655E32B4F00F8A59FD04C3",
        "extended_firmware_version": "8C20FDC8010AA1E15AA133CDA2534874",
        "gravity_compensation": { "enabled": true, "scaling_factor": 0.75 },
        "handedness": "right",
        "torque_scaling": { "enabled": true },
        "filters": { "force_gate": { "gain": 0.3 }, "damping": { "scalar": 0.0 } },
        "mount": {},
        "basis": { "permutation": "XYZ" }
    });
    inventory["wireless_verse_grip"][0]["config"] = json!({
        "port": "COM12", "type": "wireless_verse_grip", "major_version": 1, "minor_version": 4, "hardware_version": 1
    });
    inventory
}

/// A state; the arm's height counts messages in millimetres.
fn frame(count: usize) -> Value {
    json!({
        "session_id": 3,
        "inverse3": [{
            "device_id": "04C3",
            "state": {
                "angular_position": { "a0": -89.66, "a1": 122.81, "a2": -22.78 },
                "body_orientation": { "w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0 },
                "cursor_position": { "x": 0.01, "y": -0.1, "z": 1e-3 * count as f64 },
                "cursor_velocity": { "x": 0, "y": 0.25, "z": -0.5 },
                "mode": "idle",
                "transform": {}
            },
            "status": { "calibrated": true, "in_use": false, "power_supply": true, "ready": true, "started": true }
        }],
        "verse_grip": [],
        "wireless_verse_grip": [{
            "device_id": "1102",
            "state": {
                "battery_level": 0.8,
                "hall": 16,
                "orientation": { "w": 0.6, "x": 0.0, "y": 0.8, "z": 0.0 },
                "buttons": { "a": true, "b": false, "c": false }
            },
            "status": { "connected": true, "awake": true, "ready": true }
        }],
        "custom_verse_grip": [{
            "device_id": "1102",
            "state": {
                "orientation": { "w": 0.6, "x": 0.0, "y": 0.8, "z": 0.0 },
                "buttons": { "a": false, "b": false, "c": true },
                "extension_data": [1, 2]
            },
            "status": { "connected": true, "awake": true, "ready": true }
        }]
    })
}

/// A message with one place changed.
fn with(mut message: Value, pointer: &str, value: Value) -> Value {
    *message.pointer_mut(pointer).unwrap() = value;
    message
}

fn wrench(force: DVec3) -> Wrench {
    Wrench { torque: DVec3::ZERO, force }
}

/// Drives `device` at about 500 Hz as a loop would, with forces of which no two are the same, for `ticks` or until it fails.
fn drive(device: &mut HaplyDevice, ticks: u32) -> Result<(), DeviceError> {
    for _ in 0..ticks {
        device.read()?;
        device.write(&wrench(DVec3::new(1.0, 0.0, 1e-3 * device.serial as f64)))?;
        std::thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}

/// Drives until it fails, for at most five seconds, and tells why.
fn drive_until_lost(device: &mut HaplyDevice) -> String {
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(5) {
        match drive(device, 1) {
            Ok(()) => {}
            Err(DeviceError::Lost(why)) => return why.into_owned(),
            Err(other) => panic!("{other}"),
        }
    }
    panic!("it is still not lost: {:?}", device.counts());
}

/// Every force that went out did so once.
fn assert_no_force_twice(told: &[Told]) {
    let mut seen = Vec::new();
    for Told { force, .. } in told.iter().filter(|told| told.force != DVec3::ZERO) {
        assert!(!seen.contains(force), "{force} was sent twice");
        seen.push(*force);
    }
}

#[test]
fn a_state_comes_in_and_a_force_goes_out() {
    let service = Service::usual(|_| Act::Answer);
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

/// What goes wrong once, at message 20, after which the service behaves.
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
        let told = goes_wrong(wrong);
        assert_no_force_twice(&told);
        assert_eq!(told[21].force, DVec3::ZERO, "{name}: the message after must carry no force");
        assert!(told[22..].iter().any(|told| told.force.x == 1.0), "{name}: it must come back with newer states");
    }
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
        ("nobody asked for", flood),
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
    assert!(service.told()[22..].iter().all(|told| told.force == DVec3::ZERO));
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

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

const MUTATION_SEED: u64 = 0x4a91_7e55;

#[test]
fn no_message_makes_it_panic_or_believe_in_no_number() {
    let mut random = Random(MUTATION_SEED);
    let texts = [inventory().to_string(), frame(7).to_string()];
    let pieces =
        ["1e999", "-1e308", "null", "{}", "[]", "\"", "{", "}", "true", "1e-320", "\\ud800", "NaN", ",", "0.5"];
    let mut understood = 0;
    for round in 0..20_000 {
        let mut text = texts[round % 2].clone().into_bytes();
        for _ in 0..=random.below(3) {
            let at = random.below(text.len());
            let until = (at + random.below(12)).min(text.len());
            text.splice(at..until, pieces[random.below(pieces.len())].bytes());
        }
        let text = String::from_utf8_lossy(&text);
        let _ = message::inventory(&text);
        if let Ok(sample) = message::sample(&text, "04C3", Some("1102")) {
            let turned = sample.rotation.is_none_or(|rotation| (rotation.length() - 1.0).abs() < 1e-9);
            assert!(
                sample.position.is_finite() && sample.velocity.is_finite() && turned,
                "seed {MUTATION_SEED:#x}, round {round}: {text}"
            );
            understood += 1;
        }
    }
    assert!(understood > 1000, "seed {MUTATION_SEED:#x}: only {understood} were understood at all");
}

const MISCHIEF_SEED: u64 = 0x11ae_57a1;
/// Messages of a service that is up to mischief.
const MISCHIEFS: usize = 700;

/// What a message is answered with: mostly as it should be.
fn mischief() -> Vec<u8> {
    let mut random = Random(MISCHIEF_SEED);
    // Opening goes well.
    (0..MISCHIEFS).map(|k| if k < 5 { 255 } else { random.below(64) as u8 }).collect()
}

#[test]
fn whatever_the_service_does_no_force_is_stale() {
    let acts = mischief();
    let script = acts.clone();
    let service = Service::usual(move |count| match script.get(count) {
        Some(0) => Act::Silence,
        Some(1) => Act::After(Duration::from_millis(11)),
        Some(2) => Act::Say(vec!["nonsense".to_owned()]),
        Some(3) => Act::Say(vec![json!({ "inverse3": [] }).to_string()]),
        Some(4..7) => Act::Say(vec![frame(count).to_string(), frame(count).to_string()]),
        Some(7) => Act::Say(vec![frame(count).to_string(), "nonsense".to_owned()]),
        Some(8) => Act::Binary,
        _ => Act::Answer,
    });
    let mut device = service.open();
    while service.told.lock().unwrap().len() < MISCHIEFS {
        // The force says which state it knows.
        let state = device.read().unwrap();
        device.write(&wrench(DVec3::new(1.0, state.pose.translation.z, 1e-3 * device.serial as f64))).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    let counts = device.counts();
    let told = service.told();
    assert_no_force_twice(&told);
    let mut pushed = 0;
    for (k, told) in told.iter().enumerate().take(MISCHIEFS).filter(|(_, told)| told.force != DVec3::ZERO) {
        let knows = (told.force.y * 1e3).round() as usize;
        assert!(knows < k && k - knows <= 3, "seed {MISCHIEF_SEED:#x}: message {k} knows only state {knows}");
        // Where the answer before came twice, its second frame is all that a client can see in place of the lost one.
        let is_seen = |lost: &usize| !matches!(acts[lost - 1], 4..8);
        let lost = (5..k).rev().filter(|&k| matches!(acts[k], 0 | 2 | 3 | 8)).find(is_seen);
        assert!(
            lost.is_none_or(|lost| knows > lost),
            "seed {MISCHIEF_SEED:#x}: message {k} knows state {knows}, answer {lost:?} was lost"
        );
        pushed += 1;
    }
    assert!(pushed > MISCHIEFS / 4 && counts.late + counts.bad > 5, "{pushed} forces, {counts:?}");
}
