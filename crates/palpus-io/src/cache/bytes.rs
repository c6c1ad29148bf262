//! Numbers to bytes and back: little-endian, small whole numbers in few bytes (LEB128).

use std::io;

use glam::DVec3;

/// Bytes under way.
#[derive(Default)]
pub(super) struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// Hands over what was written so far.
    pub(super) fn flush(&mut self, sink: &mut dyn FnMut(&[u8]) -> io::Result<()>) -> io::Result<()> {
        let given = sink(&self.bytes);
        self.bytes.clear();
        given
    }

    /// A whole number: seven bits a byte, the lowest first; a set high bit says that more follow.
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

/// Bytes to be read; `None` when they end or make no sense.
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

    /// A number of things of which each takes at least `bytes_each` of what is left.
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
