//! A connection to a driver. The connection delivers complete frames or nothing.
//!
//! The Unix socket has type `SOCK_SEQPACKET` and not `SOCK_DGRAM`, for these reasons. The
//! connection ends when either process ends, so each side notices at once. No other process can
//! send into the connection. The client needs no socket file. The queue of a packet socket is
//! bounded by bytes (about 250 states), while Linux queues only 10 datagrams, which are 2.5 ms of
//! states at 4 kHz.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use super::BridgeAddress;

/// Time limit for connecting.
#[cfg(target_os = "linux")]
const CONNECT_TIME: Duration = Duration::from_secs(1);
/// Requested size of the receive queue, bytes. The default queue holds 70 ms of states at 4 kHz,
/// but a thread of ordinary priority may be delayed for longer.
#[cfg(target_os = "linux")]
const WAITING: usize = 1 << 20;

/// A connected socket. Frames are sent without waiting and received with a time limit.
#[derive(Debug)]
pub(super) enum Socket {
    Udp(UdpSocket),
    #[cfg(target_os = "linux")]
    Packets(std::os::fd::OwnedFd),
}

/// Result of a receive.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Received {
    /// A frame of this many bytes.
    Frame(usize),
    /// No frame arrived within the time limit.
    Nothing,
}

impl Socket {
    /// Connects to `address`. A receive waits at most `patience`.
    #[cfg(target_os = "linux")]
    pub(super) fn connect(address: &BridgeAddress, patience: Duration) -> io::Result<Self> {
        use rustix::net::sockopt::{Timeout, set_socket_timeout};
        use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, connect, socket_with};

        let path = match address {
            BridgeAddress::Udp(address) => return connect_udp(*address, patience),
            BridgeAddress::Path(path) => path,
        };
        let to = SocketAddrUnix::new(path.as_path())?;
        let socket = socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None)?;
        set_socket_timeout(&socket, Timeout::Send, Some(CONNECT_TIME))?;
        connect(&socket, &to)?;
        set_socket_timeout(&socket, Timeout::Recv, Some(patience))?;
        Ok(Self::Packets(socket))
    }

    /// Connects to `address`. A receive waits at most `patience`.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn connect(address: &BridgeAddress, patience: Duration) -> io::Result<Self> {
        match address {
            BridgeAddress::Udp(address) => connect_udp(*address, patience),
            BridgeAddress::Path(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    /// Sends a frame. Returns false if the queue is full, since the driver has not read earlier
    /// frames.
    pub(super) fn send(&self, frame: &[u8]) -> io::Result<bool> {
        let sent = match self {
            // A UDP socket takes a datagram or drops it; on loopback a send does not wait.
            Self::Udp(socket) => socket.send(frame),
            #[cfg(target_os = "linux")]
            Self::Packets(socket) => {
                use rustix::net::{SendFlags, send};
                send(socket, frame, SendFlags::DONTWAIT | SendFlags::NOSIGNAL).map_err(io::Error::from)
            }
        };
        match sent {
            Ok(_) => Ok(true),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Receives a frame into `buffer`. A longer frame is truncated to the buffer's length.
    pub(super) fn receive(&self, buffer: &mut [u8]) -> io::Result<Received> {
        let heard = match self {
            Self::Udp(socket) => socket.recv(buffer).map(Received::Frame),
            #[cfg(target_os = "linux")]
            Self::Packets(socket) => {
                use rustix::net::{RecvFlags, recv};
                match recv(socket, buffer, RecvFlags::empty()).map_err(io::Error::from) {
                    // A length of 0 means that the other end has closed the connection.
                    Ok((_, 0)) => Err(io::ErrorKind::UnexpectedEof.into()),
                    Ok((bytes, _)) => Ok(Received::Frame(bytes)),
                    Err(error) => Err(error),
                }
            }
        };
        match heard {
            Err(error) if is_no_answer(error.kind()) => Ok(Received::Nothing),
            heard => heard,
        }
    }
}

fn is_no_answer(kind: io::ErrorKind) -> bool {
    matches!(kind, io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

fn connect_udp(to: SocketAddr, patience: Duration) -> io::Result<Socket> {
    let any_port = match to {
        SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
        SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::LOCALHOST, 0)),
    };
    let socket = UdpSocket::bind(any_port)?;
    // From now on the system delivers only datagrams from the driver's address.
    socket.connect(to)?;
    socket.set_read_timeout(Some(patience))?;
    #[cfg(target_os = "linux")]
    rustix::net::sockopt::set_socket_recv_buffer_size(&socket, WAITING)?;
    Ok(Socket::Udp(socket))
}
