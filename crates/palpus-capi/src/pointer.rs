//! Pointers from C: checked as far as possible, then read or written by copying.

use std::ffi::c_char;

use crate::result::{Fault, palpus_result};

/// A value to read.
pub(crate) struct In<T> {
    array: InArray<T>,
}

/// An array of values to read.
pub(crate) struct InArray<T> {
    pointer: *const T,
    count: usize,
    name: &'static str,
}

/// A place for one value to write.
pub(crate) struct Out<T> {
    array: OutArray<T>,
}

/// An array of places to write.
pub(crate) struct OutArray<T> {
    pointer: *mut T,
    count: usize,
    name: &'static str,
}

/// A text that ends with a zero byte.
pub(crate) struct Text {
    pointer: *const c_char,
    name: &'static str,
}

/// Length limit of a text in bytes. Without a limit, a missing end would let palpus read foreign
/// memory.
const LONGEST_TEXT: usize = 1 << 15;

impl<T: Copy> In<T> {
    /// # Safety
    /// Same as [`InArray::new`], for one value.
    pub(crate) unsafe fn new(pointer: *const T, name: &'static str) -> Self {
        // SAFETY: the caller guarantees the conditions of `InArray::new`.
        Self { array: unsafe { InArray::new(pointer, 1, name) } }
    }

    /// Returns the value. Fails if the pointer is NULL or misaligned.
    pub(crate) fn get(&self) -> Result<T, Fault> {
        self.array.check()?;
        Ok(self.array.at(0))
    }

    /// Returns the value. `None` if the pointer is NULL.
    pub(crate) fn get_if_any(&self) -> Result<Option<T>, Fault> {
        if self.array.pointer.is_null() { Ok(None) } else { self.get().map(Some) }
    }
}

impl<T: Copy> InArray<T> {
    /// # Safety
    /// While this value lives, `pointer` is null, misaligned, or points to `count` values that no
    /// thread writes. Every bit pattern is a valid `T`.
    pub(crate) unsafe fn new(pointer: *const T, count: usize, name: &'static str) -> Self {
        Self { pointer, count, name }
    }

    /// Fails if the pointer cannot point to `count` values.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        check(self.pointer, self.count, self.name)
    }

    /// Returns the values in order. Call [`Self::check`] first.
    pub(crate) fn iter(&self) -> impl Iterator<Item = T> {
        (0..self.count).map(|k| self.at(k))
    }

    fn at(&self, k: usize) -> T {
        assert!(
            k < self.count && check(self.pointer, self.count, self.name).is_ok(),
            "the values must be checked first"
        );
        // SAFETY: the pointer is aligned and not null. By the contract of `new`, the pointer points
        // to more than k values.
        unsafe { self.pointer.add(k).read() }
    }
}

impl<T> Out<T> {
    /// # Safety
    /// As [`OutArray::new`], for one place.
    pub(crate) unsafe fn new(pointer: *mut T, name: &'static str) -> Self {
        // SAFETY: the caller guarantees the conditions of `OutArray::new`.
        Self { array: unsafe { OutArray::new(pointer, 1, name) } }
    }

    /// Fails if the pointer cannot point to a place. Call this check before work whose result would
    /// otherwise be lost.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        self.array.check()
    }

    /// Writes the value.
    pub(crate) fn put(&self, value: T) -> Result<(), Fault> {
        self.check()?;
        self.array.put(0, value);
        Ok(())
    }
}

impl<T> OutArray<T> {
    /// # Safety
    /// While this value lives, `pointer` is null, misaligned, or points to `count` places that no
    /// other code reads or writes.
    pub(crate) unsafe fn new(pointer: *mut T, count: usize, name: &'static str) -> Self {
        Self { pointer, count, name }
    }

    /// Fails if the pointer cannot point to `count` places.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        check(self.pointer, self.count, self.name)
    }

    /// Fails if the pointer cannot point to `count` places. NULL is allowed and means no places.
    pub(crate) fn check_if_any(&self) -> Result<(), Fault> {
        if self.pointer.is_null() { Ok(()) } else { self.check() }
    }

    /// Returns the number of places.
    pub(crate) fn len(&self) -> usize {
        if self.pointer.is_null() { 0 } else { self.count }
    }

    /// Writes a value. Call a check first.
    pub(crate) fn put(&self, k: usize, value: T) {
        assert!(
            k < self.count && check(self.pointer, self.count, self.name).is_ok(),
            "the places must be checked first"
        );
        // SAFETY: the pointer is aligned and not null. By the contract of `new`, the pointer points
        // to more than k places.
        unsafe { self.pointer.add(k).write(value) };
    }
}

impl Text {
    /// # Safety
    /// While this value lives, `pointer` is null or points to a text that ends with a zero, and no
    /// thread writes it. A text without a zero must have at least `LONGEST_TEXT` bytes.
    pub(crate) unsafe fn new(pointer: *const c_char, name: &'static str) -> Self {
        Self { pointer, name }
    }

    /// Returns the text. Fails if the text is not UTF-8 or has no zero within `LONGEST_TEXT` bytes.
    pub(crate) fn get(&self) -> Result<String, Fault> {
        check(self.pointer, 1, self.name)?;
        let mut bytes = Vec::new();
        for k in 0..LONGEST_TEXT {
            // SAFETY: the bytes before this one were not zero, so by the contract of `new` this
            // byte belongs to the text.
            let byte = unsafe { self.pointer.add(k).read() } as u8;
            if byte == 0 {
                return String::from_utf8(bytes).map_err(|_| Fault::value(format!("{} is not UTF-8", self.name)));
            }
            bytes.push(byte);
        }
        Err(Fault::value(format!("{} is longer than {LONGEST_TEXT} bytes", self.name)))
    }
}

#[inline]
fn check<T>(pointer: *const T, count: usize, name: &str) -> Result<(), Fault> {
    let is_there = !pointer.is_null() && pointer.is_aligned() && count <= isize::MAX as usize / size_of::<T>();
    if is_there || count == 0 { Ok(()) } else { Err(what_is_wrong(pointer, count, name)) }
}

#[cold]
fn what_is_wrong<T>(pointer: *const T, count: usize, name: &str) -> Fault {
    if pointer.is_null() {
        return Fault::new(palpus_result::PalpusErrorPointer, format!("{name} is NULL"));
    }
    if !pointer.is_aligned() {
        let text = format!("{name} is at {pointer:p}, which is not a multiple of {} bytes", align_of::<T>());
        return Fault::new(palpus_result::PalpusErrorPointer, text);
    }
    Fault::value(format!("{name} has {count} elements, more than memory can hold"))
}
