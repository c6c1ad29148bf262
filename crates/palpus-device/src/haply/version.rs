//! The service's version, asked for over HTTP at the same port.

use std::io::{Read, Write};

use serde_json::Value;

use super::address::Address;
use super::wire::Line;

/// Bytes of an answer that are read.
const MOST: u64 = 1 << 16;

/// How a force is spelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spelling {
    /// From 3.5 on.
    Vector,
    /// Before.
    Values,
}

impl Spelling {
    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Vector => "vector",
            Self::Values => "values",
        }
    }
}

/// The version as the service writes it; `None` when it does not say.
pub(super) fn ask(address: &Address) -> Option<String> {
    let mut line = Line::connect(&address.sockets).ok()?;
    let request = format!(
        "GET /version HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nAccept: application/json\r\n\r\n",
        address.authority
    );
    line.write_all(request.as_bytes()).ok()?;
    let mut answer = Vec::new();
    // A server that keeps the line open ends it by the deadline: what has come until then may be all there is.
    let _ = line.take(MOST).read_to_end(&mut answer);
    of_answer(&String::from_utf8_lossy(&answer))
}

/// Out of an HTTP answer with an object that has `project_version`.
fn of_answer(answer: &str) -> Option<String> {
    let (head, body) = answer.split_once("\r\n\r\n")?;
    let mut status = head.split_whitespace();
    if !status.next()?.starts_with("HTTP/") || status.next()? != "200" {
        return None;
    }
    // A body in chunks has its lengths on lines of their own around the object.
    let object = body.get(body.find('{')?..=body.rfind('}')?)?;
    let value: Value = serde_json::from_str(object).ok()?;
    let version = value.get("project_version").or_else(|| value.get("version"))?.as_str()?;
    (version.len() <= 64).then(|| version.chars().filter(|letter| !letter.is_control()).collect())
}

/// The spelling of a service of this version; without one, of the newest that is known.
pub(super) fn spelling(version: Option<&str>) -> Spelling {
    let number = version.and_then(|version| {
        let mut parts = version.trim_start_matches('v').split(['.', '-', '+']);
        Some((parts.next()?.parse::<u32>().ok()?, parts.next().unwrap_or("0").parse::<u32>().ok()?))
    });
    match number {
        Some(number) if number < (3, 5) => Spelling::Values,
        _ => Spelling::Vector,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_decides_the_spelling() {
        for (version, spelled) in [
            (Some("3.5.0"), Spelling::Vector),
            (Some("v3.10.2-rc1"), Spelling::Vector),
            (Some("4"), Spelling::Vector),
            (Some("3.4.9"), Spelling::Values),
            (Some("3.0"), Spelling::Values),
            (Some("2"), Spelling::Values),
            (Some("nightly"), Spelling::Vector),
            (None, Spelling::Vector),
        ] {
            assert_eq!(spelling(version), spelled, "{version:?}");
        }
    }

    #[test]
    fn a_version_is_found_in_an_answer() {
        let plain = "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n{\"project_version\":\"3.5.1\"}";
        assert_eq!(of_answer(plain).as_deref(), Some("3.5.1"));
        let chunks =
            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1b\r\n{\"project_version\":\"3.4.0\"}\r\n0\r\n\r\n";
        assert_eq!(of_answer(chunks).as_deref(), Some("3.4.0"));
        for none in
            ["", "HTTP/1.1 404 Not Found\r\n\r\n{\"project_version\":\"1\"}", "HTTP/1.1 200 OK\r\n\r\n}{", "\r\n\r\n{}"]
        {
            assert_eq!(of_answer(none), None, "{none}");
        }
    }
}
