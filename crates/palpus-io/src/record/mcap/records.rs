//! The records of an MCAP file. A record consists of a type byte, the length of the content, and
//! the content.

/// The first and the last bytes of a file.
pub(in crate::record) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Type bytes of records.
pub(super) mod opcode {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const STATISTICS: u8 = 0x0B;
    pub(crate) const METADATA: u8 = 0x0C;
    pub(crate) const METADATA_INDEX: u8 = 0x0D;
    pub(crate) const SUMMARY_OFFSET: u8 = 0x0E;
    pub(crate) const DATA_END: u8 = 0x0F;
}

/// Appends a record whose content `body` appends.
pub(super) fn record(out: &mut Vec<u8>, opcode: u8, body: impl FnOnce(&mut Vec<u8>)) {
    out.push(opcode);
    counted::<8>(out, body);
}

/// Appends the content that `body` appends, preceded by its length in `N` bytes.
pub(super) fn counted<const N: usize>(out: &mut Vec<u8>, body: impl FnOnce(&mut Vec<u8>)) {
    let at = out.len();
    out.extend([0; N]);
    body(out);
    let length = (out.len() - at - N) as u64;
    out[at..at + N].copy_from_slice(&length.to_le_bytes()[..N]);
}

/// Appends text, preceded by its length.
pub(super) fn text(out: &mut Vec<u8>, text: &str) {
    counted::<4>(out, |out| out.extend(text.bytes()));
}

/// Reads values one after another. Each method returns `None` if the bytes end too early.
pub(super) struct Values<'a>(pub(super) &'a [u8]);

impl<'a> Values<'a> {
    pub(super) fn number<const N: usize>(&mut self) -> Option<u64> {
        let (bytes, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
    }

    /// Returns bytes that are preceded by their length in `N` bytes.
    pub(super) fn counted<const N: usize>(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.number::<N>()?).ok()?;
        let (bytes, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(bytes)
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.counted::<4>()?).ok()
    }

    /// Returns the type byte and the content of the next record.
    pub(super) fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let opcode = self.number::<1>()? as u8;
        Some((opcode, self.counted::<8>()?))
    }
}
