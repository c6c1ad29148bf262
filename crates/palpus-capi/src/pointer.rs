//! Pointers that come from C: checked for what can be checked, then copied through.

use std::ffi::c_char;

use crate::result::{Fault, palpus_result};

/// A value to be read.
pub(crate) struct In<T> {
    array: InArray<T>,
}

/// Values to be read.
pub(crate) struct InArray<T> {
    pointer: *const T,
    count: usize,
    name: &'static str,
}

/// A place to be written.
pub(crate) struct Out<T> {
    array: OutArray<T>,
}

/// Places to be written.
pub(crate) struct OutArray<T> {
    pointer: *mut T,
    count: usize,
    name: &'static str,
}

/// A text that ends with a zero.
pub(crate) struct Text {
    pointer: *const c_char,
    name: &'static str,
}

/// Bytes of the longest text that is taken: without an end, memory of others would be read.
const LONGEST_TEXT: usize = 1 << 15;

impl<T: Copy> In<T> {
    /// # Safety
    /// As [`InArray::new`], of one value.
    pub(crate) unsafe fn new(pointer: *const T, name: &'static str) -> Self {
        // SAFETY: the caller's.
        Self { array: unsafe { InArray::new(pointer, 1, name) } }
    }

    /// The value.
    pub(crate) fn get(&self) -> Result<T, Fault> {
        self.array.check()?;
        Ok(self.array.at(0))
    }

    /// The value; `None` for NULL.
    pub(crate) fn get_if_any(&self) -> Result<Option<T>, Fault> {
        if self.array.pointer.is_null() { Ok(None) } else { self.get().map(Some) }
    }
}

impl<T: Copy> InArray<T> {
    /// # Safety
    /// While this lives, `pointer` is null, is misaligned, or points to `count` values that no
    /// thread writes. Every bit pattern of `T` is a value.
    pub(crate) unsafe fn new(pointer: *const T, count: usize, name: &'static str) -> Self {
        Self { pointer, count, name }
    }

    /// Fails unless the values can be there.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        check(self.pointer, self.count, self.name)
    }

    /// The values in order. Only after [`Self::check`].
    pub(crate) fn iter(&self) -> impl Iterator<Item = T> {
        (0..self.count).map(|k| self.at(k))
    }

    fn at(&self, k: usize) -> T {
        assert!(k < self.count && check(self.pointer, self.count, self.name).is_ok(), "values that were not checked");
        // SAFETY: the pointer is aligned, not null, and by the contract of `new` points to more
        // than k values.
        unsafe { self.pointer.add(k).read() }
    }
}

impl<T> Out<T> {
    /// # Safety
    /// As [`OutArray::new`], of one place.
    pub(crate) unsafe fn new(pointer: *mut T, name: &'static str) -> Self {
        // SAFETY: the caller's.
        Self { array: unsafe { OutArray::new(pointer, 1, name) } }
    }

    /// Fails unless the place can be there: before work whose answer would be lost.
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
    /// While this lives, `pointer` is null, is misaligned, or points to `count` places that no
    /// other code reads or writes.
    pub(crate) unsafe fn new(pointer: *mut T, count: usize, name: &'static str) -> Self {
        Self { pointer, count, name }
    }

    /// Fails unless the places can be there.
    pub(crate) fn check(&self) -> Result<(), Fault> {
        check(self.pointer, self.count, self.name)
    }

    /// Fails unless the places can be there, or NULL was given for none.
    pub(crate) fn check_if_any(&self) -> Result<(), Fault> {
        if self.pointer.is_null() { Ok(()) } else { self.check() }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        if self.pointer.is_null() { 0 } else { self.count }
    }

    /// Writes a value. Only after a check.
    pub(crate) fn put(&self, k: usize, value: T) {
        assert!(k < self.count && check(self.pointer, self.count, self.name).is_ok(), "places that were not checked");
        // SAFETY: the pointer is aligned, not null, and by the contract of `new` points to more
        // than k places.
        unsafe { self.pointer.add(k).write(value) };
    }
}

impl Text {
    /// # Safety
    /// While this lives, `pointer` is null or points to bytes up to a zero, or to `LONGEST_TEXT` of
    /// them, and no thread writes them.
    pub(crate) unsafe fn new(pointer: *const c_char, name: &'static str) -> Self {
        Self { pointer, name }
    }

    /// The text, which must be UTF-8.
    pub(crate) fn get(&self) -> Result<String, Fault> {
        check(self.pointer, 1, self.name)?;
        let mut bytes = Vec::new();
        for k in 0..LONGEST_TEXT {
            // SAFETY: the bytes before this one were not zero, and by the contract of `new` the
            // text goes on.
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
        let text = format!("{name} is at {pointer:p}, which is no multiple of {} bytes", align_of::<T>());
        return Fault::new(palpus_result::PalpusErrorPointer, text);
    }
    Fault::value(format!("{name} has {count} elements, more than memory can hold"))
}
