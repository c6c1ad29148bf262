//! Measures which rates this machine holds with the scene: it compares the lateness of a bare timer
//! at each rate with the time of a step.

use comfy_table::presets::NOTHING;
use comfy_table::{CellAlignment, Table};
use serde::Serialize;

use super::scene::{PERIOD_SHARE, SceneTimes};
use super::timer::{self, Timer};

/// Rates at which devices are driven, Hz.
const RATES: [f64; 7] = [500.0, 1000.0, 2000.0, 4000.0, 5000.0, 8000.0, 10_000.0];
/// Largest share of wake-ups that may be late by more than half a period.
const MOST_LATE: f64 = 1e-2;

/// A rate, and whether it can be held.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Rate {
    pub(super) hz: f64,
    /// Lateness of a bare timer at this rate, µs.
    p50_us: f64,
    p99_us: f64,
    p999_us: f64,
    max_us: f64,
    /// Share of the timer's wake-ups that are late by more than half a period.
    late_share: f64,
    /// Time that remains for a step after the 99th percentile of the lateness, µs.
    room_us: f64,
    /// True if 99.9 % of the steps fit into `room_us`, and few enough wake-ups are late.
    pub(super) holds: bool,
    /// The reason why the rate does not hold.
    why: Option<String>,
}

/// Measures the bare timer for `seconds` at each rate, and compares the rest of the period with the
/// step time.
pub(super) fn measure(seconds: f64, scene: &SceneTimes) -> anyhow::Result<Vec<Rate>> {
    RATES
        .iter()
        .map(|&hz| {
            let half = 0.5e9 / hz;
            let (lateness, _) = timer::lateness(seconds, hz, Some(Default::default()))?;
            let late = lateness.iter().filter(|nanos| **nanos as f64 > half).count();
            let late_share = late as f64 / lateness.len().max(1) as f64;
            Ok(judge(hz, &timer::of(lateness), late_share, scene.p999_us))
        })
        .collect()
}

fn judge(hz: f64, timer: &Timer, late_share: f64, step_us: f64) -> Rate {
    let Timer { p50_us, p99_us, p999_us, max_us, .. } = *timer;
    let room_us = PERIOD_SHARE * 1e6 / hz - p99_us;
    let why = if late_share > MOST_LATE {
        Some(format!("{:.1} % of wake-ups late by over half a period", late_share * 100.0))
    } else if step_us > room_us {
        Some(format!("a step takes {step_us:.0} µs (p99.9)"))
    } else {
        None
    };
    Rate { hz, p50_us, p99_us, p999_us, max_us, late_share, room_us, holds: why.is_none(), why }
}

/// Returns the fastest rate that the machine holds.
pub(super) fn fastest(rates: &[Rate]) -> Option<f64> {
    rates.iter().filter(|rate| rate.holds).map(|rate| rate.hz).max_by(f64::total_cmp)
}

/// Returns the rates as a table, one line for each.
pub(super) fn table(rates: &[Rate]) -> Vec<String> {
    let mut table = Table::new();
    table.load_preset(NOTHING);
    table.set_header(["rate", "timer late by (p99)", "(p99.9)", "over half a period", "room for a step", "held"]);
    for rate in rates {
        let held = rate.why.as_ref().map_or("yes".to_owned(), |why| format!("no: {why}"));
        table.add_row([
            format!("{:.0} Hz", rate.hz),
            format!("{:.1} µs", rate.p99_us),
            format!("{:.0} µs", rate.p999_us),
            format!("{:.2} %", rate.late_share * 100.0),
            format!("{:.0} µs", rate.room_us.max(0.0)),
            held,
        ]);
    }
    for column in 0..5 {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.lines().map(|line| line.trim_end().to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_is_held_if_step_and_timer_fit() {
        let timer = |p99_us| Timer { p99_us, p999_us: 2.0 * p99_us, ..Timer::default() };
        let rates = [
            judge(1000.0, &timer(5.0), 0.0, 90.0),
            judge(5000.0, &timer(5.0), 0.0, 90.0),
            judge(8000.0, &timer(20.0), 0.0, 90.0),
            judge(10_000.0, &timer(5.0), 0.02, 10.0),
        ];
        assert_eq!(rates.iter().map(|rate| rate.holds).collect::<Vec<_>>(), [true, true, false, false]);
        assert_eq!(fastest(&rates), Some(5000.0));
        let table = table(&rates);
        assert!(
            table.iter().any(|line| line.contains("8000 Hz") && line.contains("no: a step takes 90 µs")),
            "{table:?}"
        );
        assert!(table.iter().any(|line| line.contains("2.0 % of wake-ups late")), "{table:?}");
        assert_eq!(fastest(&rates[2..]), None);
    }
}
