//! Tests whether the pair of bodies is heavy (too slow) for this machine.
//!
//! A run without a window is tested before it begins, by a short rehearsal. The engine follows the
//! scripted hand's path in a small part of its duration, with limited work as in the run, and the
//! hand rests several times. A pair is heavy if most contacts are extrapolated even at rest, in at
//! least two rests. One rest is not enough: at the first contact of two bodies, every pair of
//! pieces has to be measured for the first time.

use palpus::algebra::Twist;
use palpus_device::DeviceState;

use super::{Live, Plan};

/// Number of rests of the hand.
const RESTS: u32 = 9;
/// Number of ticks in which the hand moves to a rest.
const GOING: u32 = 30;
/// Number of ticks of a rest. All rests, with the motions to them, take at most a quarter of a
/// second.
const RESTING: u32 = 15;
/// Number of ticks at the end of a rest that count.
const SETTLED: u32 = 5;
/// A pair is heavy if at least this many rests end with most contacts extrapolated.
const HEAVY_RESTS: u32 = 2;
/// Time after which a scripted hand has finished its path, s.
const WAY: f64 = 10.0;

/// Share of extrapolated contacts above which a pair counts as heavy.
const HEAVY: f64 = 0.5;
/// Message for a heavy pair.
pub(super) const IN_WORDS: &str = "note: this pair is heavy for this machine: to hold the rate, most contacts are \
                                   extrapolated from tick to tick, and only some are computed in each tick. \
                                  Meshes with fewer convex pieces where they touch (`palpus inspect`) or a lower \
                                   --rate help; `palpus doctor --scene` measures it";

/// Returns the message for a heavy pair, if most contacts of a running loop are extrapolated.
pub(crate) fn words(live: &Live) -> Option<&'static str> {
    (live.carried > HEAVY).then_some(IN_WORDS)
}

/// True if the pair is heavy; see the module's description.
pub(super) fn is_heavy(plan: &Plan) -> anyhow::Result<bool> {
    let period = 1.0 / plan.rate_hz;
    let mut engine = plan.engine(&[plan.settings], false)?;
    let mut answer = [None];
    let mut step = |time: f64| {
        let pose = plan.stage.grip(plan.stage.path.pose(time));
        let state = DeviceState { pose, twist: Twist::default(), buttons: 0, time, withheld: false };
        engine.step(&[state], period, &mut answer);
        answer[0].as_ref().map_or(0.0, |answer| answer.detail.tick.carried())
    };
    let mut heavy_rests = 0;
    for rest in 0..RESTS {
        let at = |part: f64| WAY * (f64::from(rest) + part) / f64::from(RESTS);
        for tick in 0..GOING {
            step(at(f64::from(tick) / f64::from(GOING)));
        }
        let carried: Vec<f64> = (0..RESTING).map(|_| step(at(1.0))).collect();
        let at_the_end: f64 = carried.iter().rev().take(SETTLED as usize).sum();
        heavy_rests += u32::from(at_the_end > HEAVY * f64::from(SETTLED));
        if heavy_rests == HEAVY_RESTS {
            return Ok(true);
        }
    }
    Ok(false)
}
