//! The servo loop around one or several devices.
//!
//! In each tick, by default at 1 kHz, the loop takes these steps:
//!
//! 1. Wait for the tick's deadline in real time. In simulated time the loop does not wait.
//! 2. Read each device's state and pass it through the device's gate. The last valid state, at
//!    rest, replaces an invalid state.
//! 3. Run the step once, which returns a wrench for each device. A panic in the step is caught.
//! 4. Pass each wrench through the safety chain of its device ([`crate::SafetyChain`]).
//! 5. Write the resulting wrenches to the devices and notify their watchdogs.
//! 6. Record times, energy, largest values and cuts, and pass the ticks to the observer.
//!
//! **Several devices.** Each device has its own gate, safety chain, brake and watchdog. So a fault
//! removes the force of one device only.
//!
//! - If a gate does not accept a state, the step gets the device's last accepted state, at rest.
//!   Otherwise the other operators would feel a tool in a place where it never was.
//! - A lost device gets a zero wrench and its brake, and is not read again. The step continues with
//!   the device's last state, at rest.
//! - The run ends when its duration is over, when all devices are lost, when a recording of one
//!   device ends, or at a fault that must stop the run.
//! - The devices share one clock: a device that blocks the loop delays all devices.
//!
//! **Deadlines.** Deadlines are absolute, so lateness does not accumulate. A loop that is late by
//! whole periods skips and counts these periods, and keeps its phase. The loop does not make up the
//! skipped ticks.
//!
//! **The end.** However the loop ends (duration, stop flag, device, or a panic in the step, the
//! observer or the device), the last wrench written is zero. After a panic in the step, or a
//! fault that must stop the run, the loop first damps the grip for a moment. After any other end
//! the wrench goes to zero within the slew limit. The message of a panic in the step is printed
//! after the wrench is zero.
//!
//! The loop does not allocate after the first tick has begun.
//!
//! It is a fault if more than a tenth of the ticks are late, or if the machine was suspended.
//!
//! **Pauses.** A program can pause a run through its [`RunControl`]. If the device's time advances
//! only in a read, the loop stops too. The loop can then run single ticks, and later continues as
//! if there had been no pause. Any other device is held by a person: the loop keeps running, and
//! the chain removes the force until the user engages again. The run control also provides the
//! program's keys, which count as buttons of the device.
//!
//! **Replay.** The step always gets the nominal period, so the result of a run depends on its
//! inputs and not on the scheduler, and can be replayed bit for bit. The result of the safety chain
//! can also be replayed, from the recorded states, the step's wrenches and the cuts of each tick.

mod device_run;
mod line;
mod options;
mod pace;
mod punctuality;
mod quiet;
mod run_control;
mod statistics;
mod time;
mod turns;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use palpus::algebra::Wrench;
use palpus::render::Limits;

use crate::device::{DeviceState, HapticDevice};
use crate::safety::{Cuts, Phase, SafetyOptions};
use device_run::Kept;
use statistics::Tally;
use turns::Turns;

pub use options::{ServoError, ServoOptions, Timing};
pub use run_control::RunControl;
pub use statistics::{Energy, LATE, Percentiles, RunEnd, RunStatistics};
pub use time::{LoopTime, VirtualTime, WallTime};

/// Result of a step for one device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOutcome<T = ()> {
    /// Wrench for the device, about the grip's origin, in the device's frame.
    pub wrench: Wrench,
    /// True if the wrench was reduced to the device's limits.
    pub saturated: bool,
    /// True if the wrench is the first wrench with changed settings; the chain then fades from the
    /// old to the new value.
    pub changed: bool,
    /// Work that moving bodies, such as a conveyor or a falling part, did on the tool in this tick,
    /// J, by translation and by rotation. The hand may receive this energy without having put it in
    /// ([`crate::EnergyAccount::received`]).
    pub received: [f64; 2],
    /// Work that contact with the tools of other devices did on the tool in this tick, J, by
    /// translation and by rotation. Other tools can give no more energy than they have taken
    /// ([`crate::ContactAccount`]).
    pub from_others: [f64; 2],
    /// Other results of the step, for the observer.
    pub detail: T,
}

impl StepOutcome {
    /// Returns an outcome with `wrench` and default values for everything else.
    pub fn of(wrench: Wrench) -> Self {
        Self { wrench, saturated: false, changed: false, received: [0.0; 2], from_others: [0.0; 2], detail: () }
    }
}

/// Record of one device in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoTick {
    /// Number of the device in the loop, from 0.
    pub device: usize,
    /// Number of the tick, from 0.
    pub index: u64,
    /// `index` times the nominal period, s.
    pub time: f64,
    /// Input of the step: the state that was read, or the last valid state, at rest.
    pub state: DeviceState,
    /// The state as the device returned it, whether the gate accepted it or not.
    pub read: DeviceState,
    /// Wrench of the step; zero if the step panicked or was not called.
    pub computed: Wrench,
    /// Wrench that was written.
    pub wrench: Wrench,
    /// Interventions of the safety chain.
    pub cuts: Cuts,
    /// Phase of the start-up.
    pub phase: Phase,
    /// Force and torque limits of the motors in the next tick ([`crate::Shaped::available`]).
    pub available: Limits,
    /// The step reported that it reduced the wrench to the device's limits.
    pub saturated: bool,
    /// Time since the last tick began, s, used for energy, heat and slew limit. In simulated time
    /// and after a pause, this is the nominal period.
    pub elapsed_s: f64,
    /// Wall-clock time of the step, s.
    pub step_s: f64,
    /// Time from the tick's deadline to its start, s; 0 in simulated time.
    pub lateness_s: f64,
    /// True if the wrench was written more than a period after the tick was due.
    pub overrun: bool,
}

/// Receives every tick of every device. The loop calls the observer on the servo thread after all
/// wrenches of a tick were written. So an observer must be fast and must not allocate.
pub trait TickObserver<T = ()> {
    /// Receives a tick in which the step returned a result; `detail` is [`StepOutcome::detail`].
    fn observe(&mut self, tick: &ServoTick, detail: &T);

    /// Receives a tick without a result of the step. Either the step panicked
    /// ([`crate::Cut::Panic`] is among the cuts), or the loop damps the grip at the end of a run
    /// and does not call the step.
    fn unanswered(&mut self, _: &ServoTick) {}
}

impl<T, F: FnMut(&ServoTick, &T)> TickObserver<T> for F {
    fn observe(&mut self, tick: &ServoTick, detail: &T) {
        self(tick, detail);
    }
}

/// Observes nothing.
impl<T> TickObserver<T> for () {
    fn observe(&mut self, _: &ServoTick, _: &T) {}
}

/// The servo loop, with all the memory that it needs.
pub struct Servo {
    options: ServoOptions,
    control: Arc<RunControl>,
    /// State of each device that is kept from run to run.
    kept: Vec<Kept>,
}

impl Servo {
    /// Returns a loop for one device.
    ///
    /// # Errors
    /// Fails if an option is out of range.
    pub fn new(options: ServoOptions) -> Result<Self, ServoError> {
        if !(1.0..=100_000.0).contains(&options.rate_hz) {
            return Err(ServoError::Rate(options.rate_hz));
        }
        if let Some(duration) = options.duration.filter(|duration| !(*duration >= 0.0 && duration.is_finite())) {
            return Err(ServoError::Duration(duration));
        }
        Self { options, control: Arc::default(), kept: Vec::new() }.with_device(options.safety)
    }

    /// Adds a device to the loop, with its own safety chain. The loop's rate, duration and run
    /// control apply to this device too.
    ///
    /// # Errors
    /// Fails if a threshold is negative or not a number.
    pub fn with_device(mut self, safety: SafetyOptions) -> Result<Self, ServoError> {
        if safety.limits.is_some_and(|limits| !limits.is_valid()) {
            return Err(ServoError::Safety);
        }
        self.kept.push(Kept { safety, tally: Tally::new() });
        Ok(self)
    }

    /// Returns the run control, which pauses, steps and ends the loop from any thread.
    pub fn control(&self) -> Arc<RunControl> {
        Arc::clone(&self.control)
    }

    /// Runs the first device on the calling thread, until the duration is over, `stop` is set, the
    /// run control ends the run, the device ends or something fails. The last wrench written to
    /// `device` is zero.
    pub fn run<D, T, S, O>(&mut self, device: &mut D, step: S, observer: &mut O, stop: &AtomicBool) -> RunStatistics
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&DeviceState, f64) -> StepOutcome<T>,
        O: TickObserver<T> + ?Sized,
    {
        self.run_in(&WallTime::new(), device, step, observer, stop)
    }

    /// Runs the loop like [`Servo::run`], with the clock `time`.
    pub fn run_in<D, T, S, O>(
        &mut self,
        time: &dyn LoopTime,
        device: &mut D,
        mut step: S,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> RunStatistics
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&DeviceState, f64) -> StepOutcome<T>,
        O: TickObserver<T> + ?Sized,
    {
        let step = |states: &[DeviceState], dt: f64, answers: &mut [Option<StepOutcome<T>>]| {
            answers[0] = Some(step(&states[0], dt));
        };
        self.turn(time, &mut [device], step, observer, stop).remove(0)
    }

    /// Runs all devices of the loop in real time, like [`Self::run_all_in`].
    ///
    /// # Errors
    /// Fails if the number of devices differs from the number that the loop was made for.
    pub fn run_all<D, T, S, O>(
        &mut self,
        devices: &mut [&mut D],
        step: S,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> Result<Vec<RunStatistics>, ServoError>
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&[DeviceState], f64, &mut [Option<StepOutcome<T>>]),
        O: TickObserver<T> + ?Sized,
    {
        self.run_all_in(&WallTime::new(), devices, step, observer, stop)
    }

    /// Runs all devices of the loop with the clock `time`, and returns the statistics of each
    /// device.
    ///
    /// `step` gets the state of each device and the period (s), and stores its result for each
    /// device at the device's index. A device without a result gets no force. The pose of a
    /// device that has not returned a state yet is NaN.
    ///
    /// # Errors
    /// Fails if the number of devices differs from the number that the loop was made for.
    pub fn run_all_in<D, T, S, O>(
        &mut self,
        time: &dyn LoopTime,
        devices: &mut [&mut D],
        step: S,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> Result<Vec<RunStatistics>, ServoError>
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&[DeviceState], f64, &mut [Option<StepOutcome<T>>]),
        O: TickObserver<T> + ?Sized,
    {
        if devices.len() != self.kept.len() {
            return Err(ServoError::Devices { made: self.kept.len(), given: devices.len() });
        }
        Ok(self.turn(time, devices, step, observer, stop))
    }

    /// Runs the loop with at least one device, and at most as many as the loop was made for.
    fn turn<D, T, S, O>(
        &mut self,
        time: &dyn LoopTime,
        devices: &mut [&mut D],
        mut step: S,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> Vec<RunStatistics>
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&[DeviceState], f64, &mut [Option<StepOutcome<T>>]),
        O: TickObserver<T> + ?Sized,
    {
        quiet::prepare();
        let ServoOptions { rate_hz, duration, .. } = self.options;
        let most = duration.map_or(u64::MAX, |seconds| (seconds * rate_hz).round() as u64);
        let mut turns = Turns::new(&self.options, devices, &mut self.kept, &self.control, time);
        let mut count = 0;
        let end = loop {
            if count >= most {
                break RunEnd::Duration;
            }
            turns.stand(stop);
            if stop.load(Ordering::Relaxed) || turns.is_over() {
                break RunEnd::Stopped;
            }
            count += 1;
            if let ControlFlow::Break(end) = turns.turn(&mut step, observer) {
                break end;
            }
        };
        if matches!(end, RunEnd::Panicked(_) | RunEnd::Faulted(_)) {
            turns.coast(stop, observer);
        }
        turns.let_go();
        turns.finish(&end)
    }
}

#[cfg(test)]
mod tests;
