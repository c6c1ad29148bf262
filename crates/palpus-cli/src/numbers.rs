//! Formats numbers for people.

/// Formats a number with this many significant digits, separated thousands, and no trailing zeros.
pub(crate) fn said(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "unknown".to_owned();
    }
    if !value.is_finite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let size = value.abs().log10().floor() as i32;
    if !(SMALL..=LARGE).contains(&size) {
        return format!("{value:.*e}", digits.saturating_sub(1)).replace('-', "−");
    }
    let decimals = (digits as i32 - 1 - size).max(0) as usize;
    let text = format!("{value:.decimals$}");
    // Trailing zeros of the mantissa are removed.
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    grouped(text)
}

/// Powers of ten beyond which a number is written with an exponent.
const SMALL: i32 = -5;
const LARGE: i32 = 8;

/// Formats a count.
pub(crate) fn counted(count: u64) -> String {
    grouped(&count.to_string())
}

/// Formats a count with its noun: `1 contact`, `2 contacts`.
pub(crate) fn number_of(count: u64, one: &str) -> String {
    format!("{} {one}{}", counted(count), if count == 1 { "" } else { "s" })
}

/// Writes a true minus sign, never writes −0, and separates thousands by thin spaces from five
/// digits on.
pub(crate) fn grouped(text: &str) -> String {
    let (sign, digits) = text.strip_prefix('-').map_or(("", text), |rest| ("−", rest));
    if digits.chars().all(|c| matches!(c, '0' | '.')) {
        return "0".to_owned();
    }
    let (whole, part) = digits.split_once('.').map_or((digits, ""), |(whole, _)| (whole, &digits[whole.len()..]));
    if whole.len() < 5 {
        return format!("{sign}{digits}");
    }
    let mut grouped = String::new();
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k).is_multiple_of(3) {
            grouped.push('\u{202f}');
        }
        grouped.push(digit);
    }
    format!("{sign}{grouped}{part}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_are_printed() {
        for (value, digits, text) in [
            (0.0, 3, "0"),
            (1234.5, 3, "1234"),
            (8.0, 3, "8"),
            (0.025, 3, "0.025"),
            (800.0, 4, "800"),
            (-12_345.6, 3, "−12\u{202f}346"),
            (0.012_345, 3, "0.0123"),
            (1.2345e-7, 2, "1.2e−7"),
            (f64::INFINITY, 2, "∞"),
            (f64::NAN, 2, "unknown"),
        ] {
            assert_eq!(said(value, digits), text);
        }
        assert_eq!((counted(906_016).as_str(), number_of(1, "tick").as_str()), ("906\u{202f}016", "1 tick"));
    }
}
