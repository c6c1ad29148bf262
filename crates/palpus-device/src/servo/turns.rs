//! A run of the loop: its ticks, for all its devices.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::device_run::{DeviceRun, Kept, Turn};
use super::pace::Pace;
use super::{LoopTime, RunControl, RunEnd, RunStatistics, ServoOptions, StepOutcome, TickObserver, quiet};
use crate::device::{DeviceState, HapticDevice};
use crate::safety::{ContactAccount, Cut, Cuts};

/// Interval at which a paused loop checks whether to continue.
const LOOK: Duration = Duration::from_millis(4);

/// Time for which the grip is damped after a panic or a fault that stops the run, s. Then zero is
/// written.
const COAST: f64 = 0.1;

/// A run of the loop. All memory is allocated before the first tick.
pub(super) struct Turns<'a, D: HapticDevice + ?Sized, T> {
    options: &'a ServoOptions,
    runs: Vec<DeviceRun<'a, D>>,
    /// Inputs of the step: the state of each device.
    states: Vec<DeviceState>,
    /// Results of the step for each device.
    answers: Vec<Option<StepOutcome<T>>>,
    /// Work that contact between the tools did on each tool in this tick, J, by translation and
    /// rotation.
    works: Vec<[f64; 2]>,
    contact: ContactAccount,
    pace: Pace,
    time: &'a dyn LoopTime,
    period: f64,
    control: &'a RunControl,
    /// True if the time of all devices advances only when they are read.
    stands: bool,
    /// Number of the next tick.
    index: u64,
    /// Time since the run control ended the run, s.
    ending: f64,
}

impl<'a, D: HapticDevice + ?Sized, T> Turns<'a, D, T> {
    pub(super) fn new(
        options: &'a ServoOptions,
        devices: &'a mut [&mut D],
        kept: &'a mut [Kept],
        control: &'a RunControl,
        time: &'a dyn LoopTime,
    ) -> Self {
        let stands = devices.iter().all(|device| device.stands_unread());
        let shared = devices.len() > 1;
        let run = |(which, (device, kept)): (usize, (&'a mut &mut D, &'a mut Kept))| {
            DeviceRun::new(which, &mut **device, kept, options, time, shared)
        };
        let runs: Vec<DeviceRun<'a, D>> = devices.iter_mut().zip(kept).enumerate().map(run).collect();
        let count = runs.len();
        let period = 1.0 / options.rate_hz;
        Self {
            options,
            contact: ContactAccount::new(runs.iter().filter_map(DeviceRun::limits)),
            runs,
            states: vec![DeviceState::UNKNOWN; count],
            answers: (0..count).map(|_| None).collect(),
            works: vec![[0.0; 2]; count],
            pace: Pace::start(options.timing, period, options.spin, time),
            time,
            period,
            control,
            stands,
            index: 0,
            ending: 0.0,
        }
    }

    /// Waits while the run is paused, if a pause also stops the time of all devices.
    pub(super) fn stand(&mut self, stop: &AtomicBool) {
        if !self.stands || !self.control.is_paused() {
            return;
        }
        self.runs.iter_mut().filter_map(DeviceRun::line).for_each(|line| line.stand());
        let since = self.time.now();
        while !(self.control.take_step() || self.control.is_ended() || stop.load(Ordering::Relaxed)) {
            self.time.wait_until(self.time.now() + LOOK, Duration::ZERO);
        }
        self.pace.resume(since, self.time);
    }

    /// Returns true if the run control has ended the run and all wrenches have faded out. A
    /// loop that stands still in a pause ends at once.
    pub(super) fn is_over(&mut self) -> bool {
        if !self.control.is_ended() {
            return false;
        }
        let waits = !(self.stands && self.control.is_paused());
        let lasts = waits && self.runs.iter_mut().any(|run| run.lasts(self.ending));
        if lasts {
            self.ending += self.period;
        }
        !lasts
    }

    /// Runs one tick; breaks with the reason if it was the last tick.
    pub(super) fn turn<S, O>(&mut self, step: &mut S, observer: &mut O) -> ControlFlow<RunEnd>
    where
        S: FnMut(&[DeviceState], f64, &mut [Option<StepOutcome<T>>]),
        O: TickObserver<T> + ?Sized,
    {
        let start = self.pace.wait(self.time);
        for (run, state) in self.runs.iter_mut().zip(&mut self.states) {
            run.read(&start, state);
        }
        self.check_ends()?;
        self.runs.iter_mut().for_each(DeviceRun::leave);
        if !self.runs.iter().any(DeviceRun::is_seen) {
            return ControlFlow::Continue(());
        }
        let keys = self.control.take_keys();
        for (_, state) in self.runs.iter().zip(&mut self.states).filter(|(run, _)| run.is_due()) {
            *state = state.with_keys(keys);
        }
        let (panic, step_s) = self.step(step);
        let mut found = Cuts::NONE;
        found.note(Cut::Paused, !self.stands && self.control.is_paused());
        found.note(Cut::Overrun, self.pace.is_lost(self.time));
        found.note(Cut::Ending, self.control.is_ended());
        self.pass_on();
        let turn = Turn { start, index: self.index, period: self.period, step_s, found, panicked: panic.is_some() };
        for ((run, state), answer) in self.runs.iter_mut().zip(&mut self.states).zip(&self.answers) {
            run.answer(&turn, state, answer.as_ref(), || self.pace.is_overrun(self.time));
        }
        self.index += 1;
        for (tick, answer) in self.runs.iter().map(DeviceRun::tick).zip(&self.answers) {
            match (tick, answer) {
                (Some(tick), Some(answer)) => observer.observe(tick, &answer.detail),
                (Some(tick), None) => observer.unanswered(tick),
                (None, _) => {}
            }
        }
        if let Some(panic) = panic {
            let message = quiet::message(panic.as_ref());
            self.runs.iter_mut().for_each(|run| run.panicked(message.clone()));
        }
        let stopped = self.runs.iter_mut().fold(None, |first, run| first.or(run.stopped(turn.panicked)));
        self.check_ends()?;
        stopped.map_or(ControlFlow::Continue(()), ControlFlow::Break)
    }

    /// Runs the step. Returns its panic, if it panicked, and the time that it took, s.
    fn step<S>(&mut self, step: &mut S) -> (Option<Box<dyn std::any::Any + Send>>, f64)
    where
        S: FnMut(&[DeviceState], f64, &mut [Option<StepOutcome<T>>]),
    {
        self.answers.fill_with(|| None);
        let before = self.time.now();
        let panic = quiet::caught(|| step(&self.states, self.period, &mut self.answers)).err();
        let step_s = self.time.now().saturating_sub(before).as_secs_f64();
        if panic.is_some() {
            // The step may have stored some results before it panicked.
            self.answers.fill_with(|| None);
        }
        (panic, step_s)
    }

    /// Passes to each chain the work that other tools and moving bodies did on its tool.
    fn pass_on(&mut self) {
        for (work, answer) in self.works.iter_mut().zip(&self.answers) {
            *work = answer.as_ref().map_or([0.0; 2], |answer| answer.from_others);
        }
        self.contact.pass(&mut self.works);
        for ((run, from_others), answer) in self.runs.iter_mut().zip(&self.works).zip(&self.answers) {
            run.receive(*from_others, answer.as_ref().map_or([0.0; 2], |answer| answer.received));
        }
    }

    /// Breaks if all devices have ended, or if one device's end must end the run.
    fn check_ends(&self) -> ControlFlow<RunEnd> {
        let of_run = self.runs.iter().find_map(DeviceRun::last_word);
        let all = || self.runs.iter().try_fold(None, |_, run| run.end().map(Some)).flatten();
        of_run.or_else(all).map_or(ControlFlow::Continue(()), |end| ControlFlow::Break(end.clone()))
    }

    /// Reduces all wrenches within the slew limit, until the next wrenches may be zero.
    pub(super) fn let_go(&mut self) {
        while self.runs.iter_mut().map(DeviceRun::release).filter(|held| *held).count() > 0 {
            self.pace.wait(self.time);
        }
    }

    /// Damps all grips for a moment after a panic or a fault that stops the run.
    pub(super) fn coast<O>(&mut self, stop: &AtomicBool, observer: &mut O)
    where
        O: TickObserver<T> + ?Sized,
    {
        for _ in 0..(COAST / self.period).ceil() as u64 {
            let start = self.pace.wait(self.time);
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let mut damped = false;
            for tick in self.runs.iter_mut().filter_map(|run| run.damp(&start, self.index)) {
                damped = true;
                observer.unanswered(&tick);
            }
            if !damped {
                return;
            }
            self.index += 1;
        }
    }

    /// Writes the last wrenches, which are zero, and returns the statistics of each device.
    pub(super) fn finish(self, end: &RunEnd) -> Vec<RunStatistics> {
        let elapsed = self.pace.elapsed(self.time);
        self.runs.into_iter().map(|run| run.finish(end, self.options, elapsed)).collect()
    }
}
