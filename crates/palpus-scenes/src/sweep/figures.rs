//! Results of sweeps, in numbers.

use palpus::algebra::quantile;

use super::{Judged, PUSHED_SHARE, Push};

/// Bins over the share of the thickness at which contact was lost; the last is for pushes that were
/// held to the end.
pub const HELD_BINS: usize = 10;

/// Upper ends of the bins over depth as a multiple of the true distance, behind the bin of points
/// without contact.
pub const RATIO_ENDS: [f64; 8] = [0.5, 0.8, 0.9, 0.98, 1.02, 1.1, 1.25, f64::INFINITY];

/// How much more than the true distance a depth may be at most.
pub const HONEST: f64 = 1.25;

/// Results of pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PopThrough {
    /// How many pushes.
    pub samples: usize,
    /// Share of the pushes with contact from the first step to the last.
    pub held: f64,
    /// Share of the pushes whose depth grew as long as the surface behind was the nearest.
    pub grew: f64,
    /// How many pushes lost contact between k and k + 1 ninths of the way; last, those that did
    /// not.
    pub lost_in: [usize; HELD_BINS],
}

impl PopThrough {
    /// Counts pushes.
    pub fn of(pushes: &[Push]) -> Self {
        let mut lost_in = [0; HELD_BINS];
        for push in pushes {
            let bin = (push.held / PUSHED_SHARE * (HELD_BINS - 1) as f64) as usize;
            lost_in[bin.min(HELD_BINS - 1)] += 1;
        }
        Self {
            samples: pushes.len(),
            held: share(pushes, |push| push.held >= PUSHED_SHARE),
            grew: share(pushes, |push| push.grew >= push.own),
            lost_in,
        }
    }
}

/// Results of points inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Honesty {
    /// How many points.
    pub samples: usize,
    /// Share of the points without contact.
    pub unseen: f64,
    /// Median and ninth decile of the depth's relative error, 1 where there is no contact.
    pub error: [f64; 2],
    /// Median and ninth decile of the angle between the contact's normal and the shortest way out,
    /// rad.
    pub turn: [f64; 2],
    /// Share of the points with a depth of more than [`HONEST`] times the true distance.
    pub beyond: f64,
    /// The largest depth as a multiple of the true distance.
    pub worst: f64,
    /// How many points have no contact, and then a depth up to each of [`RATIO_ENDS`] times the
    /// true distance.
    pub ratio_in: [usize; RATIO_ENDS.len() + 1],
}

impl Honesty {
    /// Counts points.
    pub fn of(judged: &[Judged]) -> Self {
        let ratio = |one: &Judged| one.depth / one.distance;
        let mut ratio_in = [0; RATIO_ENDS.len() + 1];
        for one in judged {
            let bin = if one.depth <= 0.0 { 0 } else { 1 + RATIO_ENDS.partition_point(|&end| end < ratio(one)) };
            ratio_in[bin] += 1;
        }
        Self {
            samples: judged.len(),
            unseen: share(judged, |one| one.depth <= 0.0),
            error: deciles(judged.iter().map(Judged::error).collect()),
            turn: deciles(judged.iter().map(|one| one.turn).collect()),
            beyond: share(judged, |one| ratio(one) > HONEST),
            worst: judged.iter().map(ratio).fold(0.0, f64::max),
            ratio_in,
        }
    }
}

fn share<T>(all: &[T], of: impl Fn(&T) -> bool) -> f64 {
    all.iter().filter(|one| of(one)).count() as f64 / all.len().max(1) as f64
}

/// The fifth and the ninth.
fn deciles(mut all: Vec<f64>) -> [f64; 2] {
    [0.5, 0.9].map(|share| quantile(&mut all, share).unwrap_or(0.0))
}
