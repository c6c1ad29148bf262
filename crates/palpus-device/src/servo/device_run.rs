//! One device of a loop: its line, its statistics, and the reason for its end.

use std::time::Duration;

use palpus::algebra::{Twist, Wrench};
use palpus::render::Limits;

use super::line::Line;
use super::pace::Start;
use super::statistics::{RunEnd, RunStatistics, Tally};
use super::time::LoopTime;
use super::{ServoOptions, ServoTick, StepOutcome};
use crate::device::{DeviceError, DeviceState, HapticDevice};
use crate::safety::{AfterFault, Cut, Cuts, Phase, SafetyLimits, SafetyOptions, Shaped};

/// Options and memory of a device that are kept from run to run.
pub(super) struct Kept {
    pub(super) safety: SafetyOptions,
    pub(super) tally: Tally,
}

/// One device of a run.
pub(super) struct DeviceRun<'a, D: HapticDevice + ?Sized> {
    which: usize,
    /// `None` after a lost device got its zero wrench.
    line: Option<Line<'a, D>>,
    tally: &'a mut Tally,
    /// True if any fault of the device ends the run.
    fragile: bool,
    /// True if the loop has several devices, whose tools can touch each other.
    shared: bool,
    /// The last state that the device returned.
    read: DeviceState,
    /// True if the device has returned a state.
    seen: bool,
    /// True if this tick has a state that needs a wrench.
    due: bool,
    /// Faults of the state in this tick.
    cuts: Cuts,
    /// Record of this tick, for the observer.
    tick: Option<ServoTick>,
    /// True if the device was lost.
    lost: bool,
    /// The reason why the device ended; `None` while the device runs.
    end: Option<RunEnd>,
    /// The device's own counters.
    counts: Vec<(&'static str, u64)>,
}

/// Facts of a tick that are common to all devices.
pub(super) struct Turn {
    pub(super) start: Start,
    pub(super) index: u64,
    pub(super) period: f64,
    pub(super) step_s: f64,
    /// Faults of the whole loop in this tick.
    pub(super) found: Cuts,
    pub(super) panicked: bool,
}

impl<'a, D: HapticDevice + ?Sized> DeviceRun<'a, D> {
    /// Starts the run of device number `which`. `shared` is true if the loop has several devices.
    pub(super) fn new(
        which: usize,
        device: &'a mut D,
        kept: &'a mut Kept,
        loop_options: &ServoOptions,
        time: &'a dyn LoopTime,
        shared: bool,
    ) -> Self {
        let Kept { safety, tally } = kept;
        let options = ServoOptions { safety: *safety, ..*loop_options };
        tally.restart(device.spec(), 1.0 / options.rate_hz);
        let line = Some(Line::new(&options, device, time));
        let fragile = safety.after_fault == AfterFault::Stop;
        let (read, cuts) = (DeviceState::UNKNOWN, Cuts::NONE);
        let (seen, due, lost, tick, end, counts) = (false, false, false, None, None, Vec::new());
        Self { which, line, tally, fragile, shared, read, seen, due, cuts, tick, lost, end, counts }
    }

    /// Returns the thresholds of the device's safety chain.
    pub(super) fn limits(&self) -> Option<&SafetyLimits> {
        self.line.as_ref().map(Line::limits)
    }

    /// Returns the line; `None` if the device is lost.
    pub(super) fn line(&mut self) -> Option<&mut Line<'a, D>> {
        self.line.as_mut().filter(|_| !self.lost)
    }

    /// Returns true while the device may get a wrench other than damping, and the fade-out at the
    /// end of the run is not over. `ending`: time since the run was ended, s.
    pub(super) fn lasts(&mut self, ending: f64) -> bool {
        self.line().is_some_and(|line| line.is_on() && ending < line.fading())
    }

    /// Returns true if the device has returned a state.
    pub(super) fn is_seen(&self) -> bool {
        self.seen
    }

    /// Returns true if this tick has a state that needs a wrench.
    pub(super) fn is_due(&self) -> bool {
        self.due
    }

    /// Returns the reason why the device ended; `None` while the device runs.
    pub(super) fn end(&self) -> Option<&RunEnd> {
        self.end.as_ref()
    }

    /// Returns the end of this device if this end must end the whole run.
    pub(super) fn last_word(&self) -> Option<&RunEnd> {
        self.end.as_ref().filter(|end| self.fragile || **end == RunEnd::DeviceEnded)
    }

    /// Reads the device and stores the step's input in `state`.
    pub(super) fn read(&mut self, start: &Start, state: &mut DeviceState) {
        (self.due, self.tick) = (false, None);
        let Some(line) = self.line.as_mut().filter(|_| !self.lost) else { return };
        self.tally.start_of_tick(start);
        let admitted = match line.read(start) {
            Ok(admitted) => admitted,
            Err(error) => return self.lose(error, state),
        };
        (self.cuts, self.read) = (admitted.cuts, admitted.read);
        if let Some(accepted) = admitted.state {
            let doubtful = self.shared && self.seen && admitted.cuts.is_fault();
            *state = if doubtful { DeviceState { twist: Twist::default(), ..*state } } else { accepted };
            (self.seen, self.due) = (true, true);
            return;
        }
        // There has been no valid state yet, so no wrench was written either.
        self.tally.without_state(admitted.cuts);
        if let Err(error) = line.hold_still() {
            self.lose(error, state);
        }
    }

    /// Passes on the work that other tools (`from_others`) and moving bodies (`own`) did on this
    /// tool, J, each by translation and rotation.
    pub(super) fn receive(&mut self, from_others: [f64; 2], own: [f64; 2]) {
        if let Some(line) = self.line() {
            line.receive([from_others[0] + own[0], from_others[1] + own[1]]);
        }
    }

    /// Passes the step's result through the chain and writes the wrench. Calls `is_late` after the
    /// write.
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
                // The step used this state for the contacts of the other tools, so the tick is
                // recorded.
                found.note(Cut::Device, true);
                // A replay cannot know the limits in this tick, so no limits are recorded.
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

    /// Returns the record of this tick; `None` without a record.
    pub(super) fn tick(&self) -> Option<&ServoTick> {
        self.tick.as_ref()
    }

    /// Stores the `message` of a panic in the step.
    pub(super) fn panicked(&mut self, message: String) {
        self.tally.panicked(message);
    }

    /// If the chain stopped in this tick, returns the reason: a panic in the step or another fault.
    pub(super) fn stopped(&mut self, panicked: bool) -> Option<RunEnd> {
        let tick = self.tick.as_ref().filter(|tick| tick.phase == Phase::Stopped)?;
        let end = if panicked { RunEnd::Panicked(self.tally.last_panic()) } else { RunEnd::Faulted(tick.cuts) };
        self.end = Some(end.clone());
        Some(end)
    }

    /// Runs one tick, number `index`, of damping without a step; `None` if the device cannot be
    /// damped.
    pub(super) fn damp(&mut self, start: &Start, index: u64) -> Option<ServoTick> {
        let which = self.which;
        self.line()?.damp(start, index, which)
    }

    /// Marks the device as lost. The device's tool stays at its last pose, at rest.
    fn lose(&mut self, error: DeviceError, state: &mut DeviceState) {
        state.twist = Twist::default();
        self.end = Some(RunEnd::of(error));
        (self.lost, self.due) = (true, false);
    }

    /// Reduces the wrench of a lost device by one step of the slew limit, and closes the line when
    /// the next wrench may be zero.
    pub(super) fn leave(&mut self) {
        if self.lost && !self.release() {
            self.close();
        }
    }

    /// Reduces the wrench by one step of the slew limit. Returns false if the next wrench may be
    /// zero.
    pub(super) fn release(&mut self) -> bool {
        // If the write fails, the final zero is written next.
        self.line.as_mut().is_some_and(|line| line.release().unwrap_or(false))
    }

    /// Writes the last wrench, which is zero; if the device failed, also applies its brake.
    fn close(&mut self) {
        let Some(line) = self.line.take() else { return };
        self.counts = line.counts();
        let finished = line.finish(matches!(self.end, Some(RunEnd::DeviceFailed(_))));
        // If the device had failed before, the first failure remains the reason.
        if let Err(error) = finished
            && matches!(self.end, None | Some(RunEnd::Duration | RunEnd::Stopped | RunEnd::DeviceEnded))
        {
            self.end = Some(RunEnd::DeviceFailed(error));
        }
    }

    /// Returns the statistics of the run. `end` is the reason for the end, unless this device ended
    /// before the run.
    pub(super) fn finish(mut self, end: &RunEnd, options: &ServoOptions, elapsed: Duration) -> RunStatistics {
        let of_all = matches!(end, RunEnd::Duration | RunEnd::Stopped | RunEnd::DeviceEnded);
        self.end.get_or_insert(if of_all { end.clone() } else { RunEnd::Stopped });
        self.close();
        let end = self.end.unwrap_or(RunEnd::Stopped);
        let statistics = self.tally.finish(end, options.timing, 1.0 / options.rate_hz, elapsed);
        RunStatistics { device: self.counts, ..statistics }
    }
}
