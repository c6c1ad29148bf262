//! A session with a driver: the handshake, and the numbering of sent frames.

use std::borrow::Cow;
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use super::frame::{self, Body, Command, Frame, LONGEST, State, Welcome};
use super::socket::{Received, Socket};
use super::{BridgeAddress, BridgeError};

/// Time limit of a receive. A thread checks this often whether it must end.
pub(super) const PATIENCE: Duration = Duration::from_millis(5);
/// Time limit for the welcome, and for the first state.
const FIRST_ANSWER: Duration = Duration::from_secs(1);
/// A hello or first command without an answer is sent again after this time.
const AGAIN: Duration = Duration::from_millis(50);

/// Larger than any frame, so that a frame that is too long is detected.
pub(super) type Buffer = [u8; LONGEST + 64];
/// An empty buffer.
pub(super) const BUFFER: Buffer = [0; LONGEST + 64];

/// An open session.
#[derive(Debug)]
pub(super) struct Session {
    pub(super) socket: Socket,
    pub(super) nonce: u64,
    sent: AtomicU64,
}

impl Session {
    /// Connects and performs the handshake. The session has no states yet.
    pub(super) fn open(address: &BridgeAddress, rate_hz: f64) -> Result<(Self, Welcome), BridgeError> {
        let nobody = |error: io::Error| BridgeError::NoDriver { address: address.to_string(), why: error.to_string() };
        let socket = Socket::connect(address, PATIENCE).map_err(nobody)?;
        let welcome = handshake(&socket, new_nonce(), rate_hz, address)?;
        Ok((Self { socket, nonce: welcome.session, sent: AtomicU64::new(0) }, welcome))
    }

    /// Returns the number of the next frame, and counts it.
    pub(super) fn next(&self) -> u64 {
        self.sent.fetch_add(1, Ordering::SeqCst) + 1
    }

    /// Sends `body` as frame number `sequence`. Returns false if the queue is full.
    pub(super) fn send(&self, sequence: u64, body: Body) -> io::Result<bool> {
        let mut buffer = [0; LONGEST];
        self.socket.send(frame::encode(&Frame { nonce: self.nonce, sequence, body }, &mut buffer))
    }

    /// Sends a command as the next frame.
    pub(super) fn command(&self, command: Command) -> io::Result<bool> {
        self.send(self.next(), Body::Command(command))
    }

    /// Starts the driver's states: sends commands without a wrench until the first state arrives.
    /// Returns the state's sequence and the state.
    pub(super) fn begin(&self, address: &BridgeAddress) -> Result<(u64, State), BridgeError> {
        let send = || self.command(Command::default());
        let of_state = |frame: Frame| match frame {
            Frame { nonce, sequence, body: Body::State(state) } if nonce == self.nonce => Some((sequence, state)),
            _ => None,
        };
        ask(&self.socket, address, send, of_state, "it sends no state after the first command")
    }

    /// Sends a last command without a wrench, then a close with `reason`.
    pub(super) fn close(&self, reason: &'static str) {
        // If the zero does not reach the driver, the force ends when the last wrench expires.
        let _ = self.command(Command::default());
        let _ = self.send(self.next(), Body::Close(Cow::Borrowed(reason)));
    }
}

/// Sends hellos until the driver answers with a welcome.
fn handshake(socket: &Socket, nonce: u64, rate_hz: f64, address: &BridgeAddress) -> Result<Welcome, BridgeError> {
    let mut sequence = 0;
    let send = || {
        sequence += 1;
        let mut hello = [0; LONGEST];
        socket.send(frame::encode(&Frame { nonce, sequence, body: Body::Hello { rate_hz } }, &mut hello))
    };
    let of_welcome = |frame: Frame| match frame {
        Frame { nonce: of, body: Body::Welcome(welcome), .. } if of == nonce => Some(welcome),
        _ => None,
    };
    ask(socket, address, send, of_welcome, "it does not answer; is it in a session with another program?")
}

/// Calls `send` again and again until `answer` accepts a frame of the driver. If no frame is
/// accepted within a second, fails with `silent`, or with the fault of a frame.
fn ask<T>(
    socket: &Socket,
    address: &BridgeAddress,
    mut send: impl FnMut() -> io::Result<bool>,
    answer: impl Fn(Frame) -> Option<T>,
    silent: &str,
) -> Result<T, BridgeError> {
    let gone = |error: io::Error| BridgeError::NoDriver { address: address.to_string(), why: error.to_string() };
    let (begun, mut buffer, mut why) = (Instant::now(), BUFFER, silent.to_owned());
    let mut again = begun;
    while begun.elapsed() < FIRST_ANSWER {
        if Instant::now() >= again {
            send().map_err(gone)?;
            again = Instant::now() + AGAIN;
        }
        let Received::Frame(length) = socket.receive(&mut buffer).map_err(gone)? else { continue };
        match frame::decode(&buffer[..length]).map(&answer) {
            Ok(Some(accepted)) => return Ok(accepted),
            Ok(None) => {}
            Err(refusal) => why = format!("it sends a frame, but {refusal}"),
        }
    }
    Err(BridgeError::NotUnderstood { address: address.to_string(), why })
}

/// Returns an unpredictable number, from the random keys of a standard hasher.
pub(super) fn new_nonce() -> u64 {
    RandomState::new().build_hasher().finish()
}
