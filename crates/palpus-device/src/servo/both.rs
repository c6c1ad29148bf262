//! One loop that turns two devices, each on a line of its own.
//!
//! 1. wait for the tick's deadline;
//! 2. read both devices, each through its own gate;
//! 3. run the step once, which answers a wrench for each;
//! 4. each one's own safety chain makes of its wrench what its device may get, and it is written;
//! 5. account for each; let the observer see both ticks.
//!
//! What goes wrong with one device takes the force from that one: its gate, its chain, its brake and its watchdog know nothing of the other. A
//! state that the gate does not believe is replaced by the last one that it did, at rest, since the other hand feels what comes of it. A device that is lost gets its zero and its brake and is read no more; the step goes on with the state that it had last, at rest. The run ends when
//! its time is over, when both are lost, when the states of one have been played to their end, or at a fault after which it is to stop.
//!
//! What the two share is the loop's time: a device that keeps the loop waiting is late for both.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use palpus::algebra::{Pose, Twist, Wrench};
use palpus::render::Limits;

use super::line::Line;
use super::pace::{Pace, Start};
use super::statistics::Tally;
use super::{
    LOOK, LoopTime, Reins, RunEnd, RunStatistics, Servo, ServoTick, StepOutcome, WallTime, coast_ticks, quiet,
};
use crate::device::{DeviceError, DeviceState, HapticDevice};
use crate::safety::{AfterFault, ContactAccount, Cut, Cuts, Phase, Shaped};

/// What a step answers for one of two devices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolOutcome<T = ()> {
    /// As for a device alone.
    pub outcome: StepOutcome<T>,
    /// J: what the contact with the other device's tool gave this one's in this step, by moving and by turning it.
    pub received: [f64; 2],
}

impl<T> From<StepOutcome<T>> for ToolOutcome<T> {
    /// Nothing from the other.
    fn from(outcome: StepOutcome<T>) -> Self {
        Self { outcome, received: [0.0; 2] }
    }
}

/// Sees every tick of both devices (0 and 1), on the servo thread, after their wrenches were written: must be quick and must not allocate.
pub trait BothObserver<T> {
    /// `detail` is what the step answered beside the device's wrench.
    fn observe(&mut self, device: usize, tick: &ServoTick, detail: &T);

    /// See [`TickObserver::unanswered`](super::TickObserver::unanswered).
    fn unanswered(&mut self, _device: usize, _: &ServoTick) {}
}

impl<T, F: FnMut(usize, &ServoTick, &T)> BothObserver<T> for F {
    fn observe(&mut self, device: usize, tick: &ServoTick, detail: &T) {
        self(device, tick, detail);
    }
}

impl Servo {
    /// Runs this loop with another device in it, by the clock on the wall: see [`Self::run_both_in`].
    pub fn run_both<T, S, O>(
        &mut self,
        second: &mut Servo,
        devices: [&mut (dyn HapticDevice + Send); 2],
        step: S,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> [RunStatistics; 2]
    where
        S: FnMut(&[DeviceState; 2], f64) -> [ToolOutcome<T>; 2],
        O: BothObserver<T> + ?Sized,
    {
        self.run_both_in(second, &WallTime::new(), devices, step, observer, stop)
    }

    /// Runs this loop with another device in it; `second` says what is its own there: its safety chain. Rate, time and reins are this one's.
    /// See [`Self::run_in`].
    ///
    /// The step gets the states of both. Of a device that has not had any yet the pose is none.
    pub fn run_both_in<T, S, O>(
        &mut self,
        second: &mut Servo,
        time: &dyn LoopTime,
        devices: [&mut (dyn HapticDevice + Send); 2],
        mut step: S,
        observer: &mut O,
        stop: &AtomicBool,
    ) -> [RunStatistics; 2]
    where
        S: FnMut(&[DeviceState; 2], f64) -> [ToolOutcome<T>; 2],
        O: BothObserver<T> + ?Sized,
    {
        quiet::prepare();
        let period = 1.0 / self.options.rate_hz;
        let most = self.options.duration.map_or(u64::MAX, |seconds| (seconds * self.options.rate_hz).round() as u64);
        let timing = self.options.timing;
        let stands = devices.iter().all(|device| device.stands_unread());
        let options = [self.options, super::ServoOptions { safety: second.options.safety, ..self.options }];
        let reins = Arc::clone(&self.reins);
        let limits = [0, 1].map(|k| options[k].safety.limits(devices[k].spec(), self.options.rate_hz));
        let contact = ContactAccount::new([&limits[0], &limits[1]]);
        let [one, other] = devices;
        let seats = [
            Seat::new(&options[0], one, &mut self.tally, time, period),
            Seat::new(&options[1], other, &mut second.tally, time, period),
        ];
        let pace = Pace::start(timing, period, self.options.spin, time);
        let fragile = self.options.safety.after_fault == AfterFault::Stop;
        let mut turns =
            BothTurns { seats, contact, pace, time, period, reins: &reins, stands, fragile, index: 0, ending: 0.0 };
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
        let BothTurns { seats, pace, .. } = turns;
        let elapsed = pace.elapsed(time);
        seats.map(|seat| seat.finish(&end).finish_of(timing, period, elapsed))
    }
}

/// A device and its line.
struct Seat<'a> {
    /// `None` from when the device is lost.
    line: Option<Line<'a, dyn HapticDevice + Send + 'a>>,
    tally: &'a mut Tally,
    /// As the step gets it.
    state: DeviceState,
    /// As the device gave it last.
    read: DeviceState,
    /// It has had a state.
    seen: bool,
    /// Of this tick.
    cuts: Cuts,
    /// Why it ended before the run did.
    end: Option<RunEnd>,
}

/// What is left of a seat.
struct Left<'a> {
    tally: &'a mut Tally,
    end: RunEnd,
}

impl Left<'_> {
    fn finish_of(self, timing: super::Timing, period: f64, elapsed: std::time::Duration) -> RunStatistics {
        self.tally.finish(self.end, timing, period, elapsed)
    }
}

impl<'a> Seat<'a> {
    fn new(
        options: &super::ServoOptions,
        device: &'a mut (dyn HapticDevice + Send),
        tally: &'a mut Tally,
        time: &'a dyn LoopTime,
        period: f64,
    ) -> Self {
        tally.restart(device.spec().delay, period);
        let pose = Pose::from_translation(DVec3::NAN);
        let state = DeviceState { pose, twist: Twist::default(), buttons: 0, time: 0.0, withheld: false };
        let line = Some(Line::new(options, device, None, time));
        Self { line, tally, state, read: state, seen: false, cuts: Cuts::NONE, end: None }
    }

    /// Reads the device; true if the tick is to be answered.
    fn read(&mut self, start: &Start, keys: u32) -> bool {
        let Some(line) = &mut self.line else { return false };
        self.tally.start_of_tick(start);
        let admitted = match line.read(start) {
            Ok(admitted) => admitted,
            Err(error) => {
                self.lose(error);
                return false;
            }
        };
        (self.cuts, self.read) = (admitted.cuts, admitted.read);
        if let Some(state) = admitted.state {
            // The other hand would feel a tool where it never was.
            let doubtful = admitted.cuts.is_fault() && self.seen;
            let state = if doubtful { DeviceState { twist: Twist::default(), ..self.state } } else { state };
            self.state = state.with_keys(keys);
            self.seen = true;
            return true;
        }
        self.tally.without_state(admitted.cuts);
        if let Err(error) = line.hold_still() {
            self.lose(error);
        }
        false
    }

    /// What its chain makes of the wrench, written.
    fn answer(&mut self, computed: &Wrench, found: Cuts, panicked: bool, elapsed: f64) -> Option<Shaped> {
        let line = self.line.as_mut()?;
        match line.answer(&self.state, computed, self.cuts.or(found), panicked, elapsed) {
            Ok(shaped) => Some(shaped),
            Err(error) => {
                self.lose(error);
                // The step has had its state, so that there is a tick to tell of.
                let mut cuts = self.cuts.or(found);
                cuts.note(Cut::Device, true);
                // A replay knows no more of it either.
                let available = Limits::UNLIMITED;
                Some(Shaped { wrench: Wrench::ZERO, cuts, phase: Phase::Faulted, available })
            }
        }
    }

    /// The device is there no more; it stays where it was.
    fn lose(&mut self, error: DeviceError) {
        self.state.twist = Twist::default();
        self.end = Some(RunEnd::of(error));
        if let Some(mut line) = self.line.take() {
            // Not paced: the other hand's loop goes on. It is lost already, so an error says nothing new.
            while let Ok(true) = line.release() {}
            let _ = line.finish(true);
        }
    }

    fn finish(self, end: &RunEnd) -> Left<'a> {
        let Self { line, tally, end: own, .. } = self;
        let finished = line.map(|line| line.finish(false).1);
        let end = match (own, finished) {
            (Some(own), _) => own,
            (None, Some(Err(error))) => RunEnd::DeviceFailed(error),
            (None, _) => end.clone(),
        };
        Left { tally, end }
    }
}

/// A run of both under way.
struct BothTurns<'a> {
    seats: [Seat<'a>; 2],
    contact: ContactAccount,
    pace: Pace,
    time: &'a dyn LoopTime,
    period: f64,
    reins: &'a Reins,
    stands: bool,
    /// A device that is lost ends the run, as any fault does.
    fragile: bool,
    /// Of the next tick.
    index: u64,
    /// s since the reins ended the run.
    ending: f64,
}

impl BothTurns<'_> {
    /// Returns when the next tick may come: at once, unless the run is paused and can stand still.
    fn stand(&mut self, stop: &AtomicBool) {
        if !self.stands || !self.reins.is_paused() {
            return;
        }
        for line in self.seats.iter_mut().filter_map(|seat| seat.line.as_mut()) {
            line.stand();
        }
        let since = self.time.now();
        while !(self.reins.take_step() || self.reins.is_ended() || stop.load(Ordering::Relaxed)) {
            self.time.wait_until(self.time.now() + LOOK, std::time::Duration::ZERO);
        }
        self.pace.resume(since, self.time);
    }

    /// True when the reins have ended the run and both wrenches have faded out.
    fn is_over(&mut self) -> bool {
        let mut on = self.seats.iter().filter_map(|seat| seat.line.as_ref()).filter(|line| line.is_on());
        let lasts = on.any(|line| self.ending < line.fading()) && !(self.stands && self.reins.is_paused());
        if self.reins.is_ended() && lasts {
            self.ending += self.period;
            return false;
        }
        self.reins.is_ended()
    }

    fn turn<T, S, O>(&mut self, step: &mut S, observer: &mut O) -> ControlFlow<RunEnd>
    where
        S: FnMut(&[DeviceState; 2], f64) -> [ToolOutcome<T>; 2],
        O: BothObserver<T> + ?Sized,
    {
        let start = self.pace.wait(self.time);
        let keys = self.reins.take_keys();
        let read = self.seats.each_mut().map(|seat| seat.read(&start, keys));
        self.check_ends()?;
        if !self.seats.iter().any(|seat| seat.seen) {
            return ControlFlow::Continue(());
        }
        let states = self.seats.each_ref().map(|seat| seat.state);
        let before = self.time.now();
        let outcome = quiet::caught(|| step(&states, self.period));
        let step_s = self.time.now().saturating_sub(before).as_secs_f64();
        let panicked = outcome.is_err();
        let elapsed_s = start.elapsed(self.period);
        let mut found = Cuts::NONE;
        found.note(Cut::Paused, !self.stands && self.reins.is_paused());
        found.note(Cut::Overrun, self.pace.is_lost(self.time));
        found.note(Cut::Ending, self.reins.is_ended());
        let received = outcome.as_ref().map_or([[0.0; 2]; 2], |outcomes| outcomes.each_ref().map(|tool| tool.received));
        let from_objects =
            outcome.as_ref().map_or([[0.0; 2]; 2], |outcomes| outcomes.each_ref().map(|tool| tool.outcome.received));
        for ((seat, between), own) in self.seats.iter_mut().zip(self.contact.pass(received)).zip(from_objects) {
            if let Some(line) = &mut seat.line {
                line.receive([between[0] + own[0], between[1] + own[1]]);
            }
        }
        let mut ended = ControlFlow::Continue(());
        let mut ticks = [None; 2];
        for k in (0..2).filter(|k| read[*k]) {
            let answered = outcome.as_ref().ok().map(|outcomes| &outcomes[k].outcome);
            let computed = answered.map_or(Wrench::ZERO, |outcome| outcome.wrench);
            let mut found = found;
            found.note(Cut::Settings, answered.is_some_and(|outcome| outcome.changed));
            let Some(Shaped { wrench, cuts, phase, available }) =
                self.seats[k].answer(&computed, found, panicked, elapsed_s)
            else {
                continue;
            };
            let tick = ServoTick {
                index: self.index,
                time: self.index as f64 * self.period,
                state: states[k],
                read: self.seats[k].read,
                computed,
                wrench,
                cuts,
                phase,
                available,
                saturated: answered.is_some_and(|outcome| outcome.saturated),
                elapsed_s,
                step_s,
                lateness_s: start.lateness.as_secs_f64(),
                overrun: start.skipped > 0 || self.pace.is_overrun(self.time),
            };
            self.seats[k].tally.end_of_tick(&tick);
            ticks[k] = Some(tick);
        }
        self.index += 1;
        match outcome {
            Ok(outcomes) => {
                for (k, (tick, outcome)) in ticks.iter().zip(&outcomes).enumerate() {
                    if let Some(tick) = tick {
                        observer.observe(k, tick, &outcome.outcome.detail);
                    }
                }
            }
            Err(panic) => {
                let message = quiet::message(panic.as_ref());
                for (k, tick) in ticks.iter().enumerate() {
                    if let Some(tick) = tick {
                        observer.unanswered(k, tick);
                    }
                }
                for seat in &mut self.seats {
                    seat.tally.panicked(message.clone());
                }
            }
        }
        for (seat, tick) in self.seats.iter_mut().zip(&ticks) {
            let Some(tick) = tick.as_ref().filter(|tick| tick.phase == Phase::Stopped) else { continue };
            let end = if panicked { RunEnd::Panicked(seat.tally.last_panic()) } else { RunEnd::Faulted(tick.cuts) };
            seat.end = Some(end.clone());
            ended = ControlFlow::Break(end);
        }
        self.check_ends()?;
        if let ControlFlow::Break(end) = ended {
            for seat in self.seats.iter_mut().filter(|seat| seat.end.is_none()) {
                seat.end = Some(RunEnd::Stopped);
            }
            return ControlFlow::Break(end);
        }
        ControlFlow::Continue(())
    }

    /// Breaks when there is nothing left to turn, or one device's states have been played to their end.
    fn check_ends(&self) -> ControlFlow<RunEnd> {
        let ends = self.seats.each_ref().map(|seat| seat.end.as_ref());
        if let Some(end) = ends.iter().flatten().find(|end| self.fragile || ***end == RunEnd::DeviceEnded) {
            return ControlFlow::Break((*end).clone());
        }
        match ends {
            [Some(end), Some(_)] => ControlFlow::Break(end.clone()),
            _ => ControlFlow::Continue(()),
        }
    }

    /// Takes both wrenches so near to zero, within the slew limit, that zero may follow.
    fn let_go(&mut self) {
        let mut held = [true; 2];
        loop {
            for (seat, held) in self.seats.iter_mut().zip(&mut held).filter(|(_, held)| **held) {
                // What does not arrive is followed by the last zero.
                *held = seat.line.as_mut().is_some_and(|line| line.release().unwrap_or(false));
            }
            if held == [false; 2] {
                return;
            }
            self.pace.wait(self.time);
        }
    }

    /// Damps both grips for a moment.
    fn coast<T, O>(&mut self, stop: &AtomicBool, observer: &mut O)
    where
        O: BothObserver<T> + ?Sized,
    {
        for _ in 0..coast_ticks(self.period) {
            let start = self.pace.wait(self.time);
            if stop.load(Ordering::Relaxed) {
                return;
            }
            for (k, seat) in self.seats.iter_mut().enumerate() {
                let Some(line) = &mut seat.line else { continue };
                // What does not arrive now is followed by the last zero.
                if let Ok(admitted) = line.read(&start)
                    && let Some(tick) = line.damp(&start, &admitted, self.index)
                {
                    observer.unanswered(k, &tick);
                }
            }
            self.index += 1;
        }
    }
}
