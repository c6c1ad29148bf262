//! Converts numbers to bytes and back: little-endian; integers in LEB128, where small integers take
//! few bytes.

use std::io;

use glam::DVec3;

/// A buffer of encoded bytes.
#[derive(Default)]
pub(super) struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// Passes the encoded bytes to `sink` and clears the buffer.
    pub(super) fn flush(&mut self, sink: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        let given = sink(&self.bytes);
        self.bytes.clear();
        given
    }

    /// Appends an integer: seven bits in each byte, the lowest bits first; a set high bit
    /// means that another byte follows.
    pub(super) fn whole(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.bytes.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.bytes.push(number as u8);
    }

    pub(super) fn count(&mut self, number: usize) {
        self.whole(number as u64);
    }

    pub(super) fn real(&mut self, number: f64) {
        self.bytes.extend(number.to_le_bytes());
    }

    pub(super) fn vector(&mut self, vector: DVec3) {
        vector.to_array().into_iter().for_each(|x| self.real(x));
    }
}

/// Decodes numbers from bytes. Each method returns `None` if the bytes end too early or are
/// invalid.
#[derive(Clone, Copy)]
pub(super) struct Reader<'a> {
    pub(super) rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(taken)
    }

    #[inline]
    pub(super) fn whole(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..63).step_by(7) {
            let (&byte, rest) = self.rest.split_first()?;
            self.rest = rest;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    #[inline]
    pub(super) fn index(&mut self) -> Option<u32> {
        self.whole()?.try_into().ok()
    }

    /// Reads a number of items; `None` if that many items of at least `bytes_each` bytes exceed the
    /// remaining bytes.
    pub(super) fn count(&mut self, bytes_each: usize) -> Option<usize> {
        let count = usize::try_from(self.whole()?).ok()?;
        (count <= self.rest.len() / bytes_each).then_some(count)
    }

    #[inline]
    pub(super) fn real(&mut self) -> Option<f64> {
        let (bytes, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(f64::from_le_bytes(*bytes))
    }

    #[inline]
    pub(super) fn vector(&mut self) -> Option<DVec3> {
        Some(DVec3::new(self.real()?, self.real()?, self.real()?))
    }
}
