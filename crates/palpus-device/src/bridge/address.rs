//! Address of a bridge driver: a Unix socket or a UDP port of this machine.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;

use super::BridgeError;

/// Address of a bridge driver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BridgeAddress {
    /// Path of a Unix socket of type `SOCK_SEQPACKET`; Linux only.
    Path(PathBuf),
    /// UDP port on the loopback interface.
    Udp(SocketAddr),
}

impl BridgeAddress {
    /// Parses `udp:127.0.0.1:PORT`, `udp:[::1]:PORT` or the path of a socket.
    ///
    /// # Errors
    /// Fails if the text has neither form, if the address is not on this machine, or if this system
    /// does not support Unix sockets of packets.
    pub fn parse(text: &str) -> Result<Self, BridgeError> {
        let wrong = || BridgeError::Address(text.to_owned());
        if let Some(socket) = text.strip_prefix("udp:") {
            let socket: SocketAddr = socket.parse().map_err(|_| wrong())?;
            if !socket.ip().is_loopback() {
                return Err(BridgeError::NotHere(socket.to_string()));
            }
            return if socket.port() > 0 { Ok(Self::Udp(socket)) } else { Err(wrong()) };
        }
        if text.is_empty() || text.chars().any(char::is_control) {
            return Err(wrong());
        }
        if cfg!(target_os = "linux") { Ok(Self::Path(text.into())) } else { Err(BridgeError::UdpOnly(text.to_owned())) }
    }
}

impl fmt::Display for BridgeAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Path(path) => write!(f, "{}", path.display()),
            Self::Udp(socket) => write!(f, "udp:{socket}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_addresses_of_this_machine_are_accepted() {
        assert!(matches!(BridgeAddress::parse("udp:127.0.0.1:7000"), Ok(BridgeAddress::Udp(_))));
        assert!(matches!(BridgeAddress::parse("udp:[::1]:7000"), Ok(BridgeAddress::Udp(_))));
        for far in ["udp:192.0.2.1:7000", "udp:0.0.0.0:7000", "udp:[2001:db8::1]:7000"] {
            assert!(matches!(BridgeAddress::parse(far), Err(BridgeError::NotHere(_))), "{far}");
        }
        for wrong in ["udp:", "udp:7000", "udp:localhost:7000", "udp:127.0.0.1:0", "", "a\nb"] {
            assert!(matches!(BridgeAddress::parse(wrong), Err(BridgeError::Address(_))), "{wrong}");
        }
    }
}
