// The numbers of a stand-in library. Included by it.

use std::sync::atomic::{AtomicU64, Ordering};

#[allow(dead_code, reason = "each stand-in uses its own of them")]
mod keys {
    include!("keys.rs");
}
use keys::*;

static VALUES: [AtomicU64; SLOTS] = [const { AtomicU64::new(0) }; SLOTS];

/// Processes that cannot call in set the numbers by a variable: `0=1,6=0.01`.
fn begin() {
    static BEGUN: std::sync::Once = std::sync::Once::new();
    BEGUN.call_once(|| {
        for part in std::env::var("STAND_IN").unwrap_or_default().split(',') {
            if let Some((slot, value)) = part.split_once('=') {
                let value: f64 = value.parse().expect("a number");
                VALUES[slot.parse::<usize>().expect("a slot")].store(value.to_bits(), Ordering::SeqCst);
            }
        }
    });
}

fn get(slot: usize) -> f64 {
    begin();
    f64::from_bits(VALUES[slot].load(Ordering::SeqCst))
}

fn set(slot: usize, value: f64) {
    begin();
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
