//! The report of a soak: what is known so far, as text, JSON, Markdown and a page with plots.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use palpus_device::{RealTimeClaims, RunEnd, RunStatistics, SafetyCounters};
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::buckets::Buckets;
use super::figures;
use super::machine::{KEPT, Sample, Watch};
use super::scene::Ground;
use super::tally::Interval;
use super::words::spoken;
use crate::args::SoakArguments;
use crate::doctor::load::{self, Snapshot};
use crate::output;

/// At most this share of ticks may be late by over half a millisecond.
const MOST_LATE: f64 = 1e-3;
/// ns: the same bound that the loop counts by.
const LATE_NANOS: u64 = 500_000;
/// Points of the distribution that are kept.
const POINTS: u32 = 56;

/// How long something took or how late it was, µs.
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

    fn in_words(&self) -> String {
        let Self { p50, p99, p999, p9999, max } = self;
        format!("{p50:.1} µs (half), {p99:.1} (99 %), {p999:.1} (99.9 %), {p9999:.0} (99.99 %), {max:.0} (worst)")
    }
}

/// How late turns were, of the loop or of a bare timer.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Stretch {
    turns: u64,
    pub(super) late_us: Micros,
    /// Of all turns, those late by over half a millisecond.
    pub(super) late_share: f64,
    /// µs, and the share of turns that were later.
    pub(super) beyond: Vec<(f64, f64)>,
}

impl Stretch {
    pub(super) fn of(buckets: &Buckets) -> Self {
        let all = buckets.total().max(1) as f64;
        let share = |nanos: u64| buckets.beyond(nanos) as f64 / all;
        // Four points an octave, from half a microsecond on.
        let micros = |k: u32| 0.5 * 2f64.powf(f64::from(k) / 3.0);
        let beyond = (0..POINTS).map(|k| (micros(k), share((micros(k) * 1e3) as u64))).collect();
        Self { turns: buckets.total(), late_us: Micros::of(buckets), late_share: share(LATE_NANOS), beyond }
    }

    fn in_words(&self) -> String {
        format!("{}; {:.3} % of {} by over 0.5 ms", self.late_us.in_words(), self.late_share * 100.0, self.turns)
    }
}

/// A line of the table over time.
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
    /// Cores' worth of work by others.
    pub(super) others_cores: Option<f64>,
    pub(super) stolen_share: Option<f64>,
}

/// All that is known so far.
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
            hand: arguments.hand.as_deref().or(ground.stage.hand).unwrap_or("normal").to_owned(),
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
            // Written to once, so that its pages do not look like growth.
            rows: touched(most),
            samples: touched(KEPT),
            load: Snapshot::take(),
            claims: Vec::new(),
            end: None,
            failed: false,
            energy_j: None,
        })
    }

    /// What is going to happen.
    pub(super) fn announced(&self) -> String {
        format!(
            "{}: {} in real time at {:.0} Hz, a {} hand that wanders (seed {}), no window; Ctrl-C ends it with the report, which is kept in {}",
            self.scene,
            spoken(self.planned.as_secs_f64()),
            self.rate_hz,
            self.hand,
            self.seed,
            self.folder.display()
        )
    }

    /// Looks at the machine if it is time to.
    pub(super) fn see(&mut self, watch: &mut Watch, elapsed: Duration) {
        watch.look(elapsed, &mut self.samples);
    }

    /// Adds an interval, at whose end the machine was so.
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
        // The memory of the rows is there from the start; a run that goes on beyond its time is an end.
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

    /// The loop is over. What it knows of cuts and faults counts: it also knows those of ticks without a step.
    pub(super) fn end(&mut self, statistics: &RunStatistics, claims: Option<&RealTimeClaims>) {
        self.cuts.clear();
        count_cuts(&mut self.cuts, &statistics.safety);
        self.faults = statistics.safety.faults();
        self.energy_j = Some(statistics.energy.highest.max(0.0));
        self.claims =
            claims.iter().flat_map(|claims| claims.lines()).map(|(name, what)| (name, what.to_string())).collect();
        let early = self.whole.span[1] < self.planned.as_secs_f64() * 0.99;
        self.failed = !matches!(statistics.end, RunEnd::Duration | RunEnd::Stopped);
        self.end = Some(match &statistics.end {
            RunEnd::Stopped if early => "it was stopped before its time".to_owned(),
            RunEnd::Stopped | RunEnd::Duration => "its time was over".to_owned(),
            other => format!("the loop ended: {other:?}"),
        });
    }

    /// What speaks against the loop; empty when it held.
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

    fn verdict(&self) -> String {
        let failures = self.failures();
        let so_far = if self.end.is_some() { "" } else { " so far" };
        if failures.is_empty() { format!("held{so_far}") } else { format!("did not hold: {}", failures.join("; ")) }
    }

    /// How late the loop was.
    pub(super) fn lateness(&self) -> Stretch {
        Stretch::of(&self.lateness)
    }

    /// For a line that is drawn over.
    pub(super) fn live(&self) -> String {
        let row = self.rows.last().copied().unwrap_or_default();
        let late = self.late_share() * 100.0;
        format!(
            "{} of {}: {:.0} Hz, step {:.0} µs (99 %), {late:.3} % late, {} faults, {}",
            spoken(self.whole.span[1]),
            spoken(self.planned.as_secs_f64()),
            row.rate_hz,
            row.step_us.p99,
            self.faults,
            memory(row.machine.resident)
        )
    }

    /// Name and value, for people.
    fn lines(&self) -> Vec<(&'static str, String)> {
        let whole = &self.whole;
        let all = whole.ticks.max(1) as f64;
        let ran = whole.span[1].max(f64::MIN_POSITIVE);
        let mut lines = vec![
            ("verdict", self.verdict()),
            (
                "ran",
                format!(
                    "{} of {} with {}, {} hand, seed {}: {} ticks, {:.1} Hz; {}",
                    spoken(whole.span[1]),
                    spoken(self.planned.as_secs_f64()),
                    self.scene,
                    self.hand,
                    self.seed,
                    whole.ticks,
                    whole.ticks as f64 / ran,
                    self.end.as_deref().unwrap_or("it goes on")
                ),
            ),
            ("late by", self.lateness().in_words()),
        ];
        if let Some(bare) = &self.before {
            lines.push(("timer before", bare.in_words()));
        }
        if let Some(bare) = &self.after {
            lines.push(("timer after", bare.in_words()));
        }
        lines.push(("step", Micros::of(&self.step).in_words()));
        lines.push(("overruns", format!("{} ticks wrote their wrench more than a period late", whole.overruns)));
        lines.push((
            "contact",
            format!(
                "{:.0} % of ticks, begun {:.0} times a minute; mean {:.1} contacts, most {}; deepest {:.2} mm",
                100.0 * whole.touching as f64 / all,
                whole.touches as f64 / ran * 60.0,
                whole.contacts as f64 / all,
                whole.contacts_max,
                whole.depth_max * 1e3
            ),
        ));
        let energy =
            self.energy_j.map_or(String::new(), |joules| format!("; {:.2} mJ generated at most", joules * 1e3));
        lines.push((
            "felt",
            format!(
                "force mean {:.2} N, most {:.2} N; torque most {:.1} mN·m{energy}",
                whole.force / all,
                whole.force_max,
                whole.torque_max * 1e3
            ),
        ));
        lines.push(("faults", self.faults.to_string()));
        lines.push(("cuts", self.cuts_in_words()));
        lines.push(("allocations", format!("{} in the loop", whole.allocations)));
        lines.push(("trouble", format!("{} numerical stops, none of which ends a run", whole.trouble)));
        lines.push(("memory", self.memory_in_words()));
        lines.push(("machine", self.machine_in_words()));
        lines.extend(self.claims.iter().map(|(name, what)| (*name, what.clone())));
        lines
    }

    fn cuts_in_words(&self) -> String {
        let each: Vec<String> =
            self.cuts.iter().map(|(name, ticks)| format!("{} {ticks}", name.replace('_', " "))).collect();
        if each.is_empty() { "nothing".to_owned() } else { format!("{} (ticks)", each.join(", ")) }
    }

    /// At the first sample after a tenth of the run, when everything has been used once, and at the last.
    fn memory_in_words(&self) -> String {
        let Some((last, sample)) = self.samples.last() else { return "not known here".to_owned() };
        let early =
            self.samples.iter().find(|(time, _)| *time >= last / 10.0).map(|(time, sample)| (time, sample.resident));
        let (Some((time, Some(early))), Some(late)) = (early, sample.resident) else {
            return "not known here".to_owned();
        };
        let grown = (late as f64 - early as f64) / 1024.0;
        format!(
            "{} resident at {}, {} at {} ({grown:+.0} kB)",
            memory(Some(early)),
            spoken(*time),
            memory(Some(late)),
            spoken(*last)
        )
    }

    fn machine_in_words(&self) -> String {
        let mean = |of: &dyn Fn(&Row) -> Option<f64>| {
            let all: Vec<f64> = self.rows.iter().filter_map(of).collect();
            (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        let mut parts = Vec::new();
        parts.extend(mean(&|row| row.others_cores).map(|cores| format!("others kept {cores:.1} cores busy")));
        let stolen = mean(&|row| row.stolen_share).filter(|share| *share > 0.0005);
        parts.extend(stolen.map(|share| format!("{:.1} % of the time stolen by the host", share * 100.0)));
        parts.extend(mean(&|row| row.machine.mhz).map(|mhz| format!("{mhz:.0} MHz")));
        parts.extend(mean(&|row| row.machine.load_average).map(|load| format!("load average {load:.1}")));
        if parts.is_empty() { "not known here".to_owned() } else { parts.join("; ") }
    }

    pub(super) fn print(&self) {
        for (name, text) in self.lines() {
            output::line(format!("{name:>14}  {text}"));
        }
        output::line(format!("{:>14}  {}", "report", self.folder.join("soak.html").display()));
    }

    /// For `--json`; the names are a contract with those who read it.
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

    /// Writes everything anew; whoever reads meanwhile reads the last one.
    pub(super) fn write(&self) -> anyhow::Result<()> {
        let [time, late] = figures::of(self);
        replace(&self.folder.join("soak.json"), &serde_json::to_string_pretty(&self.document())?)?;
        replace(&self.folder.join("time.svg"), &time)?;
        replace(&self.folder.join("lateness.svg"), &late)?;
        replace(&self.folder.join("soak.md"), &self.markdown())?;
        replace(&self.folder.join("soak.html"), &self.page(&time, &late))
    }

    fn title(&self) -> String {
        format!("{} of {} in real time", spoken(self.whole.span[1]), self.scene)
    }

    fn markdown(&self) -> String {
        let mut text = format!("# Soak: {}\n\n| | |\n|---|---|\n", self.title());
        for (name, value) in self.lines() {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "| {name} | {} |", value.replace('|', "\\|"));
        }
        text.push_str("\n![over time](time.svg)\n\n![how late](lateness.svg)\n");
        text
    }

    fn page(&self, time: &str, late: &str) -> String {
        let mut rows = String::new();
        for (name, value) in self.lines() {
            let _ = write!(rows, "<tr><th>{}</th><td>{}</td></tr>", escaped(name), escaped(&value));
        }
        let title = escaped(&self.title());
        format!(
            "<!DOCTYPE html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Soak: {title}</title><style>{STYLE}</style></head>\
             <body><h1>Soak: {title}</h1><table>{rows}</table>{time}{late}</body></html>\n"
        )
    }
}

const STYLE: &str = "body{font-family:sans-serif;max-width:1020px;margin:2em auto;color:#222}\
    th{text-align:right;padding:.2em 1em .2em 0;vertical-align:top;white-space:nowrap}td{padding:.2em 0}svg{max-width:100%;height:auto}";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// An empty list with room for `most`, whose memory was used once.
fn touched<T: Clone + Default>(most: usize) -> Vec<T> {
    let mut list = vec![T::default(); most];
    list.iter_mut().for_each(|item| *std::hint::black_box(item) = T::default());
    list.clear();
    list
}

fn memory(bytes: Option<u64>) -> String {
    bytes.map_or("memory not known here".to_owned(), |bytes| format!("{:.1} MB", bytes as f64 / 1048576.0))
}

fn count_cuts(into: &mut Map<String, Value>, cuts: &SafetyCounters) {
    for (cut, ticks) in cuts.iter() {
        let before = into.get(cut.name()).and_then(Value::as_u64).unwrap_or(0);
        into.insert(cut.name().to_owned(), (before + ticks).into());
    }
}

/// Puts a whole file in the place of an older one.
fn replace(file: &Path, text: &str) -> anyhow::Result<()> {
    let problem = || format!("{} could not be written", file.display());
    let new = file.with_extension("new");
    fs::write(&new, text).with_context(problem)?;
    fs::rename(&new, file).with_context(problem)
}
