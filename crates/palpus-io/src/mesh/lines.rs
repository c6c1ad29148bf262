//! Splits text of any encoding into numbered lines, words and numbers.
//!
//! Mesh files contain comments and names in Latin-1, Shift-JIS and other encodings, so the text
//! need not be UTF-8. Only numbers and keywords must be ASCII.

/// Iterator over the lines of a text and their numbers, counted from 1. A line ends at `\n`, `\r\n`
/// or a lone `\r`.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: u64,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { rest: text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text), number: 0 }
    }

    /// Returns the number of the line that was read last; 0 before the first line.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Returns the number of bytes that are not read yet.
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

/// Returns the words of a line up to the first `#`.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let end = line.iter().position(|&b| b == b'#').unwrap_or(line.len());
    line[..end].split(|b| b.is_ascii_whitespace()).filter(|word| !word.is_empty())
}

/// Parses a word as a number. Infinities and NaN are accepted; the caller rejects them with an
/// error that contains the word.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Parses a word as an integer.
pub(super) fn whole(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Returns a word in a form for error messages: printable and short.
pub(super) fn shown(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text: String = String::from_utf8_lossy(&word[..word.len().min(LONGEST)])
        .chars()
        .map(|c| if c.is_control() { '\u{FFFD}' } else { c })
        .collect();
    if word.len() > LONGEST { text + "…" } else { text }
}

/// Returns true if the bytes cannot be text in an encoding that extends ASCII.
pub(super) fn looks_binary(bytes: &[u8]) -> bool {
    bytes.iter().any(|&b| b < b' ' && !b.is_ascii_whitespace() && b != 0x1B && b != 0x1A && b != 0x0B)
}
