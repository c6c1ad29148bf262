//! Finds the first tick at which a replay differs from its recording, and the state around it.

use std::collections::VecDeque;

use palpus::algebra::Wrench;
use palpus::render::Settings;
use palpus_device::Cuts;
use palpus_io::{RecordRow, Recording};
use serde::Serialize;

use crate::output;

/// Number of ticks that are shown before and after the first different tick.
const AROUND: usize = 3;

/// Changes of settings are shown if they are within this number of ticks of the first different
/// tick.
const CHANGES_NEAR: u64 = 1000;

/// Compares a recording with its replay, tick by tick.
pub(crate) struct Comparison<'a> {
    recording: &'a Recording,
    identical: usize,
    /// Row of the first different tick.
    first: Option<usize>,
    /// The last ticks before the first different tick, this tick, and the first tick after it.
    around: VecDeque<Replayed>,
}

/// Results of a replayed tick.
#[derive(Clone, Copy)]
struct Replayed {
    row: usize,
    wrench: Wrench,
    contacts: u32,
}

impl<'a> Comparison<'a> {
    pub(crate) fn new(recording: &'a Recording) -> Self {
        Self { recording, identical: 0, first: None, around: VecDeque::new() }
    }

    /// Adds the replayed tick of row number `row`.
    pub(crate) fn add(&mut self, row: usize, wrench: &Wrench, contacts: u32) {
        if self.recording.rows[row].same_wrench(wrench) {
            self.identical += 1;
        } else {
            self.first.get_or_insert(row);
        }
        match self.first {
            Some(first) if row > first + AROUND => return,
            None if self.around.len() == AROUND => _ = self.around.pop_front(),
            _ => {}
        }
        self.around.push_back(Replayed { row, wrench: *wrench, contacts });
    }

    /// Returns the report.
    pub(crate) fn report(&self) -> Report {
        Report {
            ticks: self.recording.rows.len(),
            identical: self.identical,
            settings_changes: self.recording.changes.len(),
            first_divergence: self.first.map(|first| self.divergence(first)),
        }
    }

    fn divergence(&self, first: usize) -> Divergence {
        let rows = &self.recording.rows;
        let near = |tick: &u64| tick.abs_diff(rows[first].tick) <= CHANGES_NEAR;
        let changes = &self.recording.changes;
        // A change is described together with the settings before it.
        let before = std::iter::once(self.recording.header.scene.render).chain(changes.iter().map(|(_, after)| *after));
        let settings_changes = changes
            .iter()
            .zip(before)
            .filter(|((tick, _), _)| near(tick))
            .map(|((tick, after), before)| Change { tick: *tick, changed: changed(&before, after) })
            .collect();
        Divergence {
            tick: rows[first].tick,
            around: self.around.iter().map(|replayed| Compared::new(&rows[replayed.row], replayed)).collect(),
            settings_changes,
        }
    }
}

/// Document of `palpus replay --json`.
#[derive(Serialize)]
pub(crate) struct Report {
    ticks: usize,
    identical: usize,
    /// Number of changes of the engine's settings in the recording.
    settings_changes: usize,
    /// The first tick with a different wrench.
    first_divergence: Option<Divergence>,
}

impl Report {
    /// True if every wrench equals the recorded wrench.
    pub(crate) fn is_identical(&self) -> bool {
        self.first_divergence.is_none()
    }
}

#[derive(Serialize)]
struct Divergence {
    tick: u64,
    /// Ticks near the first different tick.
    around: Vec<Compared>,
    /// Changes of settings near this tick, in the order of the ticks.
    settings_changes: Vec<Change>,
}

#[derive(Serialize)]
struct Change {
    /// The first tick with these settings.
    tick: u64,
    /// Description for people.
    changed: String,
}

/// A tick as recorded and as replayed.
#[derive(Serialize)]
struct Compared {
    tick: u64,
    time_s: f64,
    position_m: [f64; 3],
    /// Quaternion: x, y, z, w.
    orientation: [f64; 4],
    separation_m: f64,
    recorded: Felt,
    replayed: Felt,
    same: bool,
    force_difference_n: f64,
    torque_difference_nm: f64,
    /// Interventions of the safety chain, as recorded.
    cuts: Vec<&'static str>,
}

#[derive(Serialize)]
struct Felt {
    force_n: [f64; 3],
    torque_nm: [f64; 3],
    contacts: u32,
}

impl Felt {
    fn new(wrench: &Wrench, contacts: u32) -> Self {
        Self { force_n: wrench.force.to_array(), torque_nm: wrench.torque.to_array(), contacts }
    }
}

impl Compared {
    fn new(row: &RecordRow, replayed: &Replayed) -> Self {
        Self {
            tick: row.tick,
            time_s: row.time_ns as f64 * 1e-9,
            position_m: row.pose.translation.to_array(),
            orientation: row.pose.rotation.to_array(),
            separation_m: row.separation,
            recorded: Felt::new(&row.wrench, row.contacts),
            replayed: Felt::new(&replayed.wrench, replayed.contacts),
            same: row.same_wrench(&replayed.wrench),
            force_difference_n: (replayed.wrench.force - row.wrench.force).length(),
            torque_difference_nm: (replayed.wrench.torque - row.wrench.torque).length(),
            cuts: Cuts::from_bits(row.faults).iter().map(|cut| cut.name()).collect(),
        }
    }
}

/// Returns the settings that differ, as text: the old and the new value of each.
fn changed(before: &Settings, after: &Settings) -> String {
    let fields = |settings: &Settings| -> Vec<String> {
        let text = format!("{settings:?}");
        let inside = text.split_once('{').map_or("", |(_, rest)| rest).trim_end_matches('}');
        outer_fields(inside)
    };
    let differ: Vec<String> = fields(before)
        .into_iter()
        .zip(fields(after))
        .filter(|(before, after)| before != after)
        .map(|(before, after)| {
            let value = after.split_once(": ").map_or("", |(_, value)| value);
            format!("{before} → {value}")
        })
        .collect();
    if differ.is_empty() { "nothing".to_owned() } else { differ.join(", ") }
}

/// Returns the fields of a value as `Debug` writes them. Nested fields are not divided further.
fn outer_fields(text: &str) -> Vec<String> {
    let mut fields = vec![String::new()];
    let mut depth = 0u32;
    for character in text.chars() {
        match character {
            '(' | '{' | '[' => depth += 1,
            ')' | '}' | ']' => depth = depth.saturating_sub(1),
            ',' if depth == 0 => {
                fields.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(field) = fields.last_mut() {
            field.push(character);
        }
    }
    fields.iter().map(|field| field.trim().to_owned()).collect()
}

/// Prints a report.
pub(crate) fn print(report: &Report) {
    let Some(first) = &report.first_divergence else {
        let changes = match report.settings_changes {
            0 => String::new(),
            1 => ", including one change of settings".to_owned(),
            some => format!(", including {some} changes of settings"),
        };
        output::line(format!("all {} wrenches are the same, bit for bit{changes}", report.ticks));
        return;
    };
    let differing = report.ticks - report.identical;
    output::line(format!("{differing} of {} wrenches differ; the first is tick {}:", report.ticks, first.tick));
    output::line(
        "     tick  time (s)              position (mm)    gap (mm)                    force (N)                 torque (mN·m)  contacts  cuts",
    );
    for tick in &first.around {
        let mark = if tick.tick == first.tick { '>' } else { ' ' };
        let cuts = if tick.cuts.is_empty() { "none".to_owned() } else { tick.cuts.join(", ") };
        output::line(format!(
            "{mark} {:7}  {:8.4}  {}  {:10.5}  {}  {}  {:8}  {cuts}",
            tick.tick,
            tick.time_s,
            vector(&tick.position_m, 1e3, 7, 3),
            tick.separation_m * 1e3,
            vector(&tick.recorded.force_n, 1.0, 8, 4),
            vector(&tick.recorded.torque_nm, 1e3, 8, 4),
            tick.recorded.contacts,
        ));
        if tick.same {
            continue;
        }
        output::line(format!(
            "{:>59}  {}  {}  {:8}",
            "now",
            vector(&tick.replayed.force_n, 1.0, 8, 4),
            vector(&tick.replayed.torque_nm, 1e3, 8, 4),
            tick.replayed.contacts,
        ));
        let (force, torque) = (tick.force_difference_n, tick.torque_difference_nm);
        output::line(format!("{:>59}  {force:26.3e}  {:26.3e}", "difference", torque * 1e3));
    }
    if let Some(tick) = first.around.iter().find(|tick| tick.tick == first.tick) {
        for (name, recorded, now) in [
            ("force (N)", &tick.recorded.force_n, &tick.replayed.force_n),
            ("torque (N·m)", &tick.recorded.torque_nm, &tick.replayed.torque_nm),
        ] {
            output::line(format!("  tick {}, {name}: recorded {recorded:?}, now {now:?}", tick.tick));
        }
        output::line(format!("  tick {}, turned by the quaternion (x, y, z, w) {:?}", tick.tick, tick.orientation));
    }
    match first.settings_changes.is_empty() {
        true => output::line(format!("  the settings do not change within {CHANGES_NEAR} ticks of it")),
        false => first
            .settings_changes
            .iter()
            .for_each(|change| output::line(format!("  settings from tick {} on: {}", change.tick, change.changed))),
    }
}

/// Formats three numbers with a unit, each with this width.
fn vector(values: &[f64; 3], unit: f64, width: usize, digits: usize) -> String {
    values.map(|value| format!("{:width$.digits$}", value * unit)).join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpus::force::FrictionSettings;

    #[test]
    fn changed_settings_are_named_with_old_values() {
        let before = Settings::default();
        assert_eq!(changed(&before, &before), "nothing");
        let friction =
            Some(FrictionSettings { static_coefficient: 0.4, dynamic_coefficient: 0.3, tangential_stiffness: 500.0 });
        let text = changed(&before, &Settings { stiffness: 900.0, friction, ..before });
        assert!(
            text.starts_with("stiffness: 800.0 → 900.0, friction: None → Some(FrictionSettings { static"),
            "{text}"
        );
        assert!(text.ends_with("tangential_stiffness: 500.0 })"), "{text}");
    }
}
