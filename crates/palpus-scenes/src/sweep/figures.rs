//! Results of sweeps as numbers.

use palpus::algebra::quantile;

use super::{Judged, PUSHED_SHARE, Push};

/// Number of bins of a histogram over the fraction of the thickness at which contact was lost. The
/// last bin is for pushes that kept contact to the end.
pub const HELD_BINS: usize = 10;

/// Upper ends of the bins of a histogram over the ratio of depth and true distance. A bin for
/// points without contact comes before these bins.
pub const RATIO_ENDS: [f64; 8] = [0.5, 0.8, 0.9, 0.98, 1.02, 1.1, 1.25, f64::INFINITY];

/// Largest depth that counts as correct, as a multiple of the true distance.
pub const CORRECT_RATIO: f64 = 1.25;

/// Results of pushes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PopThrough {
    /// Number of pushes.
    pub samples: usize,
    /// Fraction of the pushes with contact from the first step to the last.
    pub held: f64,
    /// Fraction of the pushes in which the depth increased while the entered surface was nearest.
    pub grew: f64,
    /// Number of pushes that lost contact between k and k + 1 ninths of the way. The last number
    /// counts the pushes that did not lose contact.
    pub lost_in: [usize; HELD_BINS],
}

impl PopThrough {
    /// Computes the figures from the pushes.
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

/// Results of points inside the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthErrors {
    /// Number of points.
    pub samples: usize,
    /// Fraction of the points without contact.
    pub unseen: f64,
    /// Median and ninth decile of the depth's relative error. The error is 1 without contact.
    pub error: [f64; 2],
    /// Median and ninth decile of the angle between the contact's normal and the direction to the
    /// nearest surface, rad.
    pub turn: [f64; 2],
    /// Fraction of the points with a depth of more than [`CORRECT_RATIO`] times the true distance.
    pub beyond: f64,
    /// The largest depth, as a multiple of the true distance.
    pub worst: f64,
    /// Number of points without contact, and then the number of points with a depth up to each of
    /// [`RATIO_ENDS`] times the true distance.
    pub ratio_in: [usize; RATIO_ENDS.len() + 1],
}

impl DepthErrors {
    /// Computes the figures from the judged points.
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
            beyond: share(judged, |one| ratio(one) > CORRECT_RATIO),
            worst: judged.iter().map(ratio).fold(0.0, f64::max),
            ratio_in,
        }
    }
}

fn share<T>(all: &[T], of: impl Fn(&T) -> bool) -> f64 {
    all.iter().filter(|one| of(one)).count() as f64 / all.len().max(1) as f64
}

/// Returns the fifth and the ninth decile.
fn deciles(mut all: Vec<f64>) -> [f64; 2] {
    [0.5, 0.9].map(|share| quantile(&mut all, share).unwrap_or(0.0))
}
