//! Estimates the rounding step of a file's coordinates from the coordinates themselves.
//!
//! A plane that is written with six digits is not exactly flat. The error of each vertex is up to
//! half a unit of the last digit. Therefore neighbouring triangles meet at small angles, and about
//! half of the edges are reflex. If the coordinates are treated as exact, a round peg of 24 000
//! triangles gives 4900 pieces. If rounding is taken into account, the peg gives one piece.
//!
//! 1. If every coordinate is a 32-bit float, the step is the spacing of 32-bit floats at the
//!    largest coordinate.
//! 2. Otherwise the coordinates are decimal numbers. A file writes them with a fixed number of
//!    decimal places or a fixed number of significant digits. Find the largest number of decimal
//!    places and the largest number of significant digits over all coordinates. Each of these
//!    numbers gives a step at the largest coordinate. The result is the larger step. If a
//!    coordinate has fifteen or more digits, the coordinates were computed, and the step is zero.
//!
//! If a person wrote the model with few digits, this step is too large. Therefore each
//! tolerance that depends on the step needs an upper limit.

use glam::DVec3;

use crate::algebra::tolerance::COMPUTED_DIGITS;

/// Returns the step between neighbouring values at the largest coordinate, in the unit of
/// `vertices`; zero if the coordinates show no rounding.
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

/// The shortest decimal number that parses to a given float.
struct Written {
    /// Number of significant digits.
    digits: i32,
    /// Exponent of the first significant digit: its place value is 10^exponent.
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
    fn the_step_follows_from_the_digits() {
        // The first line has six decimal places, and the second has six significant digits. Some
        // values need fewer digits.
        assert!((step(&[0.042578, -0.0012, 0.523117]) / 1e-6 - 1.0).abs() < 1e-9);
        assert!((step(&[15.4805, 2e-6, 0.564674, 3.0]) / 1e-4 - 1.0).abs() < 1e-9);
        assert!((step(&[f64::from(0.1_f32), 2.0]) / 2.0_f64.powi(-22) - 1.0).abs() < 1e-9);
        assert!(step(&[1.0 / 3.0, 0.5]) <= 0.0);
        assert!(step(&[0.0]) <= 0.0);
    }
}
