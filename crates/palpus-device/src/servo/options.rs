//! Options of a loop.

use std::time::Duration;

use crate::safety::SafetyOptions;

/// Whose time a run keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Timing {
    /// One tick per period of the clock on the wall.
    #[default]
    RealTime,
    /// One tick after the other, as fast as they go.
    Simulated,
}

/// How to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoOptions {
    /// Ticks per second, Hz.
    pub rate_hz: f64,
    /// Real or simulated time.
    pub timing: Timing,
    /// Seconds to run, counted in ticks; `None` runs until stopped or until the device ends.
    pub duration: Option<f64>,
    /// In real time: how long before a deadline to stop sleeping and spin; at most half a period.
    pub spin: Duration,
    /// Options of the safety chain.
    pub safety: SafetyOptions,
}

/// A sleeping thread is woken within this time on an idle machine.
const SPIN: Duration = Duration::from_micros(200);

impl Default for ServoOptions {
    /// 1 kHz, real time, without end, spinning for the last 200 µs.
    fn default() -> Self {
        Self { rate_hz: 1000.0, timing: Timing::RealTime, duration: None, spin: SPIN, safety: SafetyOptions::default() }
    }
}

/// Why a servo loop cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ServoError {
    /// Not within what a clock of nanoseconds can pace.
    #[error("the rate must be between 1 and 100 000 Hz, and is {0} Hz")]
    Rate(f64),
    /// Negative or not a number.
    #[error("the duration must be positive, and is {0} s")]
    Duration(f64),
    /// A threshold is negative or not a number.
    #[error("every safety threshold must be a number from 0 up")]
    Safety,
    /// See [`super::Servo::with_device`].
    #[error("the loop was made for {made} devices and is given {given}; add a device to it for each")]
    Devices {
        /// For so many it was made.
        made: usize,
        /// So many there are.
        given: usize,
    },
}
