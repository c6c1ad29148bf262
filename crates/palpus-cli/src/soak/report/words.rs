//! Formats the report as text.

use super::{Micros, Report, Row, Stretch};
use crate::durations::spoken;
use crate::output;
use crate::safety::cuts_in_words;
use crate::soak::machine;

impl Micros {
    fn in_words(&self) -> String {
        let Self { p50, p99, p999, p9999, max } = self;
        format!("{p50:.1} µs (median), {p99:.1} (p99), {p999:.1} (p99.9), {p9999:.0} (p99.99), {max:.0} (largest)")
    }
}

impl Stretch {
    fn in_words(&self) -> String {
        format!("{}; {:.3} % of {} by over 0.5 ms", self.late_us.in_words(), self.late_share * 100.0, self.turns)
    }
}

impl Report {
    /// Returns the announcement of the run.
    pub(in crate::soak) fn announced(&self) -> String {
        format!(
            "{}: {} in real time at {:.0} Hz, a {} hand that moves at random (seed {}), no window; Ctrl-C ends the run with its report in {}",
            self.scene,
            spoken(self.planned.as_secs_f64()),
            self.rate_hz,
            self.hand,
            self.seed,
            self.folder.display()
        )
    }

    fn verdict(&self) -> String {
        let failures = self.failures();
        let so_far = if self.end.is_some() { "" } else { " so far" };
        if failures.is_empty() { format!("held{so_far}") } else { format!("did not hold: {}", failures.join("; ")) }
    }

    /// Returns the text of the live line.
    pub(in crate::soak) fn live(&self) -> String {
        let row = self.rows.last().copied().unwrap_or_default();
        let late = self.late_share() * 100.0;
        format!(
            "{} of {}: {:.0} Hz, step {:.0} µs (p99), {late:.3} % late, {} faults, {}",
            spoken(self.whole.span[1]),
            spoken(self.planned.as_secs_f64()),
            row.rate_hz,
            row.step_us.p99,
            self.faults,
            memory(row.machine.resident)
        )
    }

    /// Returns names and values, for people.
    pub(super) fn lines(&self) -> Vec<(&'static str, String)> {
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
        lines.push(("cuts", cuts_in_words(&self.cuts)));
        lines.push(("allocations", format!("{} in the loop", whole.allocations)));
        lines.push(("trouble", format!("{} numerical stops, which do not end a run", whole.trouble)));
        lines.push(("memory", self.memory_in_words()));
        lines.push(("machine", self.machine_in_words()));
        lines.extend(self.claims.iter().map(|(name, what)| (*name, what.clone())));
        lines
    }

    /// Describes the memory at two samples: the first sample after a tenth of the run, when all
    /// memory has been used once, and the last sample.
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
        let mean =
            |of: &dyn Fn(&Row) -> Option<f64>| machine::mean(&self.rows.iter().filter_map(of).collect::<Vec<_>>());
        let mut parts = Vec::new();
        parts.extend(mean(&|row| row.others_cores).map(|cores| format!("other programs kept {cores:.1} cores busy")));
        let stolen = mean(&|row| row.stolen_share).filter(|share| *share > 0.0005);
        parts.extend(stolen.map(|share| format!("the host took {:.1} % of the time", share * 100.0)));
        parts.extend(mean(&|row| row.machine.mhz).map(|mhz| format!("{mhz:.0} MHz")));
        parts.extend(mean(&|row| row.machine.load_average).map(|load| format!("load average {load:.1}")));
        if parts.is_empty() { "not known here".to_owned() } else { parts.join("; ") }
    }

    pub(in crate::soak) fn print(&self) {
        for (name, text) in self.lines() {
            output::line(format!("{name:>14}  {text}"));
        }
        output::line(format!("{:>14}  {}", "report", self.folder.join("soak.html").display()));
    }
}

fn memory(bytes: Option<u64>) -> String {
    bytes.map_or("memory not known here".to_owned(), |bytes| format!("{:.1} MB", bytes as f64 / 1048576.0))
}
