//! Statistics of a run. All memory is allocated before the run.

use std::time::Duration;

use hdrhistogram::Histogram;
use palpus::algebra::Wrench;

use super::pace::Start;
use super::{ServoTick, Timing};
use crate::device::{DeviceError, DeviceSpec};
use crate::safety::{Cut, Cuts, SafetyCounters};
use crate::sensed_work::SensedWork;

/// Durations from 1 ns to 10 s are stored to three digits. A longer duration counts as 10 s.
const LONGEST_NS: u64 = 10_000_000_000;
/// Number of stored digits of a duration.
const DIGITS: u8 = 3;

/// Distribution of durations, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
}

/// Net work of the written wrenches on the grip, J: each wrench times the motion sensed while it
/// acted. Positive if the loop has put energy into the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Work of forces.
    pub translation: f64,
    /// Work of torques.
    pub rotation: f64,
    /// Largest value during the run of `translation` plus `rotation`.
    pub highest: f64,
}

/// The reason why a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunEnd {
    /// The duration of the run is over.
    Duration,
    /// The stop flag was set, or the run control ended the run.
    Stopped,
    /// The device has no more states, as at the end of a recording.
    DeviceEnded,
    /// The device failed.
    DeviceFailed(DeviceError),
    /// The step panicked, with this message.
    Panicked(String),
    /// A fault with these cuts, after which the loop had to stop.
    Faulted(Cuts),
}

impl RunEnd {
    /// Returns the end of a run after the device returned `error`.
    pub(super) fn of(error: DeviceError) -> Self {
        if error == DeviceError::Ended { Self::DeviceEnded } else { Self::DeviceFailed(error) }
    }
}

/// Summary of a run, with the values that the loop itself measures.
#[derive(Clone, Debug, PartialEq)]
pub struct RunStatistics {
    /// Number of ticks whose wrench was written.
    pub ticks: u64,
    /// Duration of the run, s: wall-clock time in real time, ticks times the period in simulated
    /// time.
    pub duration_s: f64,
    /// Duration of the run by the wall clock, s.
    pub wall_s: f64,
    /// Ticks per second of wall-clock time, Hz.
    pub rate_hz: f64,
    /// Number of ticks whose wrench was written more than a period after the tick was due, because
    /// the tick began late or took long.
    pub overruns: u64,
    /// Number of ticks that began more than [`LATE`] after they were due.
    pub late_ticks: u64,
    /// Number of whole periods without a tick.
    pub skipped: u64,
    /// Time of the step alone.
    pub step_us: Percentiles,
    /// Time from tick to tick; `None` in simulated time.
    pub period_us: Option<Percentiles>,
    /// Time from the deadline of a tick to its start; `None` in simulated time.
    pub lateness_us: Option<Percentiles>,
    /// Work done on the grip.
    pub energy: Energy,
    /// Largest force written, N.
    pub force_max: f64,
    /// Largest torque written, N·m.
    pub torque_max: f64,
    /// Largest change of the force from one tick to the next, N. The force before the first tick is
    /// zero.
    pub force_step_max: f64,
    /// Largest change of the torque from one tick to the next, N·m.
    pub torque_step_max: f64,
    /// Number of ticks whose step reported that it reduced the wrench to the device's limits.
    pub saturated_ticks: u64,
    /// Number of interventions of the safety chain, by kind.
    pub safety: SafetyCounters,
    /// The device's own counters, by name ([`crate::HapticDevice::counts`]).
    pub device: Vec<(&'static str, u64)>,
    /// Message of the last panic in a step; `None` if no step panicked.
    pub panic: Option<String>,
    /// The reason why the run ended.
    pub end: RunEnd,
}

/// A tick counts as late if it begins more than this time after its deadline.
pub const LATE: Duration = Duration::from_micros(500);

/// Statistics of a run in progress.
#[derive(Debug)]
pub(super) struct Tally {
    step: Histogram<u64>,
    period: Histogram<u64>,
    lateness: Histogram<u64>,
    counts: Counts,
    work: SensedWork,
    panic: Option<String>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    ticks: u64,
    overruns: u64,
    late: u64,
    skipped: u64,
    saturated: u64,
    safety: SafetyCounters,
    energy: Energy,
    force_max: f64,
    torque_max: f64,
    force_step_max: f64,
    torque_step_max: f64,
    last: Wrench,
}

impl Tally {
    pub(super) fn new() -> Self {
        // The arguments are constants within the histogram's range.
        let histogram =
            || Histogram::new_with_max(LONGEST_NS, DIGITS).expect("10 s at three digits is a valid histogram");
        Self {
            step: histogram(),
            period: histogram(),
            lateness: histogram(),
            counts: Counts::default(),
            work: SensedWork::new(0.0, 1.0, [0.0; 2]),
            panic: None,
        }
    }

    /// Starts the statistics of a run with a device of description `spec`.
    pub(super) fn restart(&mut self, spec: &DeviceSpec, period: f64) {
        self.work = SensedWork::of(spec, period);
        self.step.reset();
        self.period.reset();
        self.lateness.reset();
        self.counts = Counts::default();
        self.panic = None;
    }

    pub(super) fn start_of_tick(&mut self, start: &Start) {
        self.lateness.saturating_record(start.lateness.as_nanos() as u64);
        if let Some(period) = start.period {
            self.period.saturating_record(period.as_nanos() as u64);
        }
        self.counts.skipped += start.skipped;
        self.counts.late += u64::from(start.lateness > LATE);
    }

    /// Counts a tick without a step, before the device has returned a state.
    pub(super) fn without_state(&mut self, cuts: Cuts) {
        self.counts.ticks += 1;
        self.counts.safety.add(cuts);
    }

    /// Stores the message of a panic in the step.
    pub(super) fn panicked(&mut self, message: String) {
        self.panic = Some(message);
    }

    pub(super) fn last_panic(&self) -> String {
        self.panic.clone().unwrap_or_default()
    }

    pub(super) fn end_of_tick(&mut self, tick: &ServoTick) {
        self.step.saturating_record((tick.step_s * 1e9) as u64);
        let counts = &mut self.counts;
        counts.ticks += 1;
        counts.overruns += u64::from(tick.overrun);
        counts.saturated += u64::from(tick.saturated);
        counts.safety.add(tick.cuts);
        let [translation, rotation] = self.work.moved_to(&tick.state.pose, tick.elapsed_s);
        counts.energy.translation += translation;
        counts.energy.rotation += rotation;
        counts.energy.highest = counts.energy.highest.max(counts.energy.translation + counts.energy.rotation);
        self.work.write(&tick.wrench);
        counts.force_max = counts.force_max.max(tick.wrench.force.length());
        counts.torque_max = counts.torque_max.max(tick.wrench.torque.length());
        counts.force_step_max = counts.force_step_max.max(tick.wrench.force.distance(counts.last.force));
        counts.torque_step_max = counts.torque_step_max.max(tick.wrench.torque.distance(counts.last.torque));
        counts.last = tick.wrench;
    }

    pub(super) fn finish(&mut self, end: RunEnd, timing: Timing, period: f64, wall: Duration) -> RunStatistics {
        let Counts { ticks, overruns, late, skipped, saturated, mut safety, energy, .. } = self.counts;
        let mut cuts = Cuts::NONE;
        // If the device was lost during a write, its last tick has counted the cut already.
        let is_counted = safety.ticks(Cut::Device) > 0;
        cuts.note(Cut::Device, matches!(end, RunEnd::DeviceFailed(_)) && !is_counted);
        safety.add(cuts);
        let wall_s = wall.as_secs_f64();
        let real = timing == Timing::RealTime;
        RunStatistics {
            ticks,
            duration_s: if real { wall_s } else { ticks as f64 * period },
            wall_s,
            rate_hz: if wall_s > 0.0 { ticks as f64 / wall_s } else { 0.0 },
            overruns,
            late_ticks: late,
            skipped,
            step_us: percentiles(&self.step),
            period_us: real.then(|| percentiles(&self.period)),
            lateness_us: real.then(|| percentiles(&self.lateness)),
            energy,
            force_max: self.counts.force_max,
            torque_max: self.counts.torque_max,
            force_step_max: self.counts.force_step_max,
            torque_step_max: self.counts.torque_step_max,
            saturated_ticks: saturated,
            safety,
            device: Vec::new(),
            panic: self.panic.take(),
            end,
        }
    }
}

fn percentiles(histogram: &Histogram<u64>) -> Percentiles {
    let at = |quantile| histogram.value_at_quantile(quantile) as f64 * 1e-3;
    let mean = if histogram.is_empty() { 0.0 } else { histogram.mean() * 1e-3 };
    Percentiles { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: histogram.max() as f64 * 1e-3, mean }
}
