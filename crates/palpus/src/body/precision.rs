//! How finely a file's coordinates were written, read off the coordinates themselves.
//!
//! A plane written with six digits is no longer exactly flat. Its vertices are off by half a unit
//! of the last digit, its triangles bend by that error over their width, and half of the bends are
//! reflex. With exact coordinates assumed, a round peg of 24 000 triangles gives 4900 pieces; with
//! rounding taken into account, it gives one.
//!
//! 1. If every coordinate is a 32-bit float, the step is that of such floats at the largest
//!    coordinate.
//! 2. Else the coordinates are decimals. A file has a fixed number of places or a fixed number of
//!    digits; the coarser of the two, as seen on its coordinates, is the step at the largest
//!    coordinate. Fifteen digits and more are coordinates that were computed, not read: no step.
//!
//! A model written by hand with few digits seems coarser than it is, so any tolerance derived from
//! the step must be capped.

use glam::DVec3;

use crate::algebra::tolerance::COMPUTED_DIGITS;

/// The step between neighbouring values of the largest coordinates, in the unit of `vertices`; zero
/// if none shows.
pub(crate) fn coordinate_step(vertices: &[DVec3]) -> f64 {
    let coordinates = || vertices.iter().flat_map(|v| v.to_array()).filter(|x| *x != 0.0);
    let largest = coordinates().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    if coordinates().all(|x| f64::from(x as f32) == x) {
        return largest * f64::from(f32::EPSILON);
    }
    let (mut digits, mut places) = (0, 0);
    for x in coordinates() {
        let written = Written::of(x);
        if written.digits >= COMPUTED_DIGITS {
            return 0.0;
        }
        digits = digits.max(written.digits);
        places = places.max(written.digits - 1 - written.exponent);
    }
    10.0_f64.powi((-places).max(Written::of(largest).exponent - digits + 1))
}

/// The shortest decimal that reads back as a number: so many digits, the first of which counts
/// 10^exponent.
struct Written {
    digits: i32,
    exponent: i32,
}

impl Written {
    fn of(x: f64) -> Self {
        let text = format!("{:e}", x.abs());
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = mantissa.bytes().filter(u8::is_ascii_digit).count() as i32;
        Self { digits, exponent: exponent.parse().unwrap_or(0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(coordinates: &[f64]) -> f64 {
        coordinate_step(&coordinates.iter().map(|&x| DVec3::splat(x)).collect::<Vec<_>>())
    }

    #[test]
    fn the_step_is_read_off_the_digits() {
        // Six places; six digits; a few values that happen to need fewer.
        assert!((step(&[0.042578, -0.0012, 0.523117]) / 1e-6 - 1.0).abs() < 1e-9);
        assert!((step(&[15.4805, 2e-6, 0.564674, 3.0]) / 1e-4 - 1.0).abs() < 1e-9);
        assert!((step(&[f64::from(0.1_f32), 2.0]) / 2.0_f64.powi(-22) - 1.0).abs() < 1e-9);
        assert!(step(&[1.0 / 3.0, 0.5]) <= 0.0);
        assert!(step(&[0.0]) <= 0.0);
    }
}
