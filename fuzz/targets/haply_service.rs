//! A service that sends arbitrary data to palpus's client over a loopback connection, from the
//! handshake on.
//!
//! The input contains the data after the handshake (the inventory, then a reply to each message)
//! and the reply to a request for the version. The first byte selects whether messages are framed
//! correctly or bytes are sent unchanged, and whether they replace the handshake.
#![no_main]

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

use glam::DVec3;
use palpus::algebra::Wrench;
use palpus_device::{HaplyDevice, HaplyOptions, HapticDevice};
use palpus_fuzz::{Allowance, Bytes, Seed, target};
use tungstenite::handshake::derive_accept_key;

/// Data that the service sends.
#[derive(Default)]
struct Part {
    /// Sends the bytes without frames after the handshake.
    raw: bool,
    /// Sends the bytes without frames instead of the handshake.
    bare: bool,
    version: Vec<u8>,
    says: Vec<Vec<u8>>,
}

/// The address of the service and its script, which changes with each input.
struct Service {
    address: String,
    part: Mutex<Arc<Part>>,
}

fn service() -> &'static Service {
    static SERVICE: OnceLock<Service> = OnceLock::new();
    SERVICE.get_or_init(|| {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = format!("ws://{}", listener.local_addr().expect("an address"));
        let (send, connections) = channel();
        // One thread accepts connections and replies to requests for the version; the other thread
        // handles the WebSocket.
        std::thread::spawn(move || {
            while let Ok((mut stream, _)) = listener.accept() {
                let _ = stream.set_nodelay(true);
                let _ = stream.set_read_timeout(Some(Duration::from_secs(1)));
                let Ok(head) = head_of(&mut stream) else { continue };
                let part = Arc::clone(&service().part.lock().expect("no panic"));
                if ["GET /version", "GET /settings", "GET /inverse3"].iter().any(|asked| head.starts_with(asked)) {
                    let _ = stream.write_all(&part.version);
                } else {
                    let _ = send.send((stream, head, part));
                }
            }
        });
        std::thread::spawn(move || talk_to_all(&connections));
        Service { address, part: Mutex::default() }
    })
}

fn talk_to_all(connections: &Receiver<(TcpStream, String, Arc<Part>)>) {
    while let Ok((mut stream, head, part)) = connections.recv() {
        // Errors are ignored, because the client may have closed the connection.
        let _ = talk(&mut stream, &head, &part);
    }
}

/// Handles one connection, from the handshake to the last reply.
fn talk(stream: &mut TcpStream, head: &str, part: &Part) -> std::io::Result<()> {
    if part.bare {
        return stream.write_all(&part.says.concat());
    }
    let key = head.lines().find_map(|line| line.strip_prefix("Sec-WebSocket-Key: ")).unwrap_or_default();
    let accept = derive_accept_key(key.trim().as_bytes());
    let answer =
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: ";
    stream.write_all(format!("{answer}{accept}\r\n\r\n").as_bytes())?;
    if part.raw {
        stream.write_all(&part.says.concat())?;
        return stream.shutdown(Shutdown::Write);
    }
    for text in &part.says {
        stream.write_all(&framed(text))?;
        let mut message = [0; 4096];
        if stream.read(&mut message)? == 0 {
            return Ok(());
        }
    }
    Ok(())
}

/// Reads up to the empty line.
fn head_of(stream: &mut TcpStream) -> std::io::Result<String> {
    let (mut head, mut some) = (Vec::new(), [0; 1024]);
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        match stream.read(&mut some)? {
            0 => break,
            length => head.extend(&some[..length]),
        }
    }
    Ok(String::from_utf8_lossy(&head).into_owned())
}

/// Returns a text message.
fn framed(text: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x81];
    match text.len() {
        length @ 0..126 => frame.push(length as u8),
        length => {
            frame.push(126);
            frame.extend((length as u16).to_be_bytes());
        }
    }
    frame.extend(text);
    frame
}

fn run(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let flags = bytes.byte();
    let length = usize::from(bytes.byte());
    let version = bytes.take(length).to_vec();
    let says: Vec<Vec<u8>> = if flags & 3 == 0 {
        bytes.rest().split(|&byte| byte == 0).take(8).map(<[u8]>::to_vec).collect()
    } else {
        vec![bytes.rest().to_vec()]
    };
    let service = service();
    *service.part.lock().expect("no panic") =
        Arc::new(Part { raw: flags & 1 != 0, bare: flags & 2 != 0, version, says });
    let options = HaplyOptions { address: service.address.clone(), ..HaplyOptions::default() };
    match HaplyDevice::open(&options) {
        Ok(mut device) => {
            for _ in 0..4 {
                let Ok(state) = device.read() else { break };
                assert!(state.pose.is_valid() && state.twist.linear.is_finite() && state.twist.angular.is_finite());
                let _ = device.write(&Wrench { force: DVec3::X, torque: DVec3::ZERO });
                std::thread::sleep(Duration::from_micros(100));
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
}

fn seeds() -> Vec<Seed> {
    let state = r#"{"inverse3":[{"device_id":"A","config":{"type":"inverse3"},"state":{"cursor_position":{"x":0,"y":0,"z":0.1},"cursor_velocity":{"x":0,"y":0,"z":0}},"status":{"ready":true}}],"verse_grip":[{"device_id":"G","state":{"orientation":{"w":1,"x":0,"y":0,"z":0},"buttons":{"a":true}}}]}"#;
    let version = b"HTTP/1.1 200 OK\r\n\r\n{\"project_version\":\"3.4.9\"}";
    let good = [&[0, version.len() as u8][..], version, [state; 5].join("\0").as_bytes()].concat();
    let raw = [&[1, 0][..], &framed(state.as_bytes()), &[0x89, 0, 0x82, 1, 7, 0x88, 2, 3, 0xe8]].concat();
    let bare = b"\x02\0HTTP/1.1 200 OK\r\nUpgrade: none\r\n\r\n{}".to_vec();
    vec![("good".to_owned(), good), ("raw".to_owned(), raw), ("bare".to_owned(), bare)]
}

// The memory contains the buffers of the client and a message of at most one megabyte.
target!(run: run, allowance: Allowance { per_byte: 400, always: 16 << 20 }, seeds: seeds);
