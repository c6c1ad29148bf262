//! Address of the service.

use std::net::{SocketAddr, ToSocketAddrs};

use super::{HaplyError, HaplyOptions};

/// Default address of the service.
pub const HAPLY_ADDRESS: &str = "ws://localhost:10001";

const PORT: u16 = 10001;

/// A service's address, taken apart and looked up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Address {
    /// As written.
    pub(super) written: String,
    /// For the handshake.
    pub(super) url: String,
    /// Host and port, for HTTP.
    pub(super) authority: String,
    /// To be tried in this order.
    pub(super) sockets: Vec<SocketAddr>,
}

impl Address {
    /// Reads the address from `options`: a `ws://` URL without user or query, on this machine
    /// unless other hosts are allowed.
    pub(super) fn of(options: &HaplyOptions) -> Result<Self, HaplyError> {
        let written = options.address.clone();
        let none = || HaplyError::Address(options.address.clone());
        let rest = written.strip_prefix("ws://").ok_or_else(none)?;
        let (authority, path) = rest.split_once('/').map_or((rest, ""), |(authority, path)| (authority, path));
        let plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_graphic() && !b"@?#\"<>\\".contains(&byte));
        if authority.is_empty() || !plain(authority) || !plain(path) {
            return Err(none());
        }
        let (host, port) = split_port(authority).ok_or_else(none)?;
        let sockets: Vec<SocketAddr> = (host, port)
            .to_socket_addrs()
            .map_err(|error| HaplyError::NoService { address: written.clone(), why: error.to_string() })?
            .collect();
        if !options.beyond_loopback && !sockets.iter().all(|socket| socket.ip().is_loopback()) {
            return Err(HaplyError::NotHere(written));
        }
        let authority = if host.contains(':') { format!("[{host}]:{port}") } else { format!("{host}:{port}") };
        Ok(Self { url: format!("ws://{authority}/{path}"), authority, written, sockets })
    }
}

/// Host and port of `HOST`, `HOST:PORT`, `[V6]` or `[V6]:PORT`.
fn split_port(authority: &str) -> Option<(&str, u16)> {
    if let Some(rest) = authority.strip_prefix('[') {
        let (host, rest) = rest.split_once(']')?;
        let port = if rest.is_empty() { PORT } else { rest.strip_prefix(':')?.parse().ok()? };
        return Some((host, port));
    }
    match authority.split_once(':') {
        None => Some((authority, PORT)),
        Some((host, port)) if !host.is_empty() => Some((host, port.parse().ok()?)),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(address: &str, beyond_loopback: bool) -> Result<Address, HaplyError> {
        Address::of(&HaplyOptions { address: address.to_owned(), beyond_loopback, ..HaplyOptions::default() })
    }

    #[test]
    fn an_address_is_taken_apart() {
        let address = of("ws://127.0.0.1", false).unwrap();
        assert_eq!((address.url.as_str(), address.authority.as_str()), ("ws://127.0.0.1:10001/", "127.0.0.1:10001"));
        assert_eq!(of("ws://127.0.0.1:7/a/b", false).unwrap().url, "ws://127.0.0.1:7/a/b");
        assert_eq!(of("ws://[::1]:7", false).unwrap().url, "ws://[::1]:7/");
        for bad in [
            "",
            "localhost",
            "wss://localhost",
            "ws://",
            "ws://:1",
            "ws://a:b",
            "ws://u@localhost",
            "ws://[::1",
            "ws://a b",
        ] {
            assert_eq!(of(bad, false), Err(HaplyError::Address(bad.to_owned())), "{bad}");
        }
    }

    #[test]
    fn another_machine_has_to_be_asked_for() {
        assert_eq!(of("ws://192.0.2.1:10001", false), Err(HaplyError::NotHere("ws://192.0.2.1:10001".to_owned())));
        assert!(of("ws://192.0.2.1:10001", true).is_ok());
    }
}
