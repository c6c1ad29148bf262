//! The servo loop.
//!
//! Once a tick, at 1 kHz unless told otherwise:
//!
//! 1. wait for the tick's deadline (real time) or don't (simulated time);
//! 2. read the device's state and let the gate look at it; one that is none is replaced by the last one that was, at rest;
//! 3. run the step, which answers a wrench; a panic in it is caught;
//! 4. the safety chain ([`crate::SafetyChain`]) makes of it what the device may get;
//! 5. write that to the device, and tell the watchdog;
//! 6. account: times, energy, largest values, cuts; let the observer see the tick.
//!
//! Deadlines are absolute, so lateness does not add up; a loop that is late by whole periods skips them, keeps its
//! phase and counts them, rather than firing a burst of ticks. Whatever ends the loop — its duration, the stop flag, the
//! device, a panic in the step, the observer or the device — the last wrench written is zero. After a panic in the step, or a
//! fault after which it is to stop, it first damps the grip for a moment; else the wrench goes to zero within the slew limit.
//! The loop does not allocate once the first tick has begun. What a panic in the step says is told after the wrench is zero.
//!
//! A loop that is late in more than a tenth of its ticks, and a machine that was suspended, are faults.
//!
//! Whoever has the run's [`Reins`] may stop it for a while. With a device that stands still while nobody reads it, the loop does so as well, goes on
//! by single ticks if asked to, and then as if nothing had been. Any other device is held by somebody: the loop goes round, and the
//! chain keeps the force away until engaged anew. The reins also bring the program's keys, which count as buttons of the device.
//!
//! The step is always given the nominal period: what a run computes then depends on what it was fed, not on the
//! scheduler, and can be replayed bit for bit. What the chain makes of it can be, too, from the recorded states, the step's
//! wrenches and the cuts of each tick.

mod both;
mod line;
mod options;
mod pace;
mod punctuality;
mod quiet;
mod reins;
mod statistics;
mod time;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use palpus::algebra::Wrench;
use palpus::render::Limits;

use crate::device::{DeviceState, HapticDevice};
use crate::safety::{Cut, Cuts, Passivity, Phase, Shaped};
use line::Line;
use pace::{Pace, Start};
use statistics::Tally;

pub use both::{BothObserver, ToolOutcome};
pub use options::{ServoError, ServoOptions, Timing};
pub use reins::Reins;
pub use statistics::{Energy, LATE, Percentiles, RunEnd, RunStatistics};
pub use time::{LoopTime, VirtualTime, WallTime};

/// What a step answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOutcome<T = ()> {
    /// For the device: about the grip's origin, in the device's frame.
    pub wrench: Wrench,
    /// The wrench was cut to the device's limits.
    pub saturated: bool,
    /// It is the first one of other settings, to be blended in.
    pub changed: bool,
    /// J: what bodies that move by themselves gave the tool in this tick, by moving it and by turning it: a conveyor, a part that
    /// falls. It is energy that the hand may get without having given any ([`crate::Passivity::received`]).
    pub received: [f64; 2],
    /// For the observer: whatever else the step found out.
    pub detail: T,
}

impl StepOutcome {
    /// A wrench and nothing else.
    pub fn of(wrench: Wrench) -> Self {
        Self { wrench, saturated: false, changed: false, received: [0.0; 2], detail: () }
    }
}

/// What happened in one turn of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoTick {
    /// 0, 1, 2, …
    pub index: u64,
    /// Index times the nominal period, s.
    pub time: f64,
    /// What the step was given: as read, or the last state that was one, at rest.
    pub state: DeviceState,
    /// As the device gave it, believed or not.
    pub read: DeviceState,
    /// What the step answered; zero if it panicked or was not asked.
    pub computed: Wrench,
    /// What was written.
    pub wrench: Wrench,
    /// What the safety chain cut.
    pub cuts: Cuts,
    /// Where the engagement stands.
    pub phase: Phase,
    /// What the motors can give in the next tick: [`Shaped::available`].
    pub available: Limits,
    /// The step said that it cut the wrench.
    pub saturated: bool,
    /// Since the last tick began, s: the time that energy, heat and slew limit go by. The nominal period in simulated time and after a pause.
    pub elapsed_s: f64,
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

    /// A tick in which the step answered nothing: it panicked ([`Cut::Panic`] is among the cuts), or the loop damps the grip for a moment
    /// after that or after a last fault, and did not ask it.
    fn unanswered(&mut self, _: &ServoTick) {}
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
pub struct Servo {
    options: ServoOptions,
    reins: Arc<Reins>,
    passivity: Option<Box<dyn Passivity>>,
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
        if options.safety.limits.is_some_and(|limits| !limits.is_valid()) {
            return Err(ServoError::Safety);
        }
        Ok(Self { options, reins: Arc::default(), passivity: None, tally: Tally::new() })
    }

    /// With this in place of the usual passivity stage of the safety chain.
    #[must_use]
    pub fn with_passivity(mut self, stage: Box<dyn Passivity>) -> Self {
        self.passivity = Some(stage);
        self
    }

    /// By which it is paused, taken on tick by tick, and ended, from any thread.
    pub fn reins(&self) -> Arc<Reins> {
        Arc::clone(&self.reins)
    }

    /// Runs on the calling thread until the duration is over, `stop` is set or the reins say so, the device ends or something fails; the last
    /// wrench written to `device` is zero.
    pub fn run<D, T, S, O>(&mut self, device: &mut D, step: S, observer: &mut O, stop: &AtomicBool) -> RunStatistics
    where
        D: HapticDevice + ?Sized,
        S: FnMut(&DeviceState, f64) -> StepOutcome<T>,
        O: TickObserver<T> + ?Sized,
    {
        self.run_in(&WallTime::new(), device, step, observer, stop)
    }

    /// The same by another clock.
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
        let ServoOptions { rate_hz, timing, duration, spin, .. } = self.options;
        let period = 1.0 / rate_hz;
        let most = duration.map_or(u64::MAX, |seconds| (seconds * rate_hz).round() as u64);
        quiet::prepare();
        self.tally.restart(device.spec().delay, period);
        let (given, stands) = (self.passivity.is_some(), device.stands_unread());
        let line = Line::new(&self.options, device, self.passivity.take(), time);
        let pace = Pace::start(timing, period, spin, time);
        let mut turns = Turns {
            line,
            pace,
            time,
            period,
            reins: &self.reins,
            stands,
            index: 0,
            ending: 0.0,
            tally: &mut self.tally,
        };
        let mut count = 0;
        let mut end = loop {
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
        let Turns { mut line, mut pace, tally, .. } = turns;
        line.let_go(&mut pace);
        let counts = line.counts();
        let (passivity, finished) = line.finish(matches!(end, RunEnd::DeviceFailed(_)));
        // The usual stage is made anew for each run's device.
        self.passivity = passivity.filter(|_| given);
        // What came first is the reason.
        if let Err(error) = finished
            && matches!(end, RunEnd::Duration | RunEnd::Stopped | RunEnd::DeviceEnded)
        {
            end = RunEnd::DeviceFailed(error);
        }
        let statistics = tally.finish(end, timing, period, pace.elapsed(time));
        RunStatistics { device: counts, ..statistics }
    }
}

/// A loop that stands still looks this often whether it is to go on.
const LOOK: Duration = Duration::from_millis(4);

/// A run under way.
struct Turns<'a, D: HapticDevice + ?Sized> {
    line: Line<'a, D>,
    pace: Pace,
    time: &'a dyn LoopTime,
    period: f64,
    reins: &'a Reins,
    /// The device stands still while it is not read.
    stands: bool,
    /// Of the next tick.
    index: u64,
    /// s since the reins ended the run.
    ending: f64,
    tally: &'a mut Tally,
}

impl<D: HapticDevice + ?Sized> Turns<'_, D> {
    /// Returns when the next tick may come: at once, unless the run is paused and can stand still.
    fn stand(&mut self, stop: &AtomicBool) {
        if !self.stands || !self.reins.is_paused() {
            return;
        }
        self.line.stand();
        let since = self.time.now();
        while !(self.reins.take_step() || self.reins.is_ended() || stop.load(Ordering::Relaxed)) {
            self.time.wait_until(self.time.now() + LOOK, Duration::ZERO);
        }
        self.pace.resume(since, self.time);
    }

    /// True when the reins have ended the run and the wrench has faded out. A loop that stands still has nothing to wait for.
    fn is_over(&mut self) -> bool {
        let lasts = self.ending < self.line.fading() && self.line.is_on() && !(self.stands && self.reins.is_paused());
        if self.reins.is_ended() && lasts {
            self.ending += self.period;
            return false;
        }
        self.reins.is_ended()
    }

    /// One turn of the loop; breaks with the reason for which it was the last.
    fn turn<T, S, O>(&mut self, step: &mut S, observer: &mut O) -> ControlFlow<RunEnd>
    where
        S: FnMut(&DeviceState, f64) -> StepOutcome<T>,
        O: TickObserver<T> + ?Sized,
    {
        let start = self.pace.wait(self.time);
        self.tally.start_of_tick(&start);
        let admitted = match self.line.read(&start) {
            Ok(admitted) => admitted,
            Err(error) => return ControlFlow::Break(RunEnd::of(error)),
        };
        let Some(state) = admitted.state.map(|state| state.with_keys(self.reins.take_keys())) else {
            // There has been no state yet, and so there has been no wrench.
            self.tally.without_state(admitted.cuts);
            return match self.line.hold_still() {
                Ok(()) => ControlFlow::Continue(()),
                Err(error) => ControlFlow::Break(RunEnd::DeviceFailed(error)),
            };
        };
        let (outcome, step_s) = self.caught(step, &state);
        let panicked = outcome.is_err();
        let elapsed_s = start.elapsed(self.period);
        let computed = outcome.as_ref().map_or(Wrench::ZERO, |outcome| outcome.wrench);
        let mut found = admitted.cuts;
        found.note(Cut::Paused, !self.stands && self.reins.is_paused());
        found.note(Cut::Overrun, self.pace.is_lost(self.time));
        found.note(Cut::Ending, self.reins.is_ended());
        found.note(Cut::Settings, outcome.as_ref().is_ok_and(|outcome| outcome.changed));
        self.line.receive(outcome.as_ref().map_or([0.0; 2], |outcome| outcome.received));
        let Shaped { wrench, cuts, phase, available } =
            match self.line.answer(&state, &computed, found, panicked, elapsed_s) {
                Ok(shaped) => shaped,
                Err(error) => return ControlFlow::Break(RunEnd::DeviceFailed(error)),
            };
        let tick = ServoTick {
            index: self.index,
            time: self.index as f64 * self.period,
            state,
            read: admitted.read,
            computed,
            wrench,
            cuts,
            phase,
            available,
            saturated: outcome.as_ref().is_ok_and(|outcome| outcome.saturated),
            elapsed_s,
            step_s,
            lateness_s: start.lateness.as_secs_f64(),
            overrun: start.skipped > 0 || self.pace.is_overrun(self.time),
        };
        self.tally.end_of_tick(&tick);
        self.index += 1;
        match outcome {
            Ok(outcome) => observer.observe(&tick, &outcome.detail),
            Err(panic) => {
                observer.unanswered(&tick);
                self.tally.panicked(quiet::message(panic.as_ref()));
            }
        }
        match phase {
            Phase::Stopped if panicked => ControlFlow::Break(RunEnd::Panicked(self.tally.last_panic())),
            Phase::Stopped => ControlFlow::Break(RunEnd::Faulted(cuts)),
            _ => ControlFlow::Continue(()),
        }
    }

    /// Damps the grip for a moment, whatever the device says of it.
    fn coast<T, O>(&mut self, stop: &AtomicBool, observer: &mut O)
    where
        O: TickObserver<T> + ?Sized,
    {
        for _ in 0..coast_ticks(self.period) {
            let start = self.pace.wait(self.time);
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let Ok(admitted) = self.line.read(&start) else { return };
            let Some(tick) = self.line.damp(&start, &admitted, self.index) else { return };
            self.index += 1;
            observer.unanswered(&tick);
        }
    }

    /// What the step answers or with what it panics, and how long it took, s.
    fn caught<T, S>(&self, step: &mut S, state: &DeviceState) -> (std::thread::Result<StepOutcome<T>>, f64)
    where
        S: FnMut(&DeviceState, f64) -> StepOutcome<T>,
    {
        let before = self.time.now();
        let outcome = quiet::caught(|| step(state, self.period));
        (outcome, self.time.now().saturating_sub(before).as_secs_f64())
    }
}

/// Damping after a panic or a last fault, s, before the run ends with zero.
const COAST: f64 = 0.1;

/// The same in ticks.
fn coast_ticks(period: f64) -> u64 {
    (COAST / period).ceil() as u64
}

#[cfg(test)]
mod tests;
