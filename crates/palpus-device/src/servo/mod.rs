//! The servo loop.
//!
//! Once a tick, at 1 kHz unless told otherwise:
//!
//! 1. wait for the tick's deadline (real time) or don't (simulated time);
//! 2. read the device's state; one that is not finite is counted, answered with zero, and otherwise left out;
//! 3. run the step, which answers a wrench; a panic in it becomes a zero wrench and the named end of the run;
//! 4. a wrench that is not finite becomes zero and is counted;
//! 5. write the wrench to the device;
//! 6. account: times, energy, largest values; let the observer see the tick.
//!
//! Deadlines are absolute, so lateness does not add up; a loop that is late by whole periods skips them, keeps its
//! phase and counts them, rather than firing a burst of ticks. Whatever ends the loop — its duration, the stop flag, the
//! device, a panic in the step, the observer or the device — the last wrench written is zero. The loop does not
//! allocate.
//!
//! The step is always given the nominal period: what a run computes then depends on what it was fed, not on the
//! scheduler, and can be replayed bit for bit.

mod pace;
mod statistics;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use palpus::algebra::Wrench;

use crate::device::{DeviceError, DeviceState, HapticDevice};
use pace::Pace;
use statistics::Tally;

pub use statistics::{Energy, Faults, Percentiles, RunEnd, RunStatistics};

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
    /// In real time: how long before a deadline to stop sleeping and spin.
    pub spin: Duration,
}

impl Default for ServoOptions {
    /// 1 kHz, real time, without end, spinning for the last 200 µs.
    fn default() -> Self {
        Self { rate_hz: 1000.0, timing: Timing::RealTime, duration: None, spin: Duration::from_micros(200) }
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
}

/// What a step answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOutcome<T = ()> {
    /// For the device: about the grip's origin, in the device's frame.
    pub wrench: Wrench,
    /// The wrench was cut to the device's limits.
    pub saturated: bool,
    /// For the observer: whatever else the step found out.
    pub detail: T,
}

impl StepOutcome {
    /// A wrench and nothing else.
    pub fn of(wrench: Wrench) -> Self {
        Self { wrench, saturated: false, detail: () }
    }
}

/// What happened in one turn of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoTick {
    /// 0, 1, 2, …
    pub index: u64,
    /// Index times the nominal period, s.
    pub time: f64,
    /// What was read.
    pub state: DeviceState,
    /// What was written.
    pub wrench: Wrench,
    /// The step said that it cut the wrench.
    pub saturated: bool,
    /// The step's wrench was not finite and zero was written instead.
    pub replaced: bool,
    /// Wall time of the step, s.
    pub step_s: f64,
    /// How long after its deadline the tick began, s; 0 in simulated time.
    pub lateness_s: f64,
    /// The wrench was written more than a period after the tick was due.
    pub overrun: bool,
}

/// Sees every tick, on the servo thread, after the wrench was written: must be quick and must not allocate.
pub trait TickObserver<T = ()> {
    /// `detail` is what the step answered beside its wrench.
    fn observe(&mut self, tick: &ServoTick, detail: &T);
}

impl<T, F: FnMut(&ServoTick, &T)> TickObserver<T> for F {
    fn observe(&mut self, tick: &ServoTick, detail: &T) {
        self(tick, detail);
    }
}

/// Nobody looks.
impl<T> TickObserver<T> for () {
    fn observe(&mut self, _: &ServoTick, _: &T) {}
}

/// The loop and all the memory it needs.
#[derive(Debug)]
pub struct Servo {
    options: ServoOptions,
    tally: Tally,
}

impl Servo {
    /// A loop that will run as `options` say.
    ///
    /// # Errors
    /// When an option is out of range.
    pub fn new(options: ServoOptions) -> Result<Self, ServoError> {
        if !(1.0..=100_000.0).contains(&options.rate_hz) {
            return Err(ServoError::Rate(options.rate_hz));
        }
        if let Some(duration) = options.duration.filter(|duration| !(*duration >= 0.0 && duration.is_finite())) {
            return Err(ServoError::Duration(duration));
        }
        Ok(Self { options, tally: Tally::new() })
    }

    /// Runs on the calling thread until the duration is over, `stop` is set, the device ends or something fails; the last
    /// wrench written to `device` is zero.
    pub fn run<D, T, S, O>(&mut self, device: &mut D, mut step: S, observer: &mut O, stop: &AtomicBool) -> RunStatistics
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&DeviceState, f64) -> StepOutcome<T>,
        O: TickObserver<T> + ?Sized,
    {
        let ServoOptions { rate_hz, timing, duration, spin } = self.options;
        let period = 1.0 / rate_hz;
        let ticks = duration.map_or(u64::MAX, |seconds| (seconds * rate_hz).round() as u64);
        let mut device = ZeroAtEnd { device, written: false };
        self.tally.restart();
        let mut pace = Pace::start(timing, period, spin);
        let mut index = 0;
        let mut end = loop {
            if index >= ticks {
                break RunEnd::Duration;
            }
            if stop.load(Ordering::Relaxed) {
                break RunEnd::Stopped;
            }
            let start = pace.wait();
            self.tally.start_of_tick(&start);
            let state = match device.device.read() {
                Ok(state) => state,
                Err(DeviceError::Ended) => break RunEnd::DeviceEnded,
                Err(error) => break RunEnd::DeviceFailed(error),
            };
            if !is_finite(&state) {
                // Nothing can be computed from it, and what was written last must not go on pushing.
                if let Err(error) = device.device.write(&Wrench::ZERO) {
                    break RunEnd::DeviceFailed(error);
                }
                self.tally.invalid_state();
                index += 1;
                continue;
            }
            let before = Instant::now();
            let outcome = catch_unwind(AssertUnwindSafe(|| step(&state, period)));
            let elapsed = before.elapsed();
            let StepOutcome { wrench, saturated, detail } = match outcome {
                Ok(outcome) => outcome,
                Err(panic) => break RunEnd::Panicked(message(panic.as_ref())),
            };
            let replaced = !wrench.is_finite();
            let wrench = if replaced { Wrench::ZERO } else { wrench };
            if let Err(error) = device.device.write(&wrench) {
                break RunEnd::DeviceFailed(error);
            }
            let tick = ServoTick {
                index,
                time: index as f64 * period,
                state,
                wrench,
                saturated,
                replaced,
                step_s: elapsed.as_secs_f64(),
                lateness_s: start.lateness.as_secs_f64(),
                overrun: start.skipped > 0 || pace.is_overrun(),
            };
            self.tally.end_of_tick(&tick);
            observer.observe(&tick, &detail);
            index += 1;
        };
        if let Err(error) = device.finish()
            && !matches!(end, RunEnd::DeviceFailed(_) | RunEnd::Panicked(_))
        {
            end = RunEnd::DeviceFailed(error);
        }
        self.tally.finish(end, timing, period, pace.elapsed())
    }
}

/// Writes zero to the device at the end of the run, and also when something unwinds through the loop.
struct ZeroAtEnd<'a, D: HapticDevice + ?Sized> {
    device: &'a mut D,
    written: bool,
}

impl<D: HapticDevice + ?Sized> ZeroAtEnd<'_, D> {
    fn finish(&mut self) -> Result<(), DeviceError> {
        self.written = true;
        self.device.write(&Wrench::ZERO)
    }
}

impl<D: HapticDevice + ?Sized> Drop for ZeroAtEnd<'_, D> {
    fn drop(&mut self) {
        if !self.written {
            // There is no one left to tell: the panic that brought us here is on its way.
            let _ = self.device.write(&Wrench::ZERO);
        }
    }
}

fn is_finite(state: &DeviceState) -> bool {
    state.pose.is_valid() && state.twist.linear.is_finite() && state.twist.angular.is_finite()
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("a panic without a message").to_owned()
}

#[cfg(test)]
mod tests;
