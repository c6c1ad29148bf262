//! Writes doubles as text that reads back to the same bits.
//!
//! Finite numbers are written with the fewest digits that read back as the same double. The sign of
//! zero is kept; infinities are `inf` and `-inf`. NaN is `NaN` or `-NaN` (x86 produces the negative
//! NaN). A NaN with another payload is written as `NaN:` and sixteen hexadecimal digits. Python,
//! Rust and C read all of these forms except the last form.

use std::fmt::{self, Write};

/// The bits of the NaN that is written as `NaN`; for `-NaN` the sign bit is set too.
const PLAIN_NAN: u64 = 0x7FF8_0000_0000_0000;
const SIGN: u64 = 1 << 63;

/// Appends `x` to a text.
pub(crate) fn write(x: f64, out: &mut String) {
    // Writing to a String cannot fail.
    let _: fmt::Result = match x.to_bits() {
        PLAIN_NAN => out.write_str("NaN"),
        bits if bits == PLAIN_NAN | SIGN => out.write_str("-NaN"),
        bits if x.is_nan() => write!(out, "NaN:{bits:016x}"),
        _ => write!(out, "{x:?}"),
    };
}

/// Returns the double that the text stands for; `None` if the text is not a number.
pub(crate) fn read(text: &str) -> Option<f64> {
    match text {
        "NaN" | "nan" => Some(f64::from_bits(PLAIN_NAN)),
        "-NaN" | "-nan" => Some(f64::from_bits(PLAIN_NAN | SIGN)),
        _ => match text.strip_prefix("NaN:") {
            Some(bits) => u64::from_str_radix(bits, 16).ok().map(f64::from_bits).filter(|x| x.is_nan()),
            None => text.parse().ok(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_is_restored() {
        let mut cases =
            vec![0.0, -0.0, 0.1 + 0.2, 5e-324, f64::MAX, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, -f64::NAN];
        cases.push(f64::from_bits(0x7FF0_0000_0000_0001));
        // Multiples of this odd number cover all exponents (a Weyl sequence).
        cases.extend((0..20_000u64).map(|k| f64::from_bits(k.wrapping_mul(0x9E37_79B9_7F4A_7C15))));
        for x in cases {
            let mut text = String::new();
            write(x, &mut text);
            assert_eq!(read(&text).map(f64::to_bits), Some(x.to_bits()), "{text}");
        }
        for text in ["", "1,5", "NaN:", "NaN:0", "0x1", "1e"] {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
