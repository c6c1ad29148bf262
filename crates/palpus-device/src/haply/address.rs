//! Address of the Inverse Service.

use std::net::{SocketAddr, ToSocketAddrs};

use super::{HaplyError, HaplyOptions};

/// Default address of the service.
pub const HAPLY_ADDRESS: &str = "ws://localhost:10001";

const PORT: u16 = 10001;

/// A parsed address of the service, with its socket addresses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Address {
    /// The address as the user wrote it.
    pub(super) written: String,
    /// URL for the WebSocket handshake.
    pub(super) url: String,
    /// Host and port, for HTTP.
    pub(super) authority: String,
    /// Socket addresses, in the order in which they are tried.
    pub(super) sockets: Vec<SocketAddr>,
}

impl Address {
    /// Parses the address in `options`: a `ws://` URL without user or query. The address must be on
    /// this machine unless other hosts are allowed.
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

/// Splits `HOST`, `HOST:PORT`, `[V6]` or `[V6]:PORT` into host and port; `None` if the text is
/// malformed.
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
    fn address_is_parsed() {
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
    fn address_on_another_machine_must_be_allowed() {
        assert_eq!(of("ws://192.0.2.1:10001", false), Err(HaplyError::NotHere("ws://192.0.2.1:10001".to_owned())));
        assert!(of("ws://192.0.2.1:10001", true).is_ok());
    }
}
