//! The summary of a run.

use glam::DVec3;
use hdrhistogram::Histogram;
use palpus::algebra::quantile_of_sorted;
use palpus_device::{Percentiles, RealTimeClaims, RunEnd, RunStatistics, SafetyLimits, ServoTick};
use serde::Serialize;

use crate::engine::Detail;
use crate::output;
use crate::safety::SafetyReport;

/// Percentiles of a time, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Micros {
    pub(crate) p50: f64,
    pub(crate) p99: f64,
    pub(crate) p999: f64,
    pub(crate) max: f64,
}

impl Micros {
    /// Percentiles of the finite ones of these values, µs; all 0 without a finite value.
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| quantile_of_sorted(&values, share).unwrap_or(0.0);
        Self { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: at(1.0) }
    }
}

/// Mean and maximum of a count.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Count {
    mean: f64,
    max: u32,
}

/// Time of the loop's work, as a share of the period.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Load {
    p50: f64,
    p99: f64,
    p999: f64,
    /// Share of the ticks that reached the work limit, so that some contacts were extrapolated from
    /// the previous tick.
    bounded_ticks: f64,
    /// Share of all contacts that were extrapolated.
    carried_contacts: f64,
}

/// Summary of a run; the names are an interface of `--json`.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    pub(crate) ticks: u64,
    pub(crate) duration_s: f64,
    rate_hz: f64,
    overruns: u64,
    /// Number of ticks that began more than half a millisecond after they were due.
    late_ticks: u64,
    /// Time from tick to tick, only in real time.
    period_us: Option<Micros>,
    /// Time from a tick's deadline to its beginning, only in real time.
    lateness_us: Option<Micros>,
    step_us: Micros,
    /// Load: the step as a share of the period, only in real time.
    load: Option<Load>,
    query_us: Micros,
    force_us: Micros,
    contacts: Count,
    clusters: Count,
    depth_max_m: f64,
    /// Largest distance of the tool's grip from the hand.
    tool_away_max_m: f64,
    /// Largest angle between the tool and the hand.
    tool_turned_max_rad: f64,
    force_max_n: f64,
    torque_max_nm: f64,
    force_step_max_n: f64,
    torque_step_max_nm: f64,
    saturated_ticks: u64,
    faults: u64,
    energy_generated_j: f64,
    pub(crate) allocations: u64,
    safety: SafetyReport,
    /// Counters of the device itself, by name.
    device: serde_json::Map<String, serde_json::Value>,
    trouble: Trouble,
    end: String,
    /// Reason for a run without contact; `None` with contact.
    pub(crate) no_contact: Option<String>,
}

/// Counters of numerical trouble inside ticks, which never stops a run.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(crate) struct Trouble {
    /// Number of distance marches answered by the fallback.
    march_fallbacks: u64,
    /// Number of depth walks that ended without convergence.
    walk_stops: u64,
    /// Number of depths along an admissible normal because the unconstrained direction is not
    /// admissible on both meshes.
    moved_depths: u64,
    /// Number of moved depths that were left out because they contradict the surfaces of the
    /// solids.
    rejected_depths: u64,
    /// Number of closest points that were left out because their direction is not a surface normal
    /// at this point.
    virtual_closest: u64,
    /// Number of clusters whose normals cancelled.
    cancelled_normals: u64,
    /// Number of contacts that exceeded the capacity.
    dropped_contacts: u64,
    /// Number of ticks with an invalid probe pose.
    bad_states: u64,
    /// Number of ticks in which the set of pressing and sliding contacts still changed when the
    /// tool's step ended.
    tool_unsettled: u64,
    /// Number of ticks in which the tool's step had no solution, and the tool was moved to the
    /// device's pose.
    tool_resets: u64,
}

/// Collects statistics that the loop itself does not count, on the servo thread, in preallocated
/// memory.
pub(crate) struct Gatherer {
    /// Grip in the probe's frame, m.
    grip_a: DVec3,
    query_ns: Histogram<u64>,
    force_ns: Histogram<u64>,
    ticks: u64,
    contacts: (u64, u32),
    carried: u64,
    bounded: u64,
    clusters: (u64, u32),
    depth_max: f64,
    /// Largest distance (m) and angle (rad) between tool and hand.
    tool_away: (f64, f64),
    allocations: u64,
    trouble: Trouble,
}

/// Longest stored duration, ns: 10 s.
const LONGEST_NS: u64 = 10_000_000_000;

/// Below this share of the requested rate, the loop did not hold its rate.
const HELD: f64 = 0.98;

impl Summary {
    /// True if the probe touched nothing in the whole run.
    pub(crate) fn is_untouched(&self) -> bool {
        self.ticks > 0 && self.contacts.max == 0
    }

    /// Returns the reason why a completed run still counts as failed: faults, and in real time a
    /// rate below the requested `rate_hz`.
    pub(crate) fn complaint(&self, rate_hz: f64) -> Option<String> {
        if self.faults > 0 {
            return Some(format!("{} faults", self.faults));
        }
        let slow = self.lateness_us.is_some() && self.ticks > 0 && self.rate_hz < HELD * rate_hz;
        slow.then(|| format!("the loop made {:.0} of {rate_hz:.0} ticks per second", self.rate_hz))
    }
}

impl Gatherer {
    pub(crate) fn new(grip_a: DVec3) -> anyhow::Result<Self> {
        Ok(Self {
            grip_a,
            query_ns: Histogram::new_with_bounds(1, LONGEST_NS, 3)?,
            force_ns: Histogram::new_with_bounds(1, LONGEST_NS, 3)?,
            ticks: 0,
            contacts: (0, 0),
            carried: 0,
            bounded: 0,
            clusters: (0, 0),
            depth_max: 0.0,
            tool_away: (0.0, 0.0),
            allocations: 0,
            trouble: Trouble::default(),
        })
    }

    /// Adds a tick.
    pub(crate) fn add(&mut self, _: &ServoTick, detail: &Detail) {
        let tick = &detail.tick;
        self.query_ns.saturating_record((tick.times.query + tick.times.depth).max(1));
        self.force_ns.saturating_record(tick.times.force.max(1));
        self.ticks += 1;
        self.contacts = (self.contacts.0 + u64::from(tick.contacts), self.contacts.1.max(tick.contacts));
        self.carried += u64::from(tick.counters.query.held);
        self.bounded += u64::from(tick.counters.query.traversal.postponed > 0);
        self.clusters = (self.clusters.0 + u64::from(tick.clusters), self.clusters.1.max(tick.clusters));
        self.depth_max = self.depth_max.max(-tick.separation);
        let (hand, tool) = (&tick.probe.pose_ba, &tick.tool_ba);
        let away = hand.point(self.grip_a).distance(tool.point(self.grip_a));
        let turned = hand.rotation.angle_between(tool.rotation);
        self.tool_away = (self.tool_away.0.max(away), self.tool_away.1.max(turned));
        self.allocations += detail.allocations;
        let (counters, trouble) = (&tick.counters, &mut self.trouble);
        trouble.march_fallbacks += u64::from(counters.query.traversal.march_fallbacks);
        trouble.walk_stops += u64::from(counters.query.walk_stops);
        trouble.moved_depths += u64::from(counters.query.moved);
        trouble.rejected_depths += u64::from(counters.query.rejected);
        trouble.virtual_closest += u64::from(counters.query.virtual_closest);
        trouble.cancelled_normals += u64::from(counters.cancelled_normals);
        trouble.dropped_contacts += u64::from(counters.query.traversal.dropped);
        trouble.bad_states += u64::from(counters.bad_state);
        trouble.tool_unsettled += u64::from(counters.tool.unsettled);
        trouble.tool_resets += u64::from(counters.tool.reset);
    }

    fn load(&self, statistics: &RunStatistics, rate_hz: f64) -> Load {
        let share = |part: u64, of: u64| part as f64 / of.max(1) as f64;
        let Percentiles { p50, p99, p999, .. } = statistics.step_us;
        let of_period = |micros: f64| micros * 1e-6 * rate_hz;
        Load {
            p50: of_period(p50),
            p99: of_period(p99),
            p999: of_period(p999),
            bounded_ticks: share(self.bounded, self.ticks),
            carried_contacts: share(self.carried, self.contacts.0),
        }
    }

    /// Returns the summary of a run from the loop's `statistics`, the device's `limits`, and the
    /// granted real-time rights.
    pub(crate) fn finish(
        self,
        statistics: &RunStatistics,
        limits: &SafetyLimits,
        claims: Option<&RealTimeClaims>,
        rate_hz: f64,
    ) -> Summary {
        let mean = |sum: u64| if self.ticks > 0 { sum as f64 / self.ticks as f64 } else { 0.0 };
        Summary {
            ticks: statistics.ticks,
            duration_s: statistics.duration_s,
            rate_hz: statistics.rate_hz,
            overruns: statistics.overruns,
            late_ticks: statistics.late_ticks,
            period_us: statistics.period_us.as_ref().map(of_loop),
            lateness_us: statistics.lateness_us.as_ref().map(of_loop),
            step_us: of_loop(&statistics.step_us),
            load: statistics.lateness_us.is_some().then(|| self.load(statistics, rate_hz)),
            query_us: micros(&self.query_ns),
            force_us: micros(&self.force_ns),
            contacts: Count { mean: mean(self.contacts.0), max: self.contacts.1 },
            clusters: Count { mean: mean(self.clusters.0), max: self.clusters.1 },
            depth_max_m: self.depth_max,
            tool_away_max_m: self.tool_away.0,
            tool_turned_max_rad: self.tool_away.1,
            force_max_n: statistics.force_max,
            torque_max_nm: statistics.torque_max,
            force_step_max_n: statistics.force_step_max,
            torque_step_max_nm: statistics.torque_step_max,
            saturated_ticks: statistics.saturated_ticks,
            faults: statistics.safety.faults(),
            energy_generated_j: statistics.energy.highest.max(0.0),
            allocations: self.allocations,
            safety: SafetyReport::new(&statistics.safety, limits, claims),
            device: statistics.device.iter().map(|(name, count)| ((*name).to_owned(), (*count).into())).collect(),
            trouble: self.trouble,
            end: end(&statistics.end),
            no_contact: None,
        }
    }
}

fn micros(histogram: &Histogram<u64>) -> Micros {
    let at = |quantile| histogram.value_at_quantile(quantile) as f64 / 1e3;
    Micros { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: histogram.max() as f64 / 1e3 }
}

fn of_loop(times: &Percentiles) -> Micros {
    Micros { p50: times.p50, p99: times.p99, p999: times.p999, max: times.max }
}

/// Describes why a run ended.
pub fn end(end: &RunEnd) -> String {
    match end {
        RunEnd::Duration => "ended after the set duration".to_owned(),
        RunEnd::Stopped => "it was stopped".to_owned(),
        RunEnd::DeviceEnded => "the recording ended".to_owned(),
        RunEnd::DeviceFailed(error) => format!("the device failed: {error}"),
        RunEnd::Panicked(message) => format!("a step panicked: {message}"),
        RunEnd::Faulted(cuts) => {
            let names: Vec<String> = cuts.iter().map(|cut| cut.name().replace('_', " ")).collect();
            format!("a fault: {}", names.join(", "))
        }
    }
}

/// Describes the lateness of the loop.
fn pace(summary: &Summary) -> String {
    let Some(lateness) = &summary.lateness_us else { return "simulated time".to_owned() };
    let Micros { p50, p99, max, .. } = lateness;
    let share = 100.0 * summary.late_ticks as f64 / summary.ticks.max(1) as f64;
    format!(
        "lateness p50 {p50:.1}  p99 {p99:.1}  max {max:.1} µs; {} ticks ({share:.2} %) late by more than 0.5 ms",
        summary.late_ticks
    )
}

/// Describes the step as a share of the period, and the extrapolated contacts.
fn load(load: &Load) -> String {
    let percent = |x: f64| format!("{:.0} %", 100.0 * x);
    let Load { p50, p99, p999, bounded_ticks, carried_contacts } = load;
    let mut words =
        format!("step p50 {}  p99 {}  p99.9 {} of the period", percent(*p50), percent(*p99), percent(*p999));
    if *bounded_ticks > 0.0 {
        words += &format!(
            "; work limited in {} of the ticks, {} of the contacts extrapolated",
            percent(*bounded_ticks),
            percent(*carried_contacts)
        );
    }
    words
}

/// Prints the summary as text.
pub(crate) fn print(summary: &Summary) {
    let micros = |m: &Micros| format!("p50 {:.1}  p99 {:.1}  p99.9 {:.1}  max {:.1} µs", m.p50, m.p99, m.p999, m.max);
    let rows = [
        (
            "ran",
            format!(
                "{:.2} s, {} ticks at {:.0} Hz, {} overruns; {}",
                summary.duration_s, summary.ticks, summary.rate_hz, summary.overruns, summary.end
            ),
        ),
        ("pace", pace(summary)),
        ("step", micros(&summary.step_us)),
        ("contact query", micros(&summary.query_us)),
        ("force", micros(&summary.force_us)),
        (
            "contacts",
            format!(
                "mean {:.1}, at most {}; clusters mean {:.1}, at most {}",
                summary.contacts.mean, summary.contacts.max, summary.clusters.mean, summary.clusters.max
            ),
        ),
        ("overlap", format!("at most {:.3} mm", summary.depth_max_m * 1e3)),
        (
            "tool",
            format!(
                "at most {:.2} mm from the hand, turned by at most {:.1}°",
                summary.tool_away_max_m * 1e3,
                summary.tool_turned_max_rad.to_degrees()
            ),
        ),
        (
            "wrench",
            format!(
                "peak force {:.2} N, peak torque {:.1} mN·m; saturated in {} ticks",
                summary.force_max_n,
                summary.torque_max_nm * 1e3,
                summary.saturated_ticks
            ),
        ),
        (
            "force change",
            format!(
                "at most {:.3} N, {:.2} mN·m in one tick",
                summary.force_step_max_n,
                summary.torque_step_max_nm * 1e3
            ),
        ),
        (
            "health",
            format!(
                "{} faults, {} allocations in the loop, {:.2} mJ given to the hand",
                summary.faults,
                summary.allocations,
                summary.energy_generated_j * 1e3
            ),
        ),
        ("safety", summary.safety.cuts()),
    ];
    for (name, text) in rows {
        if let (Some(summary), "step") = (&summary.load, name) {
            output::line(format!("{:>14}  {}", "load", load(summary)));
        }
        output::line(format!("{name:>14}  {text}"));
        if let (Some(why), "contacts") = (&summary.no_contact, name) {
            output::line(format!("{:>14}  {why}", ""));
        }
    }
    let counted: Vec<String> = summary
        .device
        .iter()
        .filter(|(_, count)| count.as_u64().is_some_and(|count| count > 0))
        .map(|(name, count)| format!("{name} {count}"))
        .collect();
    if !counted.is_empty() {
        output::line(format!("{:>14}  {}", "device says", counted.join(", ")));
    }
}
