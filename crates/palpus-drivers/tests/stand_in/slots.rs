// The numbers of a stand-in library. Included by it.

use std::sync::atomic::{AtomicU64, Ordering};

#[allow(dead_code)]
mod keys {
    include!("keys.rs");
}
use keys::*;

static VALUES: [AtomicU64; SLOTS] = [const { AtomicU64::new(0) }; SLOTS];

fn get(slot: usize) -> f64 {
    f64::from_bits(VALUES[slot].load(Ordering::SeqCst))
}

fn set(slot: usize, value: f64) {
    VALUES[slot].store(value.to_bits(), Ordering::SeqCst);
}

fn count(slot: usize) {
    set(slot, get(slot) + 1.0);
}

#[unsafe(no_mangle)]
pub extern "C" fn stand_in_get(slot: usize) -> f64 {
    get(slot)
}

#[unsafe(no_mangle)]
pub extern "C" fn stand_in_set(slot: usize, value: f64) {
    set(slot, value);
}
