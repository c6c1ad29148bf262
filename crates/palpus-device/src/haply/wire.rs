//! A WebSocket of which every call ends by a deadline.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use tungstenite::handshake::HandshakeError;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

use super::address::Address;

/// Until somebody has accepted, and until a handshake is over.
const CONNECT_TIME: Duration = Duration::from_millis(400);
/// For a message to leave: it does at once unless the service has stopped reading long ago.
const SEND_TIME: Duration = Duration::from_millis(100);
/// Bytes of the largest message that is listened to. An inventory of ten devices has about twenty
/// thousand.
const LARGEST_MESSAGE: usize = 1 << 20;
/// Pings and the like between two messages.
const MOST_CONTROL: usize = 64;
/// Bytes read at once.
const READ_BUFFER: usize = 1 << 16;

/// A connection that listens until a deadline, or not at all.
pub(super) struct Line {
    tcp: TcpStream,
    until: Option<Instant>,
}

impl Line {
    /// To the first of `sockets` that accepts.
    pub(super) fn connect(sockets: &[SocketAddr]) -> io::Result<Self> {
        let mut failed = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
        for socket in sockets {
            match TcpStream::connect_timeout(socket, CONNECT_TIME) {
                Ok(tcp) => {
                    tcp.set_nodelay(true)?;
                    tcp.set_write_timeout(Some(SEND_TIME))?;
                    return Ok(Self { tcp, until: Some(Instant::now() + CONNECT_TIME) });
                }
                Err(error) => failed = error,
            }
        }
        Err(failed)
    }
}

impl Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(until) = self.until else {
            // Not for long enough to be a wait, and the clock's ticks make more of it anyway: so
            // not at all.
            self.tcp.set_nonblocking(true)?;
            let read = self.tcp.read(buffer);
            self.tcp.set_nonblocking(false)?;
            return read;
        };
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        self.tcp.set_read_timeout(Some(left))?;
        self.tcp.read(buffer)
    }
}

impl Write for Line {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.tcp.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.tcp.flush()
    }
}

/// Result of listening.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// A message.
    Text(String),
    /// A message that is not from the service.
    Other(&'static str),
    /// Nothing in time.
    Nothing,
}

/// Messages to and from a service.
pub(super) struct Wire {
    socket: WebSocket<Line>,
}

impl Wire {
    /// Connects and shakes hands.
    pub(super) fn open(address: &Address) -> Result<Self, Failed> {
        let line = Line::connect(&address.sockets).map_err(|error| Failed::NoService(plain(&error)))?;
        let config = WebSocketConfig::default()
            .read_buffer_size(READ_BUFFER)
            .write_buffer_size(0)
            .max_write_buffer_size(LARGEST_MESSAGE)
            .max_message_size(Some(LARGEST_MESSAGE))
            .max_frame_size(Some(LARGEST_MESSAGE));
        match tungstenite::client::client_with_config(address.url.as_str(), line, Some(config)) {
            Ok((socket, _)) => Ok(Self { socket }),
            Err(HandshakeError::Interrupted(_)) => {
                Err(Failed::NotUnderstood("it does not answer the handshake".into()))
            }
            Err(HandshakeError::Failure(error)) => Err(Failed::NotUnderstood(said(&error))),
        }
    }

    /// Sends a message.
    pub(super) fn send(&mut self, text: &str) -> Result<(), String> {
        self.socket.send(Message::text(text)).map_err(|error| said(&error))
    }

    /// The next message, if there is one before `until`; if that is `None`, if there is one
    /// already.
    pub(super) fn hear(&mut self, until: Option<Instant>) -> Result<Heard, String> {
        self.socket.get_mut().until = until;
        for _ in 0..MOST_CONTROL {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Ok(Heard::Text(text.as_str().to_owned())),
                Ok(Message::Binary(_)) => return Ok(Heard::Other("a binary message")),
                // Pings and the like are answered by the library.
                Ok(_) if until.is_none_or(|until| Instant::now() < until) => {}
                Ok(_) => return Ok(Heard::Nothing),
                Err(Error::Io(error)) if waited(&error) => return Ok(Heard::Nothing),
                Err(error) => return Err(said(&error)),
            }
        }
        Err("it sends pings without end".to_owned())
    }

    /// Says goodbye; whether it is heard does not matter any more.
    pub(super) fn close(mut self) {
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}

/// Why there is no connection.
pub(super) enum Failed {
    /// No service accepts the connection.
    NoService(String),
    /// Somebody does.
    NotUnderstood(String),
}

pub(super) fn waited(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

/// An error of the system in few words.
pub(super) fn plain(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::ConnectionRefused => "connection refused: nothing listens there".to_owned(),
        io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => "no answer in time".to_owned(),
        _ => error.to_string(),
    }
}

fn said(error: &Error) -> String {
    match error {
        Error::ConnectionClosed | Error::AlreadyClosed => "it closed the connection".to_owned(),
        Error::Io(error) => format!("the connection broke off ({})", plain(error)),
        Error::Protocol(tungstenite::error::ProtocolError::ResetWithoutClosingHandshake) => {
            "it broke the connection off".to_owned()
        }
        Error::Capacity(_) => format!("it sent a message of more than {} kB", LARGEST_MESSAGE >> 10),
        other => other.to_string(),
    }
}
