//! The memory of a process: an allocator that counts the allocations of each thread, and large
//! pages.
//!
//! The servo path must not allocate. A program or a test that installs [`CountingAllocator`] as its
//! global allocator can check this with [`allocations_of_this_thread`].
#![allow(unsafe_code)] // `GlobalAlloc` is an unsafe trait, and memory is moved by a system call.

mod large_pages;

pub use large_pages::{Extent, use_large_pages};

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system allocator, with a count of the calls that allocate. Calls that free memory are not
/// counted.
pub struct CountingAllocator;

/// Returns the number of allocations of this thread since it began. Returns 0 unless
/// [`CountingAllocator`] is the program's global allocator.
pub fn allocations_of_this_thread() -> u64 {
    ALLOCATIONS.try_with(Cell::get).unwrap_or(0)
}

fn count() {
    // While a thread ends, its counter no longer exists. Such a thread runs no servo loop.
    let _ = ALLOCATIONS.try_with(|n| n.set(n.get() + 1));
}

// SAFETY: every call is passed unchanged to the system allocator. The counter is a thread-local
// Cell with a const initialiser, which does not allocate.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller fulfils the contract of the system allocator.
        unsafe { System.dealloc(block, layout) }
    }
}
