//! The servo loop around one device or several.
//!
//! Once a tick, by default at 1 kHz:
//!
//! 1. wait for the tick's deadline (real time) or don't (simulated time);
//! 2. read each device's state and let its gate look at it; an invalid one is replaced by the last
//!    valid one, at rest;
//! 3. run the step once, which answers a wrench for each device; a panic in it is caught;
//! 4. each device's safety chain ([`crate::SafetyChain`]) makes of its wrench what the device may
//!    get;
//! 5. write that to the device, and tell its watchdog;
//! 6. account: times, energy, largest values, cuts; let the observer see the ticks.
//!
//! **Several devices.** Each has a line of its own: gate, chain, brake and watchdog know nothing of
//! the others, so that a fault takes the force from its own device only. A state that the gate
//! doubts reaches the step as the last one that it did not, at rest: the other hands would feel a
//! tool where it never was. A device that is lost gets its zero and its brake and is read no more;
//! the step goes on with its last state, at rest. The run ends when its time is over, when all
//! devices are lost, when the states of one have been played to their end, or at a fault after
//! which it must stop. The devices share the loop's time: one that keeps the loop waiting is late
//! for all.
//!
//! Deadlines are absolute, so lateness does not add up; a loop that is late by whole periods skips
//! them, keeps its phase and counts them, rather than firing a burst of ticks. Whatever ends the
//! loop — its duration, the stop flag, the device, a panic in the step, the observer or the device
//! — the last wrench written is zero. After a panic in the step, or a fault after which it is to
//! stop, it first damps the grip for a moment; else the wrench goes to zero within the slew limit.
//! The loop does not allocate once the first tick has begun. The message of a panic in the step is
//! printed after the wrench is zero.
//!
//! A loop that is late in more than a tenth of its ticks, and a machine that was suspended, are
//! faults.
//!
//! The holder of the run's [`RunControl`] may stop it for a while. With a device whose time stands
//! still between reads, the loop pauses as well, goes on by single ticks if asked to, and later as
//! if nothing had been. Any other device is in a person's hand: the loop goes round, and the chain
//! keeps the force away until engaged anew. The run control also brings the program's keys, which
//! count as buttons of the device.
//!
//! The step always gets the nominal period. The result of a run then depends on its inputs, not on
//! the scheduler, and can be replayed bit for bit. The chain's result can be, too, from the
//! recorded states, the step's wrenches and the cuts of each tick.

mod line;
mod options;
mod pace;
mod punctuality;
mod quiet;
mod run_control;
mod seat;
mod statistics;
mod time;
mod turns;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use palpus::algebra::Wrench;
use palpus::render::Limits;

use crate::device::{DeviceState, HapticDevice};
use crate::safety::{Cuts, Passivity, Phase, SafetyOptions};
use seat::Kept;
use statistics::Tally;
use turns::Turns;

pub use options::{ServoError, ServoOptions, Timing};
pub use run_control::RunControl;
pub use statistics::{Energy, LATE, Percentiles, RunEnd, RunStatistics};
pub use time::{LoopTime, VirtualTime, WallTime};

/// Answer of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOutcome<T = ()> {
    /// For the device: about the grip's origin, in the device's frame.
    pub wrench: Wrench,
    /// The wrench was cut to the device's limits.
    pub saturated: bool,
    /// It is the first one of other settings, to be blended in.
    pub changed: bool,
    /// J: what bodies that move by themselves gave the tool in this tick, by moving it and by
    /// turning it: a conveyor, a part that falls. It is energy that the hand may get without having
    /// given any ([`crate::Passivity::received`]).
    pub received: [f64; 2],
    /// J: what contact with the tools of other devices gave the tool in this tick, likewise. They
    /// may hand over what they took, and no more ([`crate::ContactAccount`]).
    pub from_others: [f64; 2],
    /// For the observer: whatever else the step found out.
    pub detail: T,
}

impl StepOutcome {
    /// A wrench and nothing else.
    pub fn of(wrench: Wrench) -> Self {
        Self { wrench, saturated: false, changed: false, received: [0.0; 2], from_others: [0.0; 2], detail: () }
    }
}

/// Record of one device in one turn of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoTick {
    /// Which of the loop's devices: 0, 1, 2, …
    pub device: usize,
    /// 0, 1, 2, …
    pub index: u64,
    /// Index times the nominal period, s.
    pub time: f64,
    /// Input of the step: the state as read, or the last valid one, at rest.
    pub state: DeviceState,
    /// The state as the device gave it, accepted or not.
    pub read: DeviceState,
    /// Wrench of the step; zero if it panicked or was not called.
    pub computed: Wrench,
    /// Wrench that was written.
    pub wrench: Wrench,
    /// Interventions of the safety chain.
    pub cuts: Cuts,
    /// Phase of the engagement.
    pub phase: Phase,
    /// Limits of the motors in the next tick: [`crate::Shaped::available`].
    pub available: Limits,
    /// The step said that it cut the wrench.
    pub saturated: bool,
    /// Since the last tick began, s: the time that energy, heat and slew limit go by. The nominal
    /// period in simulated time and after a pause.
    pub elapsed_s: f64,
    /// Wall time of the step, s.
    pub step_s: f64,
    /// How long after its deadline the tick began, s; 0 in simulated time.
    pub lateness_s: f64,
    /// The wrench was written more than a period after the tick was due.
    pub overrun: bool,
}

/// Sees every tick of every device, on the servo thread, after all wrenches were written: must be
/// quick and must not allocate.
pub trait TickObserver<T = ()> {
    /// `detail`: the step's result besides the wrench.
    fn observe(&mut self, tick: &ServoTick, detail: &T);

    /// A tick in which the step answered nothing: it panicked ([`crate::Cut::Panic`] is among the
    /// cuts), or the loop damps the grip for a moment after that or after a last fault, and did not
    /// ask it.
    fn unanswered(&mut self, _: &ServoTick) {}
}

impl<T, F: FnMut(&ServoTick, &T)> TickObserver<T> for F {
    fn observe(&mut self, tick: &ServoTick, detail: &T) {
        self(tick, detail);
    }
}

/// No observer.
impl<T> TickObserver<T> for () {
    fn observe(&mut self, _: &ServoTick, _: &T) {}
}

/// The loop and all the memory it needs.
pub struct Servo {
    options: ServoOptions,
    control: Arc<RunControl>,
    /// One for each device.
    kept: Vec<Kept>,
}

impl Servo {
    /// A loop around one device that will run as `options` say.
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
        Self { options, control: Arc::default(), kept: Vec::new() }.with_device(options.safety)
    }

    /// Adds one more device to the loop, with a safety chain of its own. Rate, duration and control
    /// are those of the loop.
    ///
    /// # Errors
    /// When a threshold is negative or not a number.
    pub fn with_device(mut self, safety: SafetyOptions) -> Result<Self, ServoError> {
        if safety.limits.is_some_and(|limits| !limits.is_valid()) {
            return Err(ServoError::Safety);
        }
        self.kept.push(Kept { safety, passivity: None, tally: Tally::new() });
        Ok(self)
    }

    /// Replaces the passivity stage in the safety chain of the device that was added last.
    #[must_use]
    pub fn with_passivity(mut self, stage: Box<dyn Passivity>) -> Self {
        if let Some(kept) = self.kept.last_mut() {
            kept.passivity = Some(stage);
        }
        self
    }

    /// Returns the run control, which pauses, steps and ends the loop from any thread.
    pub fn control(&self) -> Arc<RunControl> {
        Arc::clone(&self.control)
    }

    /// Runs the first device on the calling thread until the duration is over, `stop` is set, the
    /// control ends the run, the device ends or something fails. The last wrench written to
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

    /// Runs all devices of the loop, by the clock on the wall: see [`Self::run_all_in`].
    ///
    /// # Errors
    /// When there are not as many devices as the loop was made for.
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

    /// Runs all devices of the loop, each on a line of its own, and returns the statistics of each.
    ///
    /// `step` gets the state of each device and the period, and answers each in its place; a device
    /// without an answer gets no force. The pose of a device that has not had a state yet is not a
    /// number.
    ///
    /// # Errors
    /// When there are not as many devices as the loop was made for.
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

    /// At least one device, and no more than the loop was made for.
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
