//! Times one contender along one stretch of poses.

use std::hint::black_box;
use std::sync::OnceLock;
use std::time::Instant;

use palpus::algebra::{Pose, quantile};
use parry3d_f64::math::Pose as ParryPose;

use crate::contenders::{Contender, Place, Subject};
use crate::motions::Motion;

/// Number of rounds. The result of a pose is the time of its fastest round.
pub(crate) const ROUNDS: usize = 5;

/// Result of one contender in one case.
#[derive(Clone, Default)]
pub(crate) struct Result {
    /// Time per pose (ns), one list per stretch.
    nanoseconds: Vec<Vec<f64>>,
    /// Separation per pose, in the same order.
    pub(crate) answers: Vec<f64>,
}

impl Result {
    /// Returns the quantile `share` of the times per pose (ns).
    pub(crate) fn percentile(&self, share: f64) -> f64 {
        let mut all: Vec<f64> = self.nanoseconds.iter().flatten().copied().collect();
        quantile(&mut all, share).unwrap_or(f64::NAN)
    }
}

/// Converts the poses to the types of both engines.
pub(crate) fn places(poses: &[Pose]) -> Vec<Place> {
    let place =
        |pose: &Pose| Place { palpus: pose.placement(), parry: ParryPose::from_parts(pose.translation, pose.rotation) };
    poses.iter().map(place).collect()
}

/// Runs the contender along the poses and records the times. In the first round, also records the
/// separations.
pub(crate) fn run(
    contender: &mut Contender,
    subject: &Subject<'_>,
    motion: Motion,
    poses: &[Pose],
    result: &mut Result,
    round: usize,
    index: usize,
) {
    let skipped = usize::from(motion.is_coherent());
    let empty = clock_cost();
    contender.forget();
    let mut times = Vec::with_capacity(poses.len());
    for (k, place) in places(poses).iter().enumerate() {
        if !motion.is_coherent() {
            contender.forget();
        }
        let begin = Instant::now();
        let answer = black_box(contender.query(subject, black_box(place)));
        let time = begin.elapsed().as_nanos() as f64 - empty;
        if k >= skipped {
            times.push(time);
            if round == 0 {
                result.answers.push(answer);
            }
        }
    }
    match result.nanoseconds.get_mut(index) {
        Some(best) => best.iter_mut().zip(times).for_each(|(best, time)| *best = best.min(time)),
        None => result.nanoseconds.push(times),
    }
}

/// Returns the cost of reading the clock twice (ns).
fn clock_cost() -> f64 {
    static COST: OnceLock<f64> = OnceLock::new();
    *COST.get_or_init(|| {
        let mut costs: Vec<f64> = (0..10_001)
            .map(|k| {
                let begin = Instant::now();
                black_box(k);
                begin.elapsed().as_nanos() as f64
            })
            .collect();
        quantile(&mut costs, 0.5).unwrap_or(0.0)
    })
}
