//! HTTP requests to the service at the same port: version, settings, pairing.

use std::io::{Read, Write};

use serde_json::Value;

use super::address::Address;
use super::wire::Line;

/// Largest number of bytes that are read from an answer.
const MOST: u64 = 1 << 16;

/// Returns the JSON object that the service answers to `GET path`; `None` without such an object.
pub(super) fn get(address: &Address, path: &str) -> Option<Value> {
    let mut line = Line::connect(&address.sockets).ok()?;
    let request = format!(
        "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nAccept: application/json\r\n\r\n",
        address.authority
    );
    line.write_all(request.as_bytes()).ok()?;
    let mut answer = Vec::new();
    // If a server keeps the connection open, the deadline ends the read. The bytes received so far
    // may be complete.
    let _ = line.take(MOST).read_to_end(&mut answer);
    of_answer(&String::from_utf8_lossy(&answer))
}

/// Escapes the special characters of a path segment.
pub(super) fn in_path(part: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    part.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

/// Returns the JSON object in an HTTP answer with status 200.
fn of_answer(answer: &str) -> Option<Value> {
    let (head, body) = answer.split_once("\r\n\r\n")?;
    let mut status = head.split_whitespace();
    if !status.next()?.starts_with("HTTP/") || status.next()? != "200" {
        return None;
    }
    // In a chunked body, the chunk lengths stand on lines before and after the object.
    let object = body.get(body.find('{')?..=body.rfind('}')?)?;
    serde_json::from_str(object).ok()
}

/// Returns the number in an answer: a bare number, a `value`, or either of them inside `data`.
pub(super) fn number_of(answer: &Value) -> Option<f64> {
    let inner = answer.get("data").unwrap_or(answer);
    inner.as_f64().or_else(|| inner.get("value")?.as_f64()).filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn object_is_found_in_http_answer() {
        let plain = "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n{\"project_version\":\"3.5.1\"}";
        assert_eq!(of_answer(plain), Some(json!({ "project_version": "3.5.1" })));
        let chunks =
            "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n1b\r\n{\"project_version\":\"3.4.0\"}\r\n0\r\n\r\n";
        assert_eq!(of_answer(chunks), Some(json!({ "project_version": "3.4.0" })));
        for none in
            ["", "HTTP/1.1 404 Not Found\r\n\r\n{\"project_version\":\"1\"}", "HTTP/1.1 200 OK\r\n\r\n}{", "\r\n\r\n{"]
        {
            assert_eq!(of_answer(none), None, "{none}");
        }
    }

    #[test]
    fn number_is_found_in_every_wrapping() {
        for answer in [json!({ "value": 0.5 }), json!({ "ok": true, "data": 0.5 }), json!({ "data": { "value": 0.5 } })]
        {
            assert_eq!(number_of(&answer), Some(0.5), "{answer}");
        }
        assert_eq!(number_of(&json!({ "ok": false, "error": "no" })), None);
    }

    #[test]
    fn id_is_escaped_in_a_path() {
        assert_eq!(in_path("04C3"), "04C3");
        assert_eq!(in_path("a/b c"), "a%2Fb%20c");
    }
}
