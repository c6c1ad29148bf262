//! Positions and labels of the ticks of an axis.

use std::ops::Range;

use crate::numbers::grouped;

/// A tick: its position on the axis, and its label.
pub(super) struct Tick {
    pub(super) at: f64,
    pub(super) label: String,
}

/// Returns about `wanted` ticks at round numbers.
pub(super) fn even(range: &Range<f64>, wanted: usize) -> Vec<Tick> {
    let raw = (range.end - range.start) / wanted.max(1) as f64;
    if !(raw > 0.0 && raw.is_finite()) {
        return Vec::new();
    }
    let power = 10f64.powf(raw.log10().floor());
    let step = STEPS.into_iter().find(|(times, _)| times * power >= raw * 0.999);
    let (times, digits) = step.unwrap_or((10.0, 0.0));
    let step = times * power;
    let decimals = (digits - (step.log10() + 1e-9).floor()).max(0.0) as usize;
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    let tick = |k: i64| {
        let at = k as f64 * step;
        Tick { at, label: grouped(&format!("{at:.decimals$}")) }
    };
    (first..=last).map(tick).collect()
}

/// Steps between ticks (mantissas), each with its number of digits after the first: 1 for 2.5.
const STEPS: [(f64, f64); 5] = [(1.0, 0.0), (2.0, 0.0), (2.5, 1.0), (5.0, 0.0), (10.0, 0.0)];

/// Returns the ticks of a logarithmic axis: powers of ten, and 2 and 5 times them if the axis spans
/// few decades.
pub(super) fn powers(range: &Range<f64>) -> Vec<Tick> {
    let decades = range.end - range.start;
    if !decades.is_finite() {
        return Vec::new();
    }
    let (factors, stride): (&[f64], i32) = match decades {
        _ if decades <= FEW_DECADES => (&[1.0, 2.0, 5.0], 1),
        _ if decades <= MANY_DECADES => (&[1.0], 1),
        _ => (&[1.0], (decades / MANY_DECADES).ceil() as i32),
    };
    let (first, last) = (range.start.floor() as i32, range.end.ceil() as i32);
    let mut ticks = Vec::new();
    for power in (first..=last).step_by(stride.unsigned_abs() as usize) {
        for factor in factors {
            let value = factor * 10f64.powi(power);
            let at = value.log10();
            if (range.start..=range.end).contains(&at) {
                ticks.push(Tick { at, label: short(value) });
            }
        }
    }
    ticks
}

/// With at most this many decades, the ticks at 2 and 5 fit between the powers of ten.
const FEW_DECADES: f64 = 3.0;
/// With more decades than this, only every second (third, …) power of ten has a tick.
const MANY_DECADES: f64 = 9.0;

/// Formats the number with its SI prefix, such as `k` for thousands.
fn short(value: f64) -> String {
    match value {
        _ if value >= 0.999e6 => format!("{} M", value / 1e6),
        _ if value >= 0.999e4 => format!("{:.0} k", value / 1e3),
        _ if value >= 0.999 => format!("{value:.0}"),
        _ => format!("{:.*}", (-(value.log10() + 1e-9).floor()).max(0.0) as usize, value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.label.as_str()).collect()
    }

    #[test]
    fn ticks_are_round_and_within_the_axis() {
        assert_eq!(labels(&even(&(0.0..10.0), 5)), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(&even(&(-0.3..0.3), 5)), ["−0.2", "0", "0.2"]);
        assert_eq!(labels(&even(&(0.0..42_000.0), 4)), ["0", "20\u{202f}000", "40\u{202f}000"]);
        assert_eq!(labels(&even(&(-52.0..55.0), 5)), ["−50", "−25", "0", "25", "50"]);
        assert_eq!(labels(&even(&(0.0..0.01), 4)), ["0", "0.0025", "0.0050", "0.0075", "0.0100"]);
        assert!(even(&(1.0..1.0), 5).is_empty() && even(&(0.0..f64::NAN), 5).is_empty());
    }

    #[test]
    fn powers_of_ten_have_labels() {
        assert_eq!(labels(&powers(&(0.9..2.1))), ["10", "20", "50", "100"]);
        assert_eq!(labels(&powers(&(-1.0..0.5))), ["0.1", "0.2", "0.5", "1", "2"]);
        assert_eq!(labels(&powers(&(2.9..6.1))), ["1000", "10 k", "100 k", "1 M"]);
        assert!(powers(&(-30.0..30.0)).len() < 12);
    }
}
