//! Measures of a run, from the rows of its recording.

use palpus_device::{Cut, Cuts};
use palpus_io::RecordRow;

use crate::plots::{query_us, seconds};
use crate::summary::Micros;

/// An intervention of the safety chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutTime {
    pub(super) cut: Cut,
    pub(super) ticks: u64,
    /// Time since the run began, s.
    pub(super) first: f64,
    pub(super) last: f64,
}

/// Figures of a run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Measures {
    pub(super) ticks: u64,
    pub(super) duration_s: f64,
    /// Rate computed from the ticks' own lengths, Hz.
    pub(super) rate_hz: f64,
    pub(super) step: Micros,
    pub(super) query: Micros,
    pub(super) force: Micros,
    pub(super) period: Micros,
    /// Lateness of the ticks; `None` for a run in simulated time.
    pub(super) lateness: Option<Micros>,
    /// Number of ticks that began more than half a period late.
    pub(super) late: u64,
    pub(super) contacts_mean: f64,
    pub(super) contacts_max: u32,
    pub(super) clusters_max: u32,
    /// Number of ticks with a contact.
    pub(super) touching: u64,
    /// Number of ticks in which the bodies overlap.
    pub(super) penetrating: u64,
    /// Smallest separation, m; negative if the bodies overlap.
    pub(super) least_separation: f64,
    /// Largest force (N) and torque (N·m).
    pub(super) force_max: f64,
    pub(super) torque_max: f64,
    pub(super) force_step_max: f64,
    pub(super) torque_step_max: f64,
    pub(super) saturated: u64,
    pub(super) cuts: Vec<CutTime>,
}

impl Measures {
    pub(super) fn of(rows: &[RecordRow]) -> Self {
        let largest = |of: &dyn Fn(&RecordRow) -> f64| rows.iter().map(of).fold(0.0, f64::max);
        let count = |of: &dyn Fn(&RecordRow) -> bool| rows.iter().filter(|row| of(row)).count() as u64;
        let steps = |of: &dyn Fn(&[RecordRow]) -> f64| rows.windows(2).map(of).fold(0.0, f64::max);
        let ticks = rows.len() as u64;
        let lateness = |row: &RecordRow| row.servo.map_or(0.0, |servo| servo.lateness_s);
        let is_real = rows.iter().any(|row| lateness(row) > 0.0);
        let length: f64 = rows.iter().map(|row| row.dt).sum();
        Self {
            ticks,
            duration_s: rows.last().map_or(0.0, |row| seconds(row) + row.dt),
            rate_hz: if length > 0.0 { ticks as f64 / length } else { 0.0 },
            step: Micros::of(rows.iter().map(|row| row.total_us)),
            query: Micros::of(rows.iter().map(query_us)),
            force: Micros::of(rows.iter().map(|row| row.force_us)),
            period: Micros::of(rows.windows(2).map(|pair| (seconds(&pair[1]) - seconds(&pair[0])) * 1e6)),
            lateness: is_real.then(|| Micros::of(rows.iter().map(|row| lateness(row) * 1e6))),
            late: count(&|row| lateness(row) > 0.5 * row.dt),
            contacts_mean: rows.iter().map(|row| f64::from(row.contacts)).sum::<f64>() / ticks.max(1) as f64,
            contacts_max: rows.iter().map(|row| row.contacts).max().unwrap_or(0),
            clusters_max: rows.iter().map(|row| row.clusters).max().unwrap_or(0),
            touching: count(&|row| row.contacts > 0),
            penetrating: count(&|row| row.separation < 0.0),
            least_separation: rows.iter().map(|row| row.separation).fold(f64::INFINITY, f64::min),
            force_max: largest(&|row| row.wrench.force.length()),
            torque_max: largest(&|row| row.wrench.torque.length()),
            force_step_max: steps(&|pair| pair[1].wrench.force.distance(pair[0].wrench.force)),
            torque_step_max: steps(&|pair| pair[1].wrench.torque.distance(pair[0].wrench.torque)),
            saturated: count(&|row| row.saturated),
            cuts: cuts(rows),
        }
    }

    /// Returns the number of ticks in which a fault removed the force.
    pub(super) fn fault_ticks(&self) -> u64 {
        self.cuts.iter().filter(|cut| cut.cut.is_fault()).map(|cut| cut.ticks).sum()
    }
}

fn cuts(rows: &[RecordRow]) -> Vec<CutTime> {
    let of = |cut: Cut| {
        let mut cut_in = rows.iter().filter(|row| Cuts::from_bits(row.faults).has(cut));
        let first = cut_in.next()?;
        let (mut ticks, mut last) = (1, first);
        for row in cut_in {
            (ticks, last) = (ticks + 1, row);
        }
        Some(CutTime { cut, ticks, first: seconds(first), last: seconds(last) })
    };
    Cut::ALL.into_iter().filter_map(of).collect()
}

/// A tick that is shown as a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Choice {
    pub(super) tick: u64,
    pub(super) what: &'static str,
}

/// Returns one picture each for the deepest (or nearest) contact, most contacts, and the largest
/// force, without duplicates.
pub(super) fn choices(rows: &[RecordRow]) -> Vec<Choice> {
    let mut choices: Vec<Choice> = Vec::new();
    let mut choose = |what: &'static str, value: &dyn Fn(&RecordRow) -> f64| {
        let best = rows.iter().filter(|row| row.contacts > 0).max_by(|a, b| value(a).total_cmp(&value(b)));
        let Some(row) = best else { return };
        if choices.iter().all(|known| known.tick.abs_diff(row.tick) > SAME_MOMENT) {
            choices.push(Choice { tick: row.tick, what });
        }
    };
    let overlap = rows.iter().any(|row| row.separation < 0.0);
    choose(if overlap { "deepest contact" } else { "closest contact" }, &|row| -row.separation);
    choose("most contacts", &|row| f64::from(row.contacts));
    choose("largest force", &|row| row.wrench.force.length());
    choices
}

/// Ticks that are nearer to each other than this have similar pictures.
const SAME_MOMENT: u64 = 10;

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use palpus::algebra::{Pose, Twist, Wrench};

    use super::*;

    fn row(tick: u64, contacts: u32, separation: f64, force: f64) -> RecordRow {
        RecordRow {
            tick,
            time_ns: tick * 1_000_000,
            dt: 1e-3,
            pose: Pose::IDENTITY,
            twist: Twist { angular: DVec3::ZERO, linear: DVec3::ZERO },
            buttons: 0,
            wrench: Wrench { torque: DVec3::ZERO, force: DVec3::new(force, 0.0, 0.0) },
            contacts,
            clusters: contacts.min(1),
            separation,
            query_us: 2.0,
            depth_us: None,
            force_us: 1.0,
            total_us: tick as f64,
            saturated: false,
            faults: if tick == 50 || tick == 60 { 1 << Cut::PoseJump as u32 } else { 0 },
            tool: Some(Pose::IDENTITY),
            servo: None,
        }
    }

    fn rows() -> Vec<RecordRow> {
        let mut rows: Vec<RecordRow> = (0..1000).map(|tick| row(tick, 0, f64::INFINITY, 0.0)).collect();
        rows[100] = row(100, 2, -1e-3, 0.5);
        rows[300] = row(300, 9, 1e-4, 0.1);
        rows[303] = row(303, 1, 1e-4, 3.0);
        rows
    }

    #[test]
    fn run_is_measured_from_its_rows() {
        let measures = Measures::of(&rows());
        assert_eq!((measures.ticks, measures.touching, measures.penetrating), (1000, 3, 1));
        assert!((measures.duration_s - 1.0).abs() < 1e-9 && (measures.rate_hz - 1000.0).abs() < 1e-6);
        assert_eq!((measures.step.p50, measures.step.max), (499.0, 999.0));
        assert_eq!((measures.force_max, measures.force_step_max, measures.least_separation), (3.0, 3.0, -1e-3));
        let [cut] = measures.cuts[..] else { panic!("{:?}", measures.cuts) };
        assert_eq!((cut.cut, cut.ticks), (Cut::PoseJump, 2));
        assert!((cut.first - 0.05).abs() < 1e-12 && (cut.last - 0.06).abs() < 1e-12);
        assert_eq!(measures.fault_ticks(), 2);
        assert_eq!(Measures::of(&[]).ticks, 0);
    }

    #[test]
    fn moments_that_look_the_same_are_shown_once() {
        let choices = choices(&rows());
        assert_eq!(choices.iter().map(|choice| choice.tick).collect::<Vec<_>>(), [100, 300]);
        assert_eq!(choices[0].what, "deepest contact");
        assert!(super::choices(&[]).is_empty());
    }
}
