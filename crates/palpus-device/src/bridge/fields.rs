//! Reads and writes the fields of a frame.

use glam::DVec3;

/// Reads fields in order. After the end of the bytes, all fields are zero.
pub(super) struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    pub(super) fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut field = [0; N];
        let (taken, rest) = self.bytes.split_at(N.min(self.bytes.len()));
        field[..taken.len()].copy_from_slice(taken);
        self.bytes = rest;
        field
    }

    pub(super) fn count(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    pub(super) fn number(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    pub(super) fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    /// Reads UTF-8 text that is padded with zeros; `None` if the text is invalid or contains
    /// control characters.
    pub(super) fn text<const N: usize>(&mut self) -> Option<String> {
        let field: [u8; N] = self.take();
        let end = field.iter().position(|byte| *byte == 0).unwrap_or(N);
        if field[end..].iter().any(|byte| *byte != 0) {
            return None;
        }
        let text = std::str::from_utf8(&field[..end]).ok()?;
        (!text.chars().any(char::is_control)).then(|| text.to_owned())
    }
}

/// Writes fields in order into a buffer of zeros.
pub(super) struct Writer<'a> {
    bytes: &'a mut [u8],
    at: usize,
}

impl<'a> Writer<'a> {
    pub(super) fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(super) fn put<const N: usize>(&mut self, field: [u8; N]) -> &mut Self {
        self.bytes[self.at..self.at + N].copy_from_slice(&field);
        self.skip(N)
    }

    pub(super) fn skip(&mut self, bytes: usize) -> &mut Self {
        self.at += bytes;
        self
    }

    pub(super) fn number(&mut self, value: f64) -> &mut Self {
        self.put(value.to_le_bytes())
    }

    pub(super) fn vector(&mut self, value: DVec3) -> &mut Self {
        self.number(value.x).number(value.y).number(value.z)
    }

    /// Writes as many whole characters of `text` as fit, without control characters.
    pub(super) fn text<const N: usize>(&mut self, text: &str) {
        let mut length = 0;
        for character in text.chars().filter(|character| !character.is_control()) {
            if length + character.len_utf8() > N {
                break;
            }
            let to = &mut self.bytes[self.at + length..self.at + N];
            length += character.encode_utf8(to).len();
        }
        self.skip(N);
    }
}
