//! Options of the servo loop.

use std::time::Duration;

use crate::safety::SafetyOptions;

/// Real or simulated time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Timing {
    /// The loop makes one tick per period of the wall clock.
    #[default]
    RealTime,
    /// Ticks follow each other as fast as possible.
    Simulated,
}

/// Options of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoOptions {
    /// Rate of the loop, Hz.
    pub rate_hz: f64,
    /// Real or simulated time.
    pub timing: Timing,
    /// Duration of the run, s, counted in ticks; `None` runs until the run is stopped or the device
    /// ends.
    pub duration: Option<f64>,
    /// In real time: the loop sleeps until this long before a deadline, then spins. At most half a
    /// period is used.
    pub spin: Duration,
    /// Options of the safety chain.
    pub safety: SafetyOptions,
}

/// On an idle machine, a sleeping thread is woken within this time.
const SPIN: Duration = Duration::from_micros(200);

impl Default for ServoOptions {
    /// 1 kHz, real time, unlimited duration, spinning for the last 200 µs.
    fn default() -> Self {
        Self { rate_hz: 1000.0, timing: Timing::RealTime, duration: None, spin: SPIN, safety: SafetyOptions::default() }
    }
}

/// The reason why a servo loop cannot be made or run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ServoError {
    /// The rate is outside the range that a nanosecond clock can pace.
    #[error("the rate must be between 1 and 100 000 Hz, but is {0} Hz")]
    Rate(f64),
    /// The duration is negative or not finite.
    #[error("the duration must be at least 0 s, but is {0} s")]
    Duration(f64),
    /// A threshold is negative or not a number.
    #[error("every safety threshold must be a number of at least 0")]
    Safety,
    /// The number of devices differs from the number that the loop was made for.
    #[error("the loop was made for {made} devices, but got {given}: call `with_device` once for each further device")]
    Devices {
        /// Number of devices that the loop was made for.
        made: usize,
        /// Number of devices passed to the run.
        given: usize,
    },
}
