//! Measures how late the system wakes a bare loop with absolute deadlines.

use std::time::Duration;

use anyhow::anyhow;
use palpus::algebra::quantile_of_sorted;
use palpus_device::{LATE, LoopTime, RealTimeClaims, RealTimeOptions, ServoOptions, WallTime, claim};
use serde::Serialize;

/// Lateness of the wake-ups, µs, as percentiles.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Timer {
    pub(super) turns: usize,
    pub(super) p50_us: f64,
    pub(super) p99_us: f64,
    pub(super) p999_us: f64,
    pub(super) max_us: f64,
    /// Share of the wake-ups that were more than half a millisecond late.
    pub(super) late_share: f64,
}

impl Timer {
    pub(super) fn in_words(&self) -> String {
        let Self { turns, p50_us, p99_us, p999_us, max_us, late_share } = self;
        format!(
            "late by {p50_us:.1} µs (median), {p99_us:.1} µs (p99), {p999_us:.1} µs (p99.9), {max_us:.0} µs (largest); \
             {:.2} % of {turns} wake-ups by over 0.5 ms",
            late_share * 100.0
        )
    }
}

/// Runs the bare loop for `duration` seconds on its own thread, with the real-time rights that
/// `palpus run` requests.
pub(super) fn measure(duration: f64, rate_hz: f64) -> anyhow::Result<(Timer, Option<RealTimeClaims>)> {
    let (lateness, claims) = lateness(duration, rate_hz, Some(RealTimeOptions::default()))?;
    Ok((of(lateness), claims))
}

/// Returns the lateness of each wake-up of a bare loop, ns, and the real-time rights that the
/// system granted.
pub(crate) fn lateness(
    duration: f64,
    rate_hz: f64,
    options: Option<RealTimeOptions>,
) -> anyhow::Result<(Vec<u64>, Option<RealTimeClaims>)> {
    let turns = (duration * rate_hz).round() as usize;
    let thread = std::thread::Builder::new().name("timer".to_owned()).spawn(move || {
        // Touches every page once, so that the loop has no page faults.
        let mut lateness = vec![1; turns];
        lateness.clear();
        let claims = options.as_ref().map(claim);
        run(turns, rate_hz, &mut lateness);
        (lateness, claims)
    })?;
    thread.join().map_err(|_| anyhow!("the measuring thread failed; please report this"))
}

fn run(turns: usize, rate_hz: f64, lateness: &mut Vec<u64>) {
    let time = WallTime::new();
    let period = Duration::from_secs_f64(1.0 / rate_hz);
    // The bare loop spins as long as the servo loop does.
    let spin = ServoOptions::default().spin.min(period / 2);
    let mut deadline = time.now() + period;
    for _ in 0..turns {
        time.wait_until(deadline, spin);
        let late = time.now().saturating_sub(deadline);
        lateness.push(late.as_nanos() as u64);
        // Skips whole missed periods, as the servo loop does.
        let skipped = (late.as_nanos() / period.as_nanos()) as u32;
        deadline += period * (skipped + 1);
    }
}

pub(super) fn of(mut lateness: Vec<u64>) -> Timer {
    let turns = lateness.len();
    lateness.sort_unstable();
    let at = |share: f64| quantile_of_sorted(&lateness, share).map_or(0.0, |ns| ns as f64 / 1e3);
    let late = lateness.iter().filter(|ns| u128::from(**ns) > LATE.as_nanos()).count();
    Timer {
        turns,
        p50_us: at(0.5),
        p99_us: at(0.99),
        p999_us: at(0.999),
        max_us: at(1.0),
        late_share: late as f64 / turns.max(1) as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_refer_to_all_turns() {
        let timer = of((1..=1000).rev().map(|us| us * 1000).collect());
        assert_eq!((timer.p50_us, timer.p99_us, timer.p999_us, timer.max_us), (500.0, 990.0, 999.0, 1000.0));
        assert!((timer.late_share - 0.5).abs() < 1e-12);
        assert_eq!(of(Vec::new()).turns, 0);
    }
}
