//! The driver's end of the connection.

use std::net::{SocketAddr, UdpSocket};
#[cfg(target_os = "linux")]
use std::os::fd::OwnedFd;
use std::path::PathBuf;

use palpus_device::BridgeAddress;

use super::Way;

pub(super) enum Line {
    Udp(UdpSocket, Option<SocketAddr>),
    #[cfg(target_os = "linux")]
    Packets(OwnedFd, Option<OwnedFd>),
}

impl Line {
    pub(super) fn listen(way: Way, path: PathBuf) -> (Self, BridgeAddress) {
        if way == Way::Udp {
            let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
            socket.set_nonblocking(true).expect("a socket");
            let address = BridgeAddress::Udp(socket.local_addr().expect("an address"));
            return (Self::Udp(socket, None), address);
        }
        Self::listen_at(path)
    }

    #[cfg(target_os = "linux")]
    fn listen_at(path: PathBuf) -> (Self, BridgeAddress) {
        use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, listen, socket_with};
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        let socket = socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None).expect("a socket");
        let _ = std::fs::remove_file(&path);
        bind(&socket, &SocketAddrUnix::new(path.as_path()).expect("a short path")).expect("a socket");
        listen(&socket, 1).expect("a socket");
        (Self::Packets(socket, None), BridgeAddress::Path(path))
    }

    #[cfg(not(target_os = "linux"))]
    fn listen_at(_: PathBuf) -> (Self, BridgeAddress) {
        panic!("this system has no sockets of packets")
    }

    /// Returns the length of the next frame, 0 if the other end is gone; `None` without a frame.
    pub(super) fn receive(&mut self, bytes: &mut [u8], anybody: bool) -> Option<usize> {
        match self {
            Self::Udp(socket, peer) => loop {
                let (length, from) = socket.recv_from(bytes).ok()?;
                if anybody {
                    *peer = Some(from);
                }
                if *peer == Some(from) {
                    return Some(length);
                }
            },
            #[cfg(target_os = "linux")]
            Self::Packets(listener, connection) => {
                use rustix::net::{RecvFlags, SocketFlags, accept_with, recv};
                if connection.is_none() {
                    *connection = accept_with(&*listener, SocketFlags::CLOEXEC).ok();
                    if let Some(connection) = connection {
                        // Room for states while the other process is held up, as docs/bridge.md
                        // advises.
                        let _ = rustix::net::sockopt::set_socket_send_buffer_size(&*connection, 1 << 20);
                    }
                }
                match recv(connection.as_ref()?, bytes, RecvFlags::DONTWAIT) {
                    Ok((_, length)) => Some(length),
                    Err(rustix::io::Errno::AGAIN) => None,
                    Err(_) => Some(0),
                }
            }
        }
    }

    pub(super) fn send(&mut self, frame: &[u8]) {
        self.try_send(frame, false);
    }

    /// Waits where there is no room.
    pub(super) fn send_patiently(&mut self, frame: &[u8]) {
        self.try_send(frame, true);
    }

    fn try_send(&mut self, frame: &[u8], waits: bool) {
        match self {
            Self::Udp(socket, peer) => {
                if let Some(peer) = peer {
                    let _ = socket.send_to(frame, *peer);
                }
            }
            #[cfg(target_os = "linux")]
            Self::Packets(_, connection) => {
                use rustix::net::{SendFlags, send};
                let flags = if waits { SendFlags::NOSIGNAL } else { SendFlags::NOSIGNAL | SendFlags::DONTWAIT };
                if let Some(connection) = connection {
                    let _ = send(connection, frame, flags);
                }
            }
        }
    }

    pub(super) fn hang_up(&mut self) {
        match self {
            Self::Udp(..) => {}
            #[cfg(target_os = "linux")]
            Self::Packets(_, connection) => *connection = None,
        }
    }
}
