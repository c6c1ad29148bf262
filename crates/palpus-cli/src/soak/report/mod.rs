//! The report of a soak run, updated during the run.
//!
//! * This file collects the data, decides whether the loop held, and writes the JSON.
//! * [`words`] — the report for people.
//! * [`pages`] — the files: Markdown, and a page with plots.

mod pages;
mod words;

use std::fs;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use palpus_device::{RealTimeClaims, RunEnd, RunStatistics, SafetyCounters};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::buckets::Buckets;
use super::machine::{KEPT, Sample, Watch};
use super::scene::Ground;
use super::tally::Interval;
use crate::args::SoakArguments;
use crate::doctor::load::{self, Snapshot};

/// Largest share of ticks that may be late by over half a millisecond.
const MOST_LATE: f64 = 1e-3;
/// Lateness from which a tick counts as late, ns, as in the loop.
const LATE_NANOS: u64 = 500_000;
/// Number of stored points of the distribution.
const POINTS: u32 = 56;

/// Distribution of a duration or a lateness, µs.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Micros {
    pub(super) p50: f64,
    pub(super) p99: f64,
    pub(super) p999: f64,
    pub(super) p9999: f64,
    pub(super) max: f64,
}

impl Micros {
    pub(super) fn of(buckets: &Buckets) -> Self {
        let at = |share| buckets.quantile(share);
        Self { p50: at(0.5), p99: at(0.99), p999: at(0.999), p9999: at(0.9999), max: buckets.longest() }
    }
}

/// Lateness of the wake-ups of the loop or of a bare timer.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Stretch {
    turns: u64,
    pub(super) late_us: Micros,
    /// Share of the wake-ups that were late by more than half a millisecond.
    pub(super) late_share: f64,
    /// Lateness (µs), and the share of wake-ups that were later.
    pub(super) beyond: Vec<(f64, f64)>,
}

impl Stretch {
    pub(super) fn of(buckets: &Buckets) -> Self {
        let all = buckets.total().max(1) as f64;
        let share = |nanos: u64| buckets.beyond(nanos) as f64 / all;
        // Three points in each octave, from half a microsecond on.
        let micros = |k: u32| 0.5 * 2f64.powf(f64::from(k) / 3.0);
        let beyond = (0..POINTS).map(|k| (micros(k), share((micros(k) * 1e3) as u64))).collect();
        Self { turns: buckets.total(), late_us: Micros::of(buckets), late_share: share(LATE_NANOS), beyond }
    }
}

/// A row of the table over time.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Row {
    pub(super) begin_s: f64,
    pub(super) end_s: f64,
    pub(super) rate_hz: f64,
    pub(super) lateness_us: Micros,
    pub(super) late_share: f64,
    pub(super) step_us: Micros,
    pub(super) overruns: u64,
    pub(super) contacts_mean: f64,
    pub(super) contacts_max: u32,
    pub(super) touching_share: f64,
    pub(super) force_mean_n: f64,
    pub(super) force_max_n: f64,
    pub(super) faults: u64,
    pub(super) allocations: u64,
    pub(super) machine: Sample,
    /// Load by other programs, in cores.
    pub(super) others_cores: Option<f64>,
    pub(super) stolen_share: Option<f64>,
}

/// All data so far.
pub(super) struct Report {
    folder: PathBuf,
    pub(super) scene: String,
    hand: String,
    seed: u64,
    rate_hz: f64,
    planned: Duration,
    pub(super) before: Option<Stretch>,
    pub(super) after: Option<Stretch>,
    lateness: Buckets,
    step: Buckets,
    whole: Interval,
    cuts: Map<String, Value>,
    faults: u64,
    pub(super) rows: Vec<Row>,
    pub(super) samples: Vec<(f64, Sample)>,
    load: Option<Snapshot>,
    claims: Vec<(&'static str, String)>,
    end: Option<String>,
    failed: bool,
    energy_j: Option<f64>,
}

impl Report {
    pub(super) fn new(
        arguments: &SoakArguments,
        ground: &Ground,
        rate_hz: f64,
        interval: Duration,
    ) -> anyhow::Result<Self> {
        let folder = arguments.out.clone();
        fs::create_dir_all(&folder)
            .with_context(|| format!("{} could not be created; name another folder with --out", folder.display()))?;
        let most = (arguments.duration.0.as_secs_f64() / interval.as_secs_f64()).ceil() as usize + 2;
        Ok(Self {
            folder,
            scene: ground.name.clone(),
            hand: ground.hands[0].stage.hand_name(arguments.hand.as_deref()).to_owned(),
            seed: arguments.seed,
            rate_hz,
            planned: arguments.duration.0,
            before: None,
            after: None,
            lateness: Buckets::default(),
            step: Buckets::default(),
            whole: Interval::default(),
            cuts: Map::new(),
            faults: 0,
            // Touches the memory once, so that first use does not look like growth.
            rows: touched(most),
            samples: touched(KEPT),
            load: Snapshot::take(),
            claims: Vec::new(),
            end: None,
            failed: false,
            energy_j: None,
        })
    }

    /// Samples the machine if the interval between samples has passed.
    pub(super) fn see(&mut self, watch: &mut Watch, elapsed: Duration) {
        watch.look(elapsed, &mut self.samples);
    }

    /// Adds an interval, with the state of the machine at its end.
    pub(super) fn add(&mut self, interval: &Interval, machine: Sample) {
        let Interval { span: [begin, end], ticks, .. } = *interval;
        if ticks == 0 || end <= begin {
            return;
        }
        self.lateness.merge(&interval.lateness);
        self.step.merge(&interval.step);
        let whole = &mut self.whole;
        whole.span[1] = end;
        whole.ticks += ticks;
        whole.late += interval.late;
        whole.overruns += interval.overruns;
        whole.contacts += interval.contacts;
        whole.contacts_max = whole.contacts_max.max(interval.contacts_max);
        whole.touching += interval.touching;
        whole.touches += interval.touches;
        whole.force += interval.force;
        whole.force_max = whole.force_max.max(interval.force_max);
        whole.torque_max = whole.torque_max.max(interval.torque_max);
        whole.depth_max = whole.depth_max.max(interval.depth_max);
        whole.allocations += interval.allocations;
        whole.trouble += interval.trouble;
        self.faults += interval.faults;
        count_cuts(&mut self.cuts, &interval.cuts);
        let now = Snapshot::take();
        let load = load::between(self.load.take(), now.clone());
        self.load = now;
        let all = ticks as f64;
        // The rows were allocated at the start; rows of a run that exceeds its duration are
        // dropped.
        if self.rows.len() < self.rows.capacity() {
            self.rows.push(Row {
                begin_s: begin,
                end_s: end,
                rate_hz: all / (end - begin),
                lateness_us: Micros::of(&interval.lateness),
                late_share: interval.late as f64 / all,
                step_us: Micros::of(&interval.step),
                overruns: interval.overruns,
                contacts_mean: interval.contacts as f64 / all,
                contacts_max: interval.contacts_max,
                touching_share: interval.touching as f64 / all,
                force_mean_n: interval.force / all,
                force_max_n: interval.force_max,
                faults: interval.faults,
                allocations: interval.allocations,
                machine,
                others_cores: load.as_ref().map(|load| load.others_cores),
                stolen_share: load.as_ref().map(|load| load.stolen_share),
            });
        }
    }

    /// Takes the loop's final counts of cuts and faults, which include ticks without a step.
    pub(super) fn end(&mut self, devices: &[RunStatistics], claims: Option<&RealTimeClaims>) {
        self.cuts.clear();
        devices.iter().for_each(|device| count_cuts(&mut self.cuts, &device.safety));
        self.faults = devices.iter().map(|device| device.safety.faults()).sum();
        self.energy_j = Some(devices.iter().map(|device| device.energy.highest).fold(0.0, f64::max));
        self.claims =
            claims.iter().flat_map(|claims| claims.lines()).map(|(name, what)| (name, what.to_string())).collect();
        let early = self.whole.span[1] < self.planned.as_secs_f64() * 0.99;
        let as_planned = |device: &&RunStatistics| matches!(device.end, RunEnd::Duration | RunEnd::Stopped);
        let failed = devices.iter().find(|device| !as_planned(device));
        self.failed = failed.is_some();
        let end = failed.or(devices.first()).map_or(&RunEnd::Stopped, |device| &device.end);
        self.end = Some(match end {
            RunEnd::Stopped if early => "it was stopped early".to_owned(),
            RunEnd::Stopped | RunEnd::Duration => "its time was over".to_owned(),
            other => format!("the loop ended: {other:?}"),
        });
    }

    /// Returns the reasons why the loop did not hold its rate; empty if it held.
    pub(super) fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        if self.failed {
            failures.extend(self.end.clone());
        }
        if self.faults > 0 {
            failures.push(format!("{} faults", self.faults));
        }
        if self.whole.allocations > 0 {
            failures.push(format!("{} allocations in the loop", self.whole.allocations));
        }
        let late = self.late_share();
        let bare = [&self.before, &self.after].into_iter().flatten().map(|bare| bare.late_share).fold(0.0, f64::max);
        if late > MOST_LATE && late > bare {
            failures.push(format!(
                "{:.2} % of ticks late by over 0.5 ms, the bare timer {:.2} %",
                late * 100.0,
                bare * 100.0
            ));
        }
        failures
    }

    pub(super) fn held(&self) -> bool {
        self.failures().is_empty()
    }

    fn late_share(&self) -> f64 {
        self.whole.late as f64 / self.whole.ticks.max(1) as f64
    }

    /// Returns the lateness of the loop.
    pub(super) fn lateness(&self) -> Stretch {
        Stretch::of(&self.lateness)
    }

    /// Returns the document of `--json`; the field names are its interface.
    pub(super) fn document(&self) -> Value {
        let whole = &self.whole;
        let all = whole.ticks.max(1) as f64;
        json!({
            "held": self.held(),
            "failures": self.failures(),
            "finished": self.end.is_some(),
            "end": self.end,
            "palpus_version": env!("CARGO_PKG_VERSION"),
            "scene": self.scene,
            "hand": self.hand,
            "seed": self.seed,
            "rate_hz": self.rate_hz,
            "planned_s": self.planned.as_secs_f64(),
            "ran_s": whole.span[1],
            "ticks": whole.ticks,
            "lateness": self.lateness(),
            "timer_before": self.before,
            "timer_after": self.after,
            "late_ticks": whole.late,
            "step_us": Micros::of(&self.step),
            "overruns": whole.overruns,
            "contacts": {
                "mean": whole.contacts as f64 / all,
                "max": whole.contacts_max,
                "touching_share": whole.touching as f64 / all,
                "touches": whole.touches,
                "depth_max_m": whole.depth_max,
            },
            "force_mean_n": whole.force / all,
            "force_max_n": whole.force_max,
            "torque_max_nm": whole.torque_max,
            "energy_generated_j": self.energy_j,
            "faults": self.faults,
            "cuts": self.cuts,
            "allocations": whole.allocations,
            "trouble": whole.trouble,
            "real_time": self.claims.iter().map(|(name, what)| json!({ "name": name, "what": what })).collect::<Vec<_>>(),
            "over_time": self.rows,
            "machine": self.samples.iter().map(|(time, sample)| json!({ "time_s": time, "sample": sample })).collect::<Vec<_>>(),
        })
    }
}

/// Returns an empty list with capacity for `most` items, whose memory has been touched once.
fn touched<T: Clone + Default>(most: usize) -> Vec<T> {
    let mut list = vec![T::default(); most];
    list.iter_mut().for_each(|item| *std::hint::black_box(item) = T::default());
    list.clear();
    list
}

fn count_cuts(into: &mut Map<String, Value>, cuts: &SafetyCounters) {
    for (cut, ticks) in cuts.iter() {
        let before = into.get(cut.name()).and_then(Value::as_u64).unwrap_or(0);
        into.insert(cut.name().to_owned(), (before + ticks).into());
    }
}
