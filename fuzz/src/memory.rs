//! Measures how much memory an input uses.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The largest amount of memory that an input may use at any time: a constant plus a multiple of
/// its length.
pub struct Allowance {
    /// Bytes of memory for each byte of the input.
    pub per_byte: usize,
    /// Bytes of memory for every input.
    pub always: usize,
}

impl Allowance {
    /// Returns the limit for an input of this length, in bytes.
    pub fn of(&self, length: usize) -> usize {
        self.per_byte * length + self.always
    }
}

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// Starts a measurement of the largest memory use; returns the current use in bytes.
pub(crate) fn begin() -> usize {
    let held = HELD.load(Ordering::Relaxed);
    MOST.store(held, Ordering::Relaxed);
    held
}

/// Returns the largest memory use since [`begin`], in bytes.
pub(crate) fn most() -> usize {
    MOST.load(Ordering::Relaxed)
}

fn grown(size: usize) {
    let held = HELD.fetch_add(size, Ordering::Relaxed) + size;
    MOST.fetch_max(held, Ordering::Relaxed);
}

fn shrunk(size: usize) {
    HELD.fetch_sub(size, Ordering::Relaxed);
}

/// The allocator of the system, with a count of the allocated bytes.
struct Booking;

#[global_allocator]
static BOOKING: Booking = Booking;

// SAFETY: every call is passed unchanged to the system allocator.
unsafe impl GlobalAlloc for Booking {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grown(layout.size());
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        grown(layout.size());
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both blocks may exist at the same time.
        grown(size);
        shrunk(layout.size());
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        shrunk(layout.size());
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.dealloc(block, layout) }
    }
}
