//! Runs the ticks of a case and measures time, work and the error of the wrench.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Wrench, quantile_of_sorted};
use palpus::detect::{Contact, ContactQuery, Proof, QueryCounters, QuerySettings};
use palpus::force::{LoadSharing, Tilted};
use palpus::render::{Limits, ProbeState, Renderer, Settings, Tick, VirtualCoupling, WorkLimit};
use palpus_device::HelperThread;
use serde::{Serialize, Serializer};

use super::cases::{Analytic, Case};
use super::cpu::CpuClock;
use super::trace::{Answer, Trace};
use crate::bench::{TICK, settings, use_large_pages};

/// Limit of the work of a coupled step, in units of work.
const ALLOWED: u64 = 6000;
/// Capacity for contacts of the queries that compute the true wrench.
const TRUE_CAPACITY: usize = 1 << 15;
/// With at least this many contacts, the true wrench has one contact for each pair of pieces.
const MANY: usize = 512;

/// Results of a case. Times in µs.
#[derive(Debug, Serialize)]
pub(super) struct Row {
    pub(super) name: String,
    /// Contact tolerance, m.
    pub(super) tolerance: f64,
    pub(super) ticks: usize,
    pub(super) contacts: f64,
    pub(super) p50: f64,
    pub(super) p99: f64,
    pub(super) p999: f64,
    /// Mean times of the three stages.
    pub(super) query: f64,
    pub(super) depth: f64,
    pub(super) force: f64,
    /// Share of the ticks in which the work limit was reached.
    pub(super) late: f64,
    pub(super) each: PerTick,
    pub(super) wrench: Accuracy,
}

impl Row {
    pub(super) fn line(&self) -> String {
        let Self { name, contacts, p50, p99, p999, .. } = self;
        format!("{name}: {contacts:.0} contacts, {p50:.0} µs (median), {p99:.0} (p99), {p999:.0} (p99.9)")
    }
}

/// Mean of each counter over the ticks, in the order of [`COUNTED`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PerTick([f64; COUNTED.len()]);

/// A counter: its name in the document, its heading, and its value.
type Counted = (&'static str, &'static str, fn(&QueryCounters) -> u32);

/// The counters.
pub(super) const COUNTED: [Counted; 16] = [
    ("front", "front", |counters| counters.traversal.front),
    ("woken", "due", |counters| counters.traversal.woken),
    ("looked", "looked", |counters| counters.traversal.node_pairs),
    ("near", "near", |counters| counters.traversal.near),
    ("marched", "marched", |counters| counters.traversal.leaf_tests),
    ("march_steps", "steps", |counters| counters.traversal.march_steps),
    ("carried", "carried", |counters| counters.held),
    ("resting", "at rest", |counters| counters.traversal.resting),
    ("idle", "idle", |counters| counters.traversal.idle),
    ("virtual_closest", "no surface", |counters| counters.virtual_closest),
    ("inadmissible", "no normal", |counters| counters.inadmissible),
    ("walks", "walked", |counters| counters.walks),
    ("moved", "moved", |counters| counters.moved),
    ("rejected", "rejected", |counters| counters.rejected),
    ("patches", "patches", |counters| counters.patches),
    ("dropped", "dropped", |counters| counters.traversal.dropped),
];

impl PerTick {
    fn add(&mut self, counters: &QueryCounters) {
        for (sum, (_, _, count)) in self.0.iter_mut().zip(COUNTED) {
            *sum += f64::from(count(counters));
        }
    }

    /// Returns the values in the order of the table's columns.
    pub(super) fn values(self) -> [f64; COUNTED.len()] {
        self.0
    }
}

impl Serialize for PerTick {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(COUNTED.iter().zip(self.0).map(|((name, ..), value)| (name, value)))
    }
}

/// Errors of the net force and torque on the probe, at the 99th percentile of the compared poses.
#[derive(Debug, Serialize)]
pub(super) struct Accuracy {
    /// Angle by which the force turns in a tick, °.
    pub(super) turn: f64,
    /// Angle by which the true force turns in a tick, °.
    pub(super) true_turn: f64,
    /// Angle between the force and the true force, °.
    pub(super) direction: f64,
    /// Error of the force's size, as a share of the true force.
    pub(super) size: f64,
    /// Error of the torque, as a share of the true force times the probe's size.
    pub(super) torque: f64,
    /// Direction (°) and size (share) of the difference from the analytic force.
    pub(super) analytic: Option<[f64; 2]>,
}

/// Runs a case. Compares its results with the truth at about `truths` poses. The trace gets these
/// poses and the pose before each of them. `helpers` threads take part in the steps.
pub(super) fn measure(
    case: &Case,
    truths: usize,
    helpers: usize,
    mut trace: Option<&mut Trace>,
) -> anyhow::Result<Row> {
    let plain = settings(case.tolerance);
    let limits: Limits = Settings::default().limits;
    let coupled = Settings {
        coupling: Some(VirtualCoupling::tuned(&limits, TICK, case.tolerance)),
        stiffness: VirtualCoupling::contact_stiffness(&limits, case.tolerance).unwrap_or(plain.stiffness),
        contact_tolerance: case.tolerance,
        ..Settings::default()
    };
    let settings = if case.coupled { coupled } else { plain };
    let mut renderer = Renderer::new(Arc::clone(&case.a), Arc::clone(&case.b), settings)?;
    let _helpers: Vec<HelperThread> =
        (0..helpers).filter_map(|_| HelperThread::start_anyway(renderer.helper(), None, None)).collect();
    let mut truth = Truth::new(case, plain);
    use_large_pages();
    let clock = CpuClock::new();
    let (mut times, mut turns, mut errors) = (Vec::new(), Vec::new(), Errors::default());
    let (mut each, mut late, mut contacts, mut stages) = (PerTick::default(), 0_u32, 0.0, [0.0; 3]);
    let all: usize = case.stretches.iter().map(|stretch| stretch.len() - 1).sum();
    let every = all.checked_div(truths).map_or(usize::MAX, |every| every.max(2));
    for stretch in &case.stretches {
        renderer.clear();
        renderer.allow(WorkLimit::Unlimited);
        let tick = renderer.step(&ProbeState::at(stretch[0]), TICK, &clock);
        let mut last = (tick.times.total as f64 / 1e3, answer(tick));
        if case.coupled {
            renderer.allow(WorkLimit::Units(ALLOWED));
        }
        for (k, pose) in stretch.iter().enumerate().skip(1) {
            let tick = renderer.step(&ProbeState::at(*pose), TICK, &clock);
            let now = (tick.times.total as f64 / 1e3, answer(tick));
            times.push(now.0);
            for (sum, time) in stages.iter_mut().zip([tick.times.query, tick.times.depth, tick.times.force]) {
                *sum += time as f64 / 1e3;
            }
            each.add(&tick.counters.query);
            late += u32::from(tick.is_late());
            contacts += tick.contacts.len() as f64;
            turns.extend(angle(last.1.wrench.force, now.1.wrench.force));
            if !case.coupled && k % every == 0 {
                let (before, expected) = (truth.at(&stretch[k - 1]), truth.at(pose));
                errors.compare(&now.1.wrench, &expected.wrench, case, pose, plain.stiffness);
                errors.true_turns.extend(angle(before.wrench.force, expected.wrench.force));
                if let Some(trace) = trace.as_deref_mut() {
                    trace.row(k - 1, &stretch[k - 1], last.0, [&last.1, &before])?;
                    trace.row(k, pose, now.0, [&now.1, &expected])?;
                }
            }
            last = now;
        }
    }
    let ticks = times.len() as f64;
    each.0.iter_mut().for_each(|sum| *sum /= ticks);
    let at = |values: &mut Vec<f64>, share| {
        values.sort_by(f64::total_cmp);
        quantile_of_sorted(values, share).unwrap_or(0.0)
    };
    let analytic =
        case.analytic.is_some().then(|| [at(&mut errors.known_turns, 0.99), at(&mut errors.known_sizes, 0.99)]);
    Ok(Row {
        name: case.name.to_owned(),
        tolerance: case.tolerance,
        ticks: times.len(),
        contacts: contacts / ticks,
        p50: at(&mut times, 0.5),
        p99: at(&mut times, 0.99),
        p999: at(&mut times, 0.999),
        query: stages[0] / ticks,
        depth: stages[1] / ticks,
        force: stages[2] / ticks,
        late: f64::from(late) / ticks,
        each,
        wrench: Accuracy {
            turn: at(&mut turns, 0.99),
            true_turn: at(&mut errors.true_turns, 0.99),
            direction: at(&mut errors.directions, 0.99),
            size: at(&mut errors.sizes, 0.99),
            torque: at(&mut errors.torques, 0.99),
            analytic,
        },
    })
}

fn answer(tick: &Tick) -> Answer {
    Answer { wrench: tick.commanded, contacts: tick.contacts.len(), separation: deepest(&tick.contacts) }
}

/// Returns the separation of the deepest contact, m; infinite without contacts.
fn deepest(contacts: &[Contact]) -> f64 {
    contacts.iter().map(|contact| contact.separation).fold(f64::INFINITY, f64::min)
}

/// Computes the true wrench: the engine's contact law at single poses, for all contacts. Each depth
/// is proven, and nothing is cached, extrapolated, sampled or dropped.
struct Truth {
    /// The contact query with the corners of patches, and the query without them.
    queries: [ContactQuery; 2],
    sharing: LoadSharing,
    settings: Settings,
}

impl Truth {
    fn new(case: &Case, settings: Settings) -> Self {
        let query = |patch_angle| {
            let proof = Proof::Prove;
            let asked = QuerySettings {
                tolerance: case.tolerance,
                capacity: TRUE_CAPACITY,
                proof,
                patch_angle,
                ..QuerySettings::default()
            };
            ContactQuery::new(Arc::clone(&case.a), Arc::clone(&case.b), asked)
        };
        Self { queries: [query(settings.patch_angle), query(None)], sharing: LoadSharing::new(TRUE_CAPACITY), settings }
    }

    fn at(&mut self, pose: &Pose) -> Answer {
        let [corners, pairs] = &mut self.queries;
        corners.clear();
        pairs.clear();
        // With many contacts, one contact for each pair describes the surface as well as corners
        // do.
        let mut contacts = pairs.contacts(pose);
        if contacts.len() < MANY {
            contacts = corners.contacts(pose);
        }
        let contact_offset = self.settings.contact_offset();
        let tilted: Vec<Tilted> = contacts.iter().map(|contact| Tilted::of(contact, contact_offset)).collect();
        let shares = self.sharing.run(&tilted, None, 0.0);
        let push = |(contact, share): (&Tilted, &f64)| {
            let force = contact.direction * (self.settings.stiffness * share * contact.engagement);
            Wrench::of_force_at(force, contact.place - pose.translation)
        };
        let wrench = tilted.iter().zip(shares).map(push).fold(Wrench::ZERO, |sum, one| sum + one);
        Answer { wrench, contacts: contacts.len(), separation: deepest(contacts) }
    }
}

#[derive(Default)]
struct Errors {
    true_turns: Vec<f64>,
    directions: Vec<f64>,
    sizes: Vec<f64>,
    torques: Vec<f64>,
    known_turns: Vec<f64>,
    known_sizes: Vec<f64>,
}

impl Errors {
    fn compare(&mut self, found: &Wrench, truth: &Wrench, case: &Case, pose: &Pose, stiffness: f64) {
        let size = truth.force.length();
        if size <= 0.0 {
            return;
        }
        self.directions.extend(angle(found.force, truth.force));
        self.sizes.push((found.force.length() - size).abs() / size);
        self.torques.push(found.torque.distance(truth.torque) / (size * case.a.size()));
        match case.analytic {
            Some(Analytic::ToAxis) => {
                let inward = -pose.translation.with_z(0.0);
                self.known_turns.extend(angle(found.force, inward));
                self.known_sizes.push(0.0);
            }
            Some(Analytic::Up(depth)) => {
                let known = stiffness * (case.tolerance + depth);
                self.known_turns.extend(angle(found.force, DVec3::Z));
                self.known_sizes.push((found.force.length() - known).abs() / known);
            }
            None => {}
        }
    }
}

/// Returns the angle in °; `None` if one of the forces is zero.
fn angle(one: DVec3, other: DVec3) -> Option<f64> {
    (one.length() > 0.0 && other.length() > 0.0).then(|| one.angle_between(other).to_degrees())
}
