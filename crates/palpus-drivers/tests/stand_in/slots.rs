// The numbers of a stand-in library. The stand-in includes this file.

use std::sync::atomic::{AtomicU64, Ordering};

#[allow(dead_code, reason = "each stand-in uses only some of them")]
mod keys {
    include!("keys.rs");
}
use keys::*;

static VALUES: [AtomicU64; SLOTS] = [const { AtomicU64::new(0) }; SLOTS];

/// Sets the numbers from the environment variable `STAND_IN`, such as `0=1,6=0.01`. A process uses
/// this variable if it cannot call `stand_in_set`.
fn begin() {
    static BEGUN: std::sync::Once = std::sync::Once::new();
    BEGUN.call_once(|| {
        for part in std::env::var("STAND_IN").unwrap_or_default().split(',') {
            if let Some((slot, value)) = part.split_once('=') {
                let value: f64 = value.parse().expect("the value is a number");
                VALUES[slot.parse::<usize>().expect("the slot is a number")].store(value.to_bits(), Ordering::SeqCst);
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
