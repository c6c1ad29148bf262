//! Whether a pair of bodies is heavy for this machine, found out before the run begins.
//!
//! A short rehearsal: the engine follows the scripted hand's way in a small part of its time, with
//! its work bounded as in the run, and now and then the hand rests. A pair is heavy if most contacts
//! are carried even then: contacts have to be answered in every tick, moving or not.

use palpus::algebra::Twist;
use palpus_device::DeviceState;

use super::Plan;

/// Times that the hand rests.
const RESTS: u32 = 9;
/// Ticks on the way to a rest, and in it: at worst a quarter of a second in all.
const GOING: u32 = 30;
const RESTING: u32 = 15;
/// Of a rest's ticks, those at its end that count.
const SETTLED: u32 = 5;
/// s: a scripted hand is through with its way by then.
const WAY: f64 = 10.0;

/// Share of the contacts: a pair of which more are carried is heavy.
pub(super) const HEAVY: f64 = 0.5;
/// What is said of it.
pub(super) const IN_WORDS: &str = "note: this pair is heavy for this machine: to hold the rate, most contacts are carried from tick to tick and looked at \
     again in turns. What helps: meshes with fewer convex pieces where they touch (`palpus inspect`), a lower --rate; `palpus doctor --scene` measures it";

/// True if the pair is heavy; see the module's description.
pub(super) fn is_heavy(plan: &Plan) -> anyhow::Result<bool> {
    let period = 1.0 / plan.rate_hz;
    let mut engine = plan.engine(false)?;
    for rest in 1..=RESTS {
        let mut carried = 0.0;
        for tick in 0..GOING + RESTING {
            let going = f64::from(GOING - tick.min(GOING)) / f64::from(GOING);
            let time = WAY * (f64::from(rest) - going) / f64::from(RESTS);
            let pose = plan.stage.grip(plan.stage.path.pose(time));
            let state = DeviceState { pose, twist: Twist::default(), buttons: 0, time, withheld: false };
            let outcome = engine.step(&state, period);
            if tick >= GOING + RESTING - SETTLED {
                carried += outcome.detail.tick.carried() / f64::from(SETTLED);
            }
        }
        if carried > HEAVY {
            return Ok(true);
        }
    }
    Ok(false)
}
