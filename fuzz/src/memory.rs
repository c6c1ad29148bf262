//! How much memory an input takes.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The most that an input may hold at any time, bytes: so many for each of its own, and so many
/// whatever it is.
pub struct Allowance {
    /// For each byte of the input.
    pub per_byte: usize,
    /// Whatever the input.
    pub always: usize,
}

impl Allowance {
    /// For an input of this length.
    pub fn of(&self, length: usize) -> usize {
        self.per_byte * length + self.always
    }
}

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// Begins to watch for the most; returns what is held already.
pub(crate) fn begin() -> usize {
    let held = HELD.load(Ordering::Relaxed);
    MOST.store(held, Ordering::Relaxed);
    held
}

/// The most that was held since [`begin`].
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

/// The system's allocator, with books.
struct Booking;

#[global_allocator]
static BOOKING: Booking = Booking;

// SAFETY: every call is passed on unchanged to the system's allocator.
unsafe impl GlobalAlloc for Booking {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grown(layout.size());
        // SAFETY: the caller's contract is the system's.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        grown(layout.size());
        // SAFETY: the caller's contract is the system's.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both may be there at once.
        grown(size);
        shrunk(layout.size());
        // SAFETY: the caller's contract is the system's.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        shrunk(layout.size());
        // SAFETY: the caller's contract is the system's.
        unsafe { System.dealloc(block, layout) }
    }
}
