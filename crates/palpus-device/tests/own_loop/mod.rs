//! For loops that a test turns by itself: the time of a tick, and whether contact is at rest.

use glam::DVec3;
use palpus_device::DeviceState;

use crate::closed_loop::TICK;

/// The time since the state before, s, whose time `last` is; the nominal one where time has not
/// gone on, as at the first state.
pub(crate) fn elapsed(state: &DeviceState, last: &mut f64) -> f64 {
    let dt = if state.time > *last { state.time - *last } else { TICK };
    *last = state.time;
    dt
}

/// Root of the mean square of what is above 10 Hz, as a part of the mean, and the mean, N: a mean
/// over a tenth of a second is taken off.
pub(crate) fn cycle(forces: &[DVec3]) -> (f64, f64) {
    const WINDOW: usize = 101;
    let mean = forces.iter().sum::<DVec3>().length() / forces.len() as f64;
    let squares = forces
        .windows(WINDOW)
        .map(|window| (window[WINDOW / 2] - window.iter().sum::<DVec3>() / WINDOW as f64).length_squared());
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
    ((sum / f64::from(count)).sqrt() / mean, mean)
}
