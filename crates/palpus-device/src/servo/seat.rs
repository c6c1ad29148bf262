//! One device of a loop: its line, what is counted of it, and why it ended.

use std::time::Duration;

use palpus::algebra::{Twist, Wrench};
use palpus::render::Limits;

use super::line::Line;
use super::pace::Start;
use super::statistics::{RunEnd, RunStatistics, Tally};
use super::time::LoopTime;
use super::{ServoOptions, ServoTick, StepOutcome};
use crate::device::{DeviceError, DeviceState, HapticDevice};
use crate::safety::{AfterFault, Cut, Cuts, Passivity, Phase, SafetyLimits, SafetyOptions, Shaped};

/// State of a device that is kept from run to run.
pub(super) struct Kept {
    pub(super) safety: SafetyOptions,
    /// In place of the usual stage, which is made anew for each run's device.
    pub(super) passivity: Option<Box<dyn Passivity>>,
    pub(super) tally: Tally,
}

/// See the module's description.
pub(super) struct Seat<'a, D: HapticDevice + ?Sized> {
    which: usize,
    /// `None` from when a lost device has its zero.
    line: Option<Line<'a, D>>,
    tally: &'a mut Tally,
    /// Destination of a passivity stage that was lent.
    passivity: Option<&'a mut Option<Box<dyn Passivity>>>,
    /// A loss of the device ends the run, as any fault does.
    fragile: bool,
    /// The tools of other devices feel this one's.
    shared: bool,
    /// As the device gave it last.
    read: DeviceState,
    /// It has had a state.
    seen: bool,
    /// This tick needs an answer.
    due: bool,
    /// Faults of this tick's state.
    cuts: Cuts,
    /// Record of this turn, for the observer.
    tick: Option<ServoTick>,
    /// The device is there no more.
    lost: bool,
    /// Why it ended, if it did.
    end: Option<RunEnd>,
    /// Counts of the device itself.
    counts: Vec<(&'static str, u64)>,
}

/// Facts of a turn before its devices are answered.
pub(super) struct Turn {
    pub(super) start: Start,
    pub(super) index: u64,
    pub(super) period: f64,
    pub(super) step_s: f64,
    /// Faults of the whole loop in this turn.
    pub(super) found: Cuts,
    pub(super) panicked: bool,
}

impl<'a, D: HapticDevice + ?Sized> Seat<'a, D> {
    /// Device number `which`, alone in its loop or not.
    pub(super) fn new(
        which: usize,
        device: &'a mut D,
        kept: &'a mut Kept,
        loop_options: &ServoOptions,
        time: &'a dyn LoopTime,
        shared: bool,
    ) -> Self {
        let Kept { safety, passivity, tally } = kept;
        let options = ServoOptions { safety: *safety, ..*loop_options };
        tally.restart(device.spec(), 1.0 / options.rate_hz);
        let stage = passivity.take();
        let passivity = stage.is_some().then_some(passivity);
        let line = Some(Line::new(&options, device, stage, time));
        let fragile = safety.after_fault == AfterFault::Stop;
        let (read, cuts) = (DeviceState::UNKNOWN, Cuts::NONE);
        let (seen, due, lost, tick, end, counts) = (false, false, false, None, None, Vec::new());
        Self { which, line, tally, passivity, fragile, shared, read, seen, due, cuts, tick, lost, end, counts }
    }

    /// The thresholds of its safety chain.
    pub(super) fn limits(&self) -> Option<&SafetyLimits> {
        self.line.as_ref().map(Line::limits)
    }

    /// The line, unless the device is lost.
    pub(super) fn line(&mut self) -> Option<&mut Line<'a, D>> {
        self.line.as_mut().filter(|_| !self.lost)
    }

    /// True while the device may be given a wrench that is no damping and has not had `ending`
    /// seconds to fade out.
    pub(super) fn lasts(&mut self, ending: f64) -> bool {
        self.line().is_some_and(|line| line.is_on() && ending < line.fading())
    }

    /// True when it has had a state.
    pub(super) fn is_seen(&self) -> bool {
        self.seen
    }

    /// True if this turn has a state that needs an answer.
    pub(super) fn is_due(&self) -> bool {
        self.due
    }

    /// Why it ended, if it did.
    pub(super) fn end(&self) -> Option<&RunEnd> {
        self.end.as_ref()
    }

    /// The reason for which the whole run is to end with this device.
    pub(super) fn last_word(&self) -> Option<&RunEnd> {
        self.end.as_ref().filter(|end| self.fragile || **end == RunEnd::DeviceEnded)
    }

    /// Reads the device; the step's input goes to `state`.
    pub(super) fn read(&mut self, start: &Start, state: &mut DeviceState) {
        (self.due, self.tick) = (false, None);
        let Some(line) = self.line.as_mut().filter(|_| !self.lost) else { return };
        self.tally.start_of_tick(start);
        let admitted = match line.read(start) {
            Ok(admitted) => admitted,
            Err(error) => return self.lose(error, state),
        };
        (self.cuts, self.read) = (admitted.cuts, admitted.read);
        if let Some(believed) = admitted.state {
            let doubtful = self.shared && self.seen && admitted.cuts.is_fault();
            *state = if doubtful { DeviceState { twist: Twist::default(), ..*state } } else { believed };
            (self.seen, self.due) = (true, true);
            return;
        }
        // There has been no state yet, and so there has been no wrench.
        self.tally.without_state(admitted.cuts);
        if let Err(error) = line.hold_still() {
            self.lose(error, state);
        }
    }

    /// Energy that other tools and objects gave this one's tool by translation and rotation, J.
    pub(super) fn receive(&mut self, from_others: [f64; 2], own: [f64; 2]) {
        if let Some(line) = self.line() {
            line.receive([from_others[0] + own[0], from_others[1] + own[1]]);
        }
    }

    /// Passes the answer through the chain and writes it; `is_late` is asked afterwards.
    pub(super) fn answer<T>(
        &mut self,
        turn: &Turn,
        state: &mut DeviceState,
        answer: Option<&StepOutcome<T>>,
        is_late: impl FnOnce() -> bool,
    ) {
        let Some(line) = self.line.as_mut().filter(|_| self.due) else { return };
        let stepped = *state;
        let computed = answer.map_or(Wrench::ZERO, |answer| answer.wrench);
        let elapsed_s = turn.start.elapsed(turn.period);
        let mut found = self.cuts.or(turn.found);
        found.note(Cut::Settings, answer.is_some_and(|answer| answer.changed));
        let shaped = match line.answer(state, &computed, found, turn.panicked, elapsed_s) {
            Ok(shaped) => shaped,
            Err(error) => {
                self.lose(error, state);
                if !self.shared {
                    return;
                }
                // Other tools felt the state in this step, so that there is a tick to tell of.
                found.note(Cut::Device, true);
                // A replay knows no more of it either.
                let available = Limits::UNLIMITED;
                Shaped { wrench: Wrench::ZERO, cuts: found, phase: Phase::Faulted, available }
            }
        };
        let Shaped { wrench, cuts, phase, available } = shaped;
        let tick = ServoTick {
            device: self.which,
            index: turn.index,
            time: turn.index as f64 * turn.period,
            state: stepped,
            read: self.read,
            computed,
            wrench,
            cuts,
            phase,
            available,
            saturated: answer.is_some_and(|answer| answer.saturated),
            elapsed_s,
            step_s: turn.step_s,
            lateness_s: turn.start.lateness.as_secs_f64(),
            overrun: turn.start.skipped > 0 || is_late(),
        };
        self.tally.end_of_tick(&tick);
        self.tick = Some(tick);
    }

    /// The tick of this turn, if there was one.
    pub(super) fn tick(&self) -> Option<&ServoTick> {
        self.tick.as_ref()
    }

    /// A panic in the step said this.
    pub(super) fn panicked(&mut self, message: String) {
        self.tally.panicked(message);
    }

    /// The chain has stopped in this turn, after a panic in the step or another fault: why.
    pub(super) fn stopped(&mut self, panicked: bool) -> Option<RunEnd> {
        let tick = self.tick.as_ref().filter(|tick| tick.phase == Phase::Stopped)?;
        let end = if panicked { RunEnd::Panicked(self.tally.last_panic()) } else { RunEnd::Faulted(tick.cuts) };
        self.end = Some(end.clone());
        Some(end)
    }

    /// One tick, number `index`, of damping without a step; `None` where that does not go.
    pub(super) fn damp(&mut self, start: &Start, index: u64) -> Option<ServoTick> {
        let which = self.which;
        self.line()?.damp(start, index, which)
    }

    /// The device is there no more; its tool stays where it was.
    fn lose(&mut self, error: DeviceError, state: &mut DeviceState) {
        state.twist = Twist::default();
        self.end = Some(RunEnd::of(error));
        (self.lost, self.due) = (true, false);
    }

    /// Takes the wrench of a lost device a step of the slew limit nearer to zero, and lets it go
    /// when zero may follow.
    pub(super) fn leave(&mut self) {
        if self.lost && !self.release() {
            self.close();
        }
    }

    /// Takes the wrench a step of the slew limit nearer to zero; false if zero may follow.
    pub(super) fn release(&mut self) -> bool {
        // A write that does not arrive is followed by the last zero.
        self.line.as_mut().is_some_and(|line| line.release().unwrap_or(false))
    }

    /// Writes the last wrench, which is zero; a device that has failed also gets its brake.
    fn close(&mut self) {
        let Some(line) = self.line.take() else { return };
        self.counts = line.counts();
        let (stage, finished) = line.finish(matches!(self.end, Some(RunEnd::DeviceFailed(_))));
        if let Some(home) = &mut self.passivity {
            **home = stage;
        }
        // The first end is the reason.
        if let Err(error) = finished
            && matches!(self.end, None | Some(RunEnd::Duration | RunEnd::Stopped | RunEnd::DeviceEnded))
        {
            self.end = Some(RunEnd::DeviceFailed(error));
        }
    }

    /// Returns the statistics of the run, which ended like this unless this device ended before.
    pub(super) fn finish(mut self, end: &RunEnd, options: &ServoOptions, elapsed: Duration) -> RunStatistics {
        let of_all = matches!(end, RunEnd::Duration | RunEnd::Stopped | RunEnd::DeviceEnded);
        self.end.get_or_insert(if of_all { end.clone() } else { RunEnd::Stopped });
        self.close();
        let end = self.end.unwrap_or(RunEnd::Stopped);
        let statistics = self.tally.finish(end, options.timing, 1.0 / options.rate_hz, elapsed);
        RunStatistics { device: self.counts, ..statistics }
    }
}
