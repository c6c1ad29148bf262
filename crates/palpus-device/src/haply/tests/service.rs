//! A scripted service, which can misbehave.

use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use super::super::{HaplyDevice, HaplyOptions};

/// A message that the service received.
#[derive(Clone, Debug)]
pub(super) struct Received {
    pub(super) at: Instant,
    pub(super) force: DVec3,
    pub(super) spelled: String,
    /// Name of the session, if the message contains it.
    pub(super) session: Option<String>,
}

/// Action of a scripted service in response to a message.
pub(super) enum Act {
    /// Answers correctly.
    Answer,
    /// Answers with these texts.
    Say(Vec<String>),
    /// Answers correctly after this time.
    After(Duration),
    /// Answers correctly, and reports the force that this function returns for the commanded force.
    Echo(fn(DVec3) -> DVec3),
    Silence,
    /// Answers with a binary message.
    Binary,
    /// Answers with pings only.
    Pings,
    /// Drops the connection.
    Drop,
    /// Closes the connection with a handshake.
    Close,
}

pub(super) struct Service {
    pub(super) address: String,
    pub(super) received: Arc<Mutex<Vec<Received>>>,
    /// Gets a message when the connection is over.
    pub(super) over: Receiver<()>,
}

impl Service {
    /// Starts a service with this `version` and `inventory`. `script` gives its action for each
    /// message, counted from 0.
    pub(super) fn start(
        version: Option<&'static str>,
        inventory: String,
        script: impl Fn(usize) -> Act + Send + 'static,
    ) -> Self {
        let version = version.map(|version| ("/version", json!({ "project_version": version })));
        Self::answering(version.into_iter().collect(), inventory, script)
    }

    /// Starts a service that answers requests of these paths over HTTP.
    pub(super) fn answering(
        answers: Vec<(&'static str, Value)>,
        inventory: String,
        script: impl Fn(usize) -> Act + Send + 'static,
    ) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("ws://{}", listener.local_addr().unwrap());
        let received = Arc::new(Mutex::new(Vec::new()));
        let (done, over) = channel();
        let log = Arc::clone(&received);
        std::thread::spawn(move || serve(&listener, answers, &inventory, &script, &log, &done));
        Self { address, received, over }
    }

    /// Starts a service that follows `script` and is correct otherwise.
    pub(super) fn usual(script: impl Fn(usize) -> Act + Send + 'static) -> Self {
        Self::start(Some("3.5.1"), inventory().to_string(), script)
    }

    pub(super) fn options(&self) -> HaplyOptions {
        HaplyOptions { address: self.address.clone(), ..HaplyOptions::default() }
    }

    pub(super) fn open(&self) -> HaplyDevice {
        HaplyDevice::open(&self.options()).unwrap()
    }

    pub(super) fn received(&self) -> Vec<Received> {
        self.received.lock().unwrap().clone()
    }
}

fn serve(
    listener: &TcpListener,
    answers: Vec<(&'static str, Value)>,
    inventory: &str,
    script: &dyn Fn(usize) -> Act,
    received: &Mutex<Vec<Received>>,
    done: &Sender<()>,
) {
    let (stream, _) = listener.accept().unwrap();
    stream.set_nodelay(true).unwrap();
    let Ok(mut socket) = tungstenite::accept(stream) else { return };
    let _ = socket.send(Message::text(inventory));
    // HTTP requests are answered in a separate thread, as long as the test lasts.
    let questions = listener.try_clone().unwrap();
    std::thread::spawn(move || answer_questions(&questions, &answers));
    let mut count = 0;
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => {
                let heard = understood(text.as_str());
                let force = heard.force;
                received.lock().unwrap().push(heard);
                if !act(&mut socket, script(count), count, force) {
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

fn answer_questions(listener: &TcpListener, answers: &[(&str, Value)]) {
    use std::io::{Read, Write};
    while let Ok((mut stream, _)) = listener.accept() {
        let mut request = [0; 1024];
        let read = stream.read(&mut request).unwrap_or(0);
        let asked = String::from_utf8_lossy(&request[..read]).split(' ').nth(1).unwrap_or_default().to_owned();
        let answer = answers.iter().find(|(path, _)| *path == asked).map(|(_, answer)| answer.to_string());
        let (status, body) = answer.map_or(("404 Not Found", "{}".to_owned()), |body| ("200 OK", body));
        let head = format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
        let _ = stream.write_all(format!("{head}{body}").as_bytes());
    }
}

/// Performs an action. Returns false if the connection is over.
fn act(socket: &mut WebSocket<TcpStream>, act: Act, count: usize, force: DVec3) -> bool {
    let texts = match act {
        Act::Answer => vec![frame(count).to_string()],
        Act::Say(texts) => texts,
        Act::After(pause) => {
            std::thread::sleep(pause);
            vec![frame(count).to_string()]
        }
        Act::Echo(given) => {
            let DVec3 { x, y, z } = given(force);
            let mut frame = frame(count);
            frame["inverse3"][0]["state"]["current_cursor_force"] = json!({ "x": x, "y": y, "z": z });
            vec![frame.to_string()]
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

/// Parses a message of the client, and checks its form.
fn understood(text: &str) -> Received {
    let value: Value = serde_json::from_str(text).unwrap();
    assert_eq!(value["inverse3"][0]["device_id"], "04C3");
    let command = value["inverse3"][0]["commands"]["set_cursor_force"].as_object().unwrap();
    assert_eq!(command.len(), 1);
    let (spelled, vector) = command.iter().next().unwrap();
    let part = |key: &str| vector[key].as_f64().unwrap();
    let session = value["session"]["configure"]["profile"]["name"].as_str().map(str::to_owned);
    Received {
        at: Instant::now(),
        force: DVec3::new(part("x"), part("y"), part("z")),
        spelled: spelled.clone(),
        session,
    }
}

/// Returns the first message of the service: a state with the configurations.
pub(super) fn inventory() -> Value {
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

/// Returns a state. The arm's z is 1 mm times the number of messages.
pub(super) fn frame(count: usize) -> Value {
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

/// Returns a state with no button pressed.
pub(super) fn released(count: usize) -> Value {
    let frame = with(frame(count), "/wireless_verse_grip/0/state/buttons/a", json!(false));
    with(frame, "/custom_verse_grip/0/state/buttons/c", json!(false))
}

/// Returns `message` with one value replaced.
pub(super) fn with(mut message: Value, pointer: &str, value: Value) -> Value {
    *message.pointer_mut(pointer).unwrap() = value;
    message
}
