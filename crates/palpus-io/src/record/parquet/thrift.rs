//! The part of Thrift's compact protocol that Parquet's footers and page headers need.

/// Type of a field's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    /// Signed integer of 32 bits.
    Int = 5,
    /// Signed integer of 64 bits.
    Long = 6,
    /// Bytes or text.
    Text = 8,
    /// List of values of one type.
    List = 9,
    /// A struct, which contains fields.
    Struct = 12,
}

/// Writes the fields of a struct, in the order of their numbers.
pub(super) struct Fields<'a> {
    out: &'a mut Vec<u8>,
    last: u8,
}

/// Appends a struct.
pub(super) fn write(out: &mut Vec<u8>, body: impl FnOnce(&mut Fields<'_>)) {
    body(&mut Fields { out, last: 0 });
    out.push(0);
}

impl Fields<'_> {
    fn begin(&mut self, number: u8, kind: Kind) {
        self.out.push((number - self.last) << 4 | kind as u8);
        self.last = number;
    }

    /// Appends an [`Kind::Int`].
    pub(super) fn int(&mut self, number: u8, value: i32) {
        self.begin(number, Kind::Int);
        varint(self.out, zigzag(value.into()));
    }

    /// Appends a [`Kind::Long`].
    pub(super) fn long(&mut self, number: u8, value: u64) {
        self.begin(number, Kind::Long);
        varint(self.out, zigzag(value as i64));
    }

    /// Appends a [`Kind::Text`].
    pub(super) fn text(&mut self, number: u8, text: &str) {
        self.begin(number, Kind::Text);
        varint(self.out, text.len() as u64);
        self.out.extend(text.bytes());
    }

    /// Appends a [`Kind::Struct`].
    pub(super) fn structure(&mut self, number: u8, body: impl FnOnce(&mut Fields<'_>)) {
        self.begin(number, Kind::Struct);
        write(self.out, body);
    }

    fn list(&mut self, number: u8, kind: Kind, length: usize) {
        self.begin(number, Kind::List);
        match u8::try_from(length) {
            Ok(length @ 0..15) => self.out.push(length << 4 | kind as u8),
            _ => {
                self.out.push(0xF0 | kind as u8);
                varint(self.out, length as u64);
            }
        }
    }

    /// Appends a list of [`Kind::Struct`].
    pub(super) fn structures<T>(&mut self, number: u8, items: &[T], mut each: impl FnMut(&T, &mut Fields<'_>)) {
        self.list(number, Kind::Struct, items.len());
        for item in items {
            write(self.out, |fields| each(item, fields));
        }
    }

    /// Appends a list of [`Kind::Int`].
    pub(super) fn ints(&mut self, number: u8, items: &[i32]) {
        self.list(number, Kind::Int, items.len());
        items.iter().for_each(|item| varint(self.out, zigzag((*item).into())));
    }

    /// Appends a list of one [`Kind::Text`].
    pub(super) fn texts(&mut self, number: u8, text: &str) {
        self.list(number, Kind::Text, 1);
        varint(self.out, text.len() as u64);
        self.out.extend(text.bytes());
    }
}

fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63) as u64
}

/// Appends an integer with seven bits in each byte and no more bytes than necessary.
pub(super) fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

/// Largest nesting depth of structs; Parquet's metadata are nested less deeply.
const DEEPEST: u32 = 16;

/// Decodes bytes. Each method returns `None` if the bytes end too early or are not valid Thrift.
#[derive(Clone, Copy)]
pub(super) struct Input<'a>(pub(super) &'a [u8]);

impl<'a> Input<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (byte, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*byte)
    }

    /// Reads the output of [`varint`].
    pub(super) fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7F) << shift;
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }

    /// Reads the value of a [`Kind::Int`] or [`Kind::Long`].
    pub(super) fn int(&mut self) -> Option<i64> {
        let value = self.varint()?;
        Some((value >> 1) as i64 ^ -((value & 1) as i64))
    }

    /// Reads the value of a [`Kind::Int`] or [`Kind::Long`] that must not be negative.
    pub(super) fn size(&mut self) -> Option<u64> {
        u64::try_from(self.int()?).ok()
    }

    /// Reads the value of a [`Kind::Text`].
    pub(super) fn text(&mut self) -> Option<&'a str> {
        let length = usize::try_from(self.varint()?).ok()?;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        std::str::from_utf8(text).ok()
    }

    /// Reads a struct. `each` receives the number and the kind of a field, and returns true if it
    /// has read the field; other fields are skipped.
    pub(super) fn structure(&mut self, mut each: impl FnMut(i64, u8, &mut Self) -> Option<bool>) -> Option<()> {
        let mut last = 0;
        while let Some((number, kind)) = self.field(&mut last)? {
            if !each(number, kind, self)? {
                self.skip(kind, DEEPEST)?;
            }
        }
        Some(())
    }

    /// Reads the number and the kind of the next field of a struct; returns `Some(None)` at its
    /// end.
    fn field(&mut self, last: &mut i64) -> Option<Option<(i64, u8)>> {
        let head = self.byte()?;
        if head == 0 {
            return Some(None);
        }
        *last = match head >> 4 {
            0 => self.int()?,
            step => last.checked_add(step.into())?,
        };
        Some(Some((*last, head & 0xF)))
    }

    /// Reads the kind of the items and the length of a list. The length is not verified, so the
    /// caller must not allocate memory for it.
    pub(super) fn list(&mut self) -> Option<(u8, u64)> {
        let head = self.byte()?;
        let length = match head >> 4 {
            15 => self.varint()?,
            length => length.into(),
        };
        Some((head & 0xF, length))
    }

    fn skip(&mut self, kind: u8, depth: u32) -> Option<()> {
        let depth = depth.checked_sub(1)?;
        match kind {
            // Booleans, whose value is encoded in the kind.
            1 | 2 => {}
            3 => _ = self.byte()?,
            4..=6 => _ = self.varint()?,
            7 => self.0 = self.0.get(8..)?,
            8 => {
                let length = usize::try_from(self.varint()?).ok()?;
                self.0 = self.0.get(length..)?;
            }
            9 | 10 => {
                let (kind, length) = self.list()?;
                for _ in 0..length {
                    self.skip_item(kind, depth)?;
                }
            }
            11 => {
                let length = self.varint()?;
                if length > 0 {
                    let kinds = self.byte()?;
                    for _ in 0..length {
                        self.skip_item(kinds >> 4, depth)?;
                        self.skip_item(kinds & 0xF, depth)?;
                    }
                }
            }
            12 => {
                let mut last = 0;
                while let Some((_, kind)) = self.field(&mut last)? {
                    self.skip(kind, depth)?;
                }
            }
            _ => return None,
        }
        Some(())
    }

    /// Skips an item of a list or a map. There, booleans take one byte. Every item takes at least
    /// one byte, so a false length ends soon.
    fn skip_item(&mut self, kind: u8, depth: u32) -> Option<()> {
        if matches!(kind, 1 | 2) { self.byte().map(|_| ()) } else { self.skip(kind, depth) }
    }
}
