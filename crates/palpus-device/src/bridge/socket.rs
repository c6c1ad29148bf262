//! A connection to a driver that carries whole frames, each of them or none of it.
//!
//! **Unix socket of packets (`SOCK_SEQPACKET`), not of datagrams.** It ends when either process
//! ends, so each side knows at once; no other process can send into it; the client needs no file of
//! its own; and its queue is bounded by bytes (about 250 states), where Linux lets 10 datagrams
//! wait, which is 2.5 ms of states at 4 kHz.

use std::io;
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use super::BridgeAddress;

/// Most that connecting may take.
#[cfg(target_os = "linux")]
const CONNECT_TIME: Duration = Duration::from_secs(1);
/// Bytes for datagrams that wait, as far as the system allows: by default they are 70 ms of states
/// at 4 kHz, for which a thread of ordinary priority may be held up.
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
pub(super) enum Heard {
    /// So many bytes.
    Frame(usize),
    /// Nothing within the time limit.
    Nothing,
}

impl Socket {
    /// Connects to `address`; a receive waits at most `patience`.
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

    /// Connects to `address`; a receive waits at most `patience`.
    #[cfg(not(target_os = "linux"))]
    pub(super) fn connect(address: &BridgeAddress, patience: Duration) -> io::Result<Self> {
        match address {
            BridgeAddress::Udp(address) => connect_udp(*address, patience),
            BridgeAddress::Path(_) => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    /// Sends a frame; returns false if the driver has left so many unread that there is no room.
    pub(super) fn send(&self, frame: &[u8]) -> io::Result<bool> {
        let sent = match self {
            // A UDP socket takes a datagram or drops it; on loopback it does not wait.
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

    /// Receives a frame into `buffer`; the part beyond its length is cut off.
    pub(super) fn receive(&self, buffer: &mut [u8]) -> io::Result<Heard> {
        let heard = match self {
            Self::Udp(socket) => socket.recv(buffer).map(Heard::Frame),
            #[cfg(target_os = "linux")]
            Self::Packets(socket) => {
                use rustix::net::{RecvFlags, recv};
                match recv(socket, buffer, RecvFlags::empty()).map_err(io::Error::from) {
                    // How a socket of packets says that the other end is closed.
                    Ok((_, 0)) => Err(io::ErrorKind::UnexpectedEof.into()),
                    Ok((bytes, _)) => Ok(Heard::Frame(bytes)),
                    Err(error) => Err(error),
                }
            }
        };
        match heard {
            Err(error) if is_no_answer(error.kind()) => Ok(Heard::Nothing),
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
    // The system now delivers what comes from the driver's address, and nothing else.
    socket.connect(to)?;
    socket.set_read_timeout(Some(patience))?;
    #[cfg(target_os = "linux")]
    rustix::net::sockopt::set_socket_recv_buffer_size(&socket, WAITING)?;
    Ok(Socket::Udp(socket))
}
