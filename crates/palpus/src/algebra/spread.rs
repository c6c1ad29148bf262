//! Numbers that are spread evenly.

const GOLDEN: f64 = 0.618_033_988_749_895;

/// Returns term `index` of a sequence in 0 to 1: the multiples of the golden ratio without their
/// integer parts. The terms of any consecutive indices are spread evenly.
pub(crate) fn spread(index: u32) -> f64 {
    (f64::from(index) * GOLDEN).fract()
}
