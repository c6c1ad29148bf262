//! Functions for tests with their own loop: the time of a tick, and a measure of oscillation.

use glam::DVec3;
use palpus_device::DeviceState;

use crate::closed_loop::TICK;

/// Returns the time since the previous state, s; `last` is the time of that state. Returns the
/// nominal period if the time has not advanced, for example at the first state.
pub(crate) fn elapsed(state: &DeviceState, last: &mut f64) -> f64 {
    let dt = if state.time > *last { state.time - *last } else { TICK };
    *last = state.time;
    dt
}

/// Returns the root mean square of the force above 10 Hz relative to the mean force, and the mean
/// force (N). The high-pass filter subtracts a running mean over a tenth of a second.
pub(crate) fn cycle(forces: &[DVec3]) -> (f64, f64) {
    const WINDOW: usize = 101;
    let mean = forces.iter().sum::<DVec3>().length() / forces.len() as f64;
    let squares = forces
        .windows(WINDOW)
        .map(|window| (window[WINDOW / 2] - window.iter().sum::<DVec3>() / WINDOW as f64).length_squared());
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
    ((sum / f64::from(count)).sqrt() / mean, mean)
}
