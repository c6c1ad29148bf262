//! Text that may be in any encoding: lines with their numbers, words, numbers.
//!
//! Mesh files contain comments and names in Latin-1, Shift-JIS and other encodings, so the text
//! need not be UTF-8. Only numbers and keywords must be ASCII.

/// The lines of a text, with their numbers counted from 1; a line ends at `\n`, `\r\n` or a lone
/// `\r`.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { rest: text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text), number: 0 }
    }

    /// Number of the line read last; 0 before the first.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Bytes not read yet.
    pub(super) fn remaining(&self) -> u64 {
        self.rest.len() as u64
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (u64, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        self.rest = match rest {
            [b'\r', b'\n', after @ ..] => after,
            [_, after @ ..] => after,
            [] => rest,
        };
        Some((self.number, line))
    }
}

/// The words of a line up to a `#`.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = line.iter().position(|&b| b == b'#').unwrap_or(line.len());
    line[..end].split(|b| b.is_ascii_whitespace()).filter(|word| !word.is_empty())
}

/// The number that a word spells; infinities and NaN are numbers here, the caller refuses them with
/// their text.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The whole number that a word spells.
pub(super) fn whole(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word as it may be shown in an error: printable and short.
pub(super) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(LONGEST)])
        .chars()
        .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
        .collect();
    if word.len() > LONGEST { text + "…" } else { text }
}

/// True when the bytes cannot be text in an encoding that extends ASCII.
pub(super) fn looks_binary(bytes: &[u8]) -> bool {
    bytes.iter().any(|&b| b < b' ' && !b.is_ascii_whitespace() && b != 0x1B && b != 0x1A && b != 0x0B)
}
