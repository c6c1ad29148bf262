//! The times of the engine step along stretches of coherent motion.

use palpus::algebra::{Pose, WallClock};
use palpus::render::{ProbeState, Renderer};
use serde::Serialize;

use super::Bodies;
use crate::bench::{TICK, settings, use_large_pages};
use crate::summary::Micros;

/// Times of the steps of a motion.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Times {
    /// Number of timed ticks.
    pub(super) ticks: usize,
    /// Mean number of contacts in a tick.
    pub(super) contacts: f64,
    #[serde(flatten)]
    pub(super) micros: Micros,
}

/// Times the step along stretches of coherent motion. The renderer is cleared before each stretch.
/// The first tick of a stretch places the probe and is not counted. For each tick, the smallest
/// time of all passes is kept.
pub(super) fn time(bodies: &Bodies, stretches: &[Vec<Pose>], tolerance: f64, passes: u32) -> anyhow::Result<Times> {
    let mut renderer = Renderer::new(bodies.a.clone(), bodies.b.clone(), settings(tolerance))?;
    use_large_pages();
    let clock = WallClock::new();
    let (mut times, mut contacts) = (Vec::new(), 0.0);
    for stretch in stretches {
        let begin = times.len();
        for pass in 0..passes {
            renderer.clear();
            for (k, pose) in stretch.iter().enumerate() {
                let tick = renderer.step(&ProbeState::at(*pose), TICK, &clock);
                if k == 0 {
                    continue;
                }
                let micros = tick.times.total as f64 / 1e3;
                if pass == 0 {
                    times.push(micros);
                    contacts += tick.contacts.len() as f64;
                } else {
                    let least = &mut times[begin + k - 1];
                    *least = least.min(micros);
                }
            }
        }
    }
    Ok(summary(times, contacts))
}

fn summary(times: Vec<f64>, contacts: f64) -> Times {
    let ticks = times.len();
    Times { ticks, contacts: contacts / ticks.max(1) as f64, micros: Micros::of(times.into_iter()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_the_sorted_times() {
        let times = summary((1..=1000).rev().map(f64::from).collect(), 2000.0);
        assert_eq!((times.ticks, times.contacts), (1000, 2.0));
        let Micros { p50, p99, p999, max } = times.micros;
        assert_eq!((p50, p99, p999, max), (500.0, 990.0, 999.0, 1000.0));
        assert_eq!(summary(Vec::new(), 0.0).micros.max, 0.0);
    }
}
