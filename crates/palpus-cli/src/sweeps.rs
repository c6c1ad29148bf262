//! The two sweeps of `palpus inspect --sweeps`, as text with histograms or as JSON.

use std::sync::Arc;

use palpus::body::Body;
use palpus_scenes::sweep::{
    CORRECT_RATIO, DepthErrors, PUSHED_SHARE, PopThrough, RATIO_ENDS, depth_errors, pop_through,
};
use serde::Serialize;

use crate::output;

/// Seed of the samples. Every call uses the same samples.
const SEED: u64 = 0x2002_0809;
/// Number of characters of a histogram's longest bar.
const BAR: usize = 40;

/// Sweeps in the document of `--json`; shares are from 0 to 1, angles in degrees.
#[derive(Serialize)]
pub(crate) struct Sweeps {
    pop_through: Pushes,
    depth_errors: Depths,
}

#[derive(Serialize)]
struct Pushes {
    samples: usize,
    /// Share of the distance to the opposite wall up to which probes are pushed.
    pushed_share: f64,
    held: f64,
    grew: f64,
    /// Histogram of the pushes over the share of the distance at which they lost contact, in equal
    /// bins. The last entry counts pushes that did not lose contact.
    lost_in: Vec<usize>,
}

#[derive(Serialize)]
struct Depths {
    samples: usize,
    unseen: f64,
    error_median: f64,
    error_p90: f64,
    turn_median_deg: f64,
    turn_p90_deg: f64,
    beyond: f64,
    worst_ratio: f64,
    /// Number of points without contact, then a histogram of the depth as a multiple of the true
    /// distance.
    ratio_in: Vec<usize>,
}

impl Sweeps {
    /// Sweeps a closed body.
    pub(crate) fn of(body: &Arc<Body>, samples: usize) -> Self {
        let PopThrough { samples: pushes, held, grew, lost_in } = PopThrough::of(&pop_through(body, samples, SEED));
        let errors = DepthErrors::of(&depth_errors(body, samples, SEED));
        let pop_through = Pushes { samples: pushes, pushed_share: PUSHED_SHARE, held, grew, lost_in: lost_in.to_vec() };
        let depth_errors = Depths {
            samples: errors.samples,
            unseen: errors.unseen,
            error_median: errors.error[0],
            error_p90: errors.error[1],
            turn_median_deg: errors.turn[0].to_degrees(),
            turn_p90_deg: errors.turn[1].to_degrees(),
            beyond: errors.beyond,
            worst_ratio: errors.worst,
            ratio_in: errors.ratio_in.to_vec(),
        };
        Self { pop_through, depth_errors }
    }

    /// Prints both sweeps.
    pub(crate) fn tell(&self) {
        let Self { pop_through: pushes, depth_errors: depths } = self;
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        output::line(format!(
            "{:>15}  {} pushes to {} of the way to the opposite wall: contact persists in {}, the depth grows correctly in {}",
            "pop-through",
            pushes.samples,
            percent(pushes.pushed_share),
            percent(pushes.held),
            percent(pushes.grew),
        ));
        let bins = pushes.lost_in.len() - 1;
        let lost_at = |k: usize| {
            if k == bins {
                "not lost".to_owned()
            } else {
                format!("lost from {:.0} %", 100.0 * PUSHED_SHARE * k as f64 / bins as f64)
            }
        };
        histogram(&pushes.lost_in, lost_at);
        output::line(format!(
            "{:>15}  {} points inside: error of the depth {} (median), {} (p90); of the direction {:.2}° and {:.2}°; without contact {}; \
             above {CORRECT_RATIO} times the true distance {}, at most {:.2}",
            "depth errors",
            depths.samples,
            percent(depths.error_median),
            percent(depths.error_p90),
            depths.turn_median_deg,
            depths.turn_p90_deg,
            percent(depths.unseen),
            percent(depths.beyond),
            depths.worst_ratio,
        ));
        let ratio = |k: usize| match k {
            0 => "no contact".to_owned(),
            k if RATIO_ENDS[k - 1].is_finite() => format!("up to {} times", RATIO_ENDS[k - 1]),
            _ => "more".to_owned(),
        };
        histogram(&depths.ratio_in, ratio);
    }
}

fn histogram(counts: &[usize], name: impl Fn(usize) -> String) {
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    for (k, &count) in counts.iter().enumerate() {
        let bar = "█".repeat((count * BAR).div_ceil(most));
        output::line(format!("{:>15}  {:>16} {count:>6} {bar}", "", name(k)));
    }
}
