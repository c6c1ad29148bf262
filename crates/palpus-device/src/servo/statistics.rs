//! Statistics of a run, in memory obtained at the start.

use std::time::Duration;

use hdrhistogram::Histogram;
use palpus::algebra::Wrench;

use super::pace::Start;
use super::{ServoTick, Timing};
use crate::device::{DeviceError, DeviceSpec};
use crate::safety::{Cut, Cuts, SafetyCounters};
use crate::sensed_work::SensedWork;

/// Durations from 1 ns to 10 s are stored to three digits; a longer one counts as 10 s.
const LONGEST_NS: u64 = 10_000_000_000;
const DIGITS: u8 = 3;

/// How durations were distributed, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Percentiles {
    /// Half were not longer than this.
    pub p50: f64,
    /// 99 % were not longer.
    pub p99: f64,
    /// 99.9 % were not longer.
    pub p999: f64,
    /// The longest.
    pub max: f64,
    /// The mean.
    pub mean: f64,
}

/// Net work that the written wrenches have done on the grip, J, over the sensed motion while each
/// was acting. Positive: the loop has put energy into the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// By forces.
    pub translation: f64,
    /// By torques.
    pub rotation: f64,
    /// The largest sum of both at any time of the run.
    pub highest: f64,
}

/// Why a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum RunEnd {
    /// It had run as long as it was meant to.
    Duration,
    /// The stop flag was set.
    Stopped,
    /// The device has no more states: a recording's end.
    DeviceEnded,
    /// The device failed.
    DeviceFailed(DeviceError),
    /// The step panicked, with this message.
    Panicked(String),
    /// A fault of these kinds, after which the loop was to stop.
    Faulted(Cuts),
}

impl RunEnd {
    /// When the device did not give a state.
    pub(super) fn of(error: DeviceError) -> Self {
        if error == DeviceError::Ended { Self::DeviceEnded } else { Self::DeviceFailed(error) }
    }
}

/// The summary of a run, as far as the loop can know it.
#[derive(Clone, Debug, PartialEq)]
pub struct RunStatistics {
    /// Turns of the loop whose wrench was written.
    pub ticks: u64,
    /// Seconds of the run's own time: the wall's in real time, ticks times the period in simulated
    /// time.
    pub duration_s: f64,
    /// Seconds on the wall.
    pub wall_s: f64,
    /// Ticks per second on the wall.
    pub rate_hz: f64,
    /// Ticks that wrote their wrench more than a period after they were due, because they began
    /// late or took long.
    pub overruns: u64,
    /// Ticks that began more than [`LATE`] after they were due.
    pub late_ticks: u64,
    /// Whole periods that went by without a tick.
    pub skipped: u64,
    /// The step alone.
    pub step_us: Percentiles,
    /// From tick to tick; `None` in simulated time.
    pub period_us: Option<Percentiles>,
    /// Lateness of the tick after its deadline; `None` in simulated time.
    pub lateness_us: Option<Percentiles>,
    /// Work done on the grip.
    pub energy: Energy,
    /// Largest force written, N.
    pub force_max: f64,
    /// Largest torque written, N·m.
    pub torque_max: f64,
    /// Largest change of the force from one tick to the next, N; before the first tick it is zero.
    pub force_step_max: f64,
    /// Largest change of the torque from one tick to the next, N·m.
    pub torque_step_max: f64,
    /// Ticks whose step said that it cut the wrench.
    pub saturated_ticks: u64,
    /// Interventions of the safety chain.
    pub safety: SafetyCounters,
    /// Counts of the device itself, by name ([`crate::HapticDevice::counts`]).
    pub device: Vec<(&'static str, u64)>,
    /// Message of the last panic in a step.
    pub panic: Option<String>,
    /// Why it ended.
    pub end: RunEnd,
}

/// A tick that begins later than this is counted as late.
pub const LATE: Duration = Duration::from_micros(500);

/// The account of a run under way.
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
        // The bounds are constants within the histogram's range.
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

    /// A run begins on a device of this description.
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

    /// A tick without a step, since there has been no state yet.
    pub(super) fn without_state(&mut self, cuts: Cuts) {
        self.counts.ticks += 1;
        self.counts.safety.add(cuts);
    }

    /// The step panicked and said this.
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
        // A device that was lost while it was written to has had a tick that says so.
        let told = safety.ticks(Cut::Device) > 0;
        cuts.note(Cut::Device, matches!(end, RunEnd::DeviceFailed(_)) && !told);
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
