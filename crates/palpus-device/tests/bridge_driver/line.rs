//! The driver's end of a connection.

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
            let socket = UdpSocket::bind("127.0.0.1:0").expect("there is a free port");
            socket.set_nonblocking(true).expect("the socket works");
            let address = BridgeAddress::Udp(socket.local_addr().expect("the address is valid"));
            return (Self::Udp(socket, None), address);
        }
        Self::listen_at(path)
    }

    #[cfg(target_os = "linux")]
    fn listen_at(path: PathBuf) -> (Self, BridgeAddress) {
        use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, listen, socket_with};
        let flags = SocketFlags::CLOEXEC | SocketFlags::NONBLOCK;
        let socket = socket_with(AddressFamily::UNIX, SocketType::SEQPACKET, flags, None).expect("the socket works");
        let _ = std::fs::remove_file(&path);
        bind(&socket, &SocketAddrUnix::new(path.as_path()).expect("the path is short enough"))
            .expect("the socket works");
        listen(&socket, 1).expect("the socket works");
        (Self::Packets(socket, None), BridgeAddress::Path(path))
    }

    #[cfg(not(target_os = "linux"))]
    fn listen_at(_: PathBuf) -> (Self, BridgeAddress) {
        panic!("this system has no Unix sockets of packets")
    }

    /// Returns the length of the next frame, or 0 if the other end is closed; `None` if there is no
    /// frame.
    pub(super) fn receive(&mut self, bytes: &mut [u8], any_peer: bool) -> Option<usize> {
        match self {
            Self::Udp(socket, peer) => loop {
                let (length, from) = socket.recv_from(bytes).ok()?;
                if any_peer {
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
                        // Makes room for states while the other process is delayed, as
                        // docs/bridge.md recommends.
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

    /// Sends a frame, and waits while the queue is full.
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
