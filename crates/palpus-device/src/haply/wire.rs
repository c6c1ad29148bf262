//! A WebSocket client in which every call ends by a deadline.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use tungstenite::handshake::HandshakeError;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

use super::address::Address;

/// Time limit for the connection, and for the handshake.
const CONNECT_TIME: Duration = Duration::from_millis(400);
/// Time limit for sending a message. A message leaves at once unless the service has stopped
/// reading.
const SEND_TIME: Duration = Duration::from_millis(100);
/// Size of the largest message that is accepted, bytes. An inventory of ten devices has about 20
/// kB.
const LARGEST_MESSAGE: usize = 1 << 20;
/// Largest number of control frames, such as pings, between two messages.
const MOST_CONTROL: usize = 64;
/// Number of bytes that are read at once.
const READ_BUFFER: usize = 1 << 16;

/// A TCP connection whose reads wait until a deadline, or not at all.
pub(super) struct Line {
    tcp: TcpStream,
    until: Option<Instant>,
}

impl Line {
    /// Connects to the first of `sockets` that accepts.
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
            // Reads without waiting. A very short timeout would last longer than requested, because
            // the system's clock is coarse.
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

/// Result of waiting for a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Received {
    /// A text message.
    Text(String),
    /// A message of another kind, with its description.
    Other(&'static str),
    /// No message before the deadline.
    Nothing,
}

/// A WebSocket connection to the service.
pub(super) struct Wire {
    socket: WebSocket<Line>,
}

impl Wire {
    /// Connects and performs the handshake.
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

    /// Returns the next message that arrives before `until`. If `until` is `None`, returns a
    /// message only if it has already arrived.
    pub(super) fn hear(&mut self, until: Option<Instant>) -> Result<Received, String> {
        self.socket.get_mut().until = until;
        for _ in 0..MOST_CONTROL {
            match self.socket.read() {
                Ok(Message::Text(text)) => return Ok(Received::Text(text.as_str().to_owned())),
                Ok(Message::Binary(_)) => return Ok(Received::Other("a binary message")),
                // The library answers pings.
                Ok(_) if until.is_none_or(|until| Instant::now() < until) => {}
                Ok(_) => return Ok(Received::Nothing),
                Err(Error::Io(error)) if waited(&error) => return Ok(Received::Nothing),
                Err(error) => return Err(said(&error)),
            }
        }
        Err("it sends too many pings".to_owned())
    }

    /// Closes the connection. An error is ignored, since the service need not receive the close.
    pub(super) fn close(mut self) {
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}

/// The reason why there is no connection.
pub(super) enum Failed {
    /// No service accepts the connection.
    NoService(String),
    /// A program accepts the connection, but does not answer as the service does.
    NotUnderstood(String),
}

pub(super) fn waited(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut)
}

/// Describes a system error in few words.
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
        Error::Io(error) => format!("the connection was lost ({})", plain(error)),
        Error::Protocol(tungstenite::error::ProtocolError::ResetWithoutClosingHandshake) => {
            "it reset the connection".to_owned()
        }
        Error::Capacity(_) => format!("it sent a message of more than {} kB", LARGEST_MESSAGE >> 10),
        other => other.to_string(),
    }
}
