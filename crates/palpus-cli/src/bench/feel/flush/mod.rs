//! Flush faces, play and machine parts: measures the hum and the energy that a simulated hand
//! feels, and the true overlap of the parts.
//!
//! 1. The closed loop follows the scene's path. The hand adds no press of its own.
//! 2. *Hum* is the root mean square of force and torque above 10 Hz, in the last second at rest and
//!    in the half second in which it is largest.
//! 3. *Energy generated* is the largest net work that the applied wrench has done on the hand at
//!    any time.
//! 4. *True overlap* is the largest overlap of the meshes at the pose where the method shows the
//!    probe. The overlap is measured with samples of both surfaces (`palpus_scenes::overlap`),
//!    without the engine's contacts.

pub(super) mod sweep;

use std::ops::Range;

use anyhow::{Context, anyhow};
use glam::DVec3;
use palpus::algebra::{Pose, Wrench};
use palpus_device::HandImpedance;
use palpus_scenes::flush::REST_END;
use palpus_scenes::overlap::{SampledSolid, overlap};

use super::closed::{Drive, HANDS, LoopTick, run};
use super::ground::Ground;
use super::held::cycle;
use super::method::{Entry, Tuning};
use super::row::{Row, Rows, largest};
use super::{Effort, shared_out};

/// Scenes of this part, and the time at which the hand's last second at rest ends (s).
pub(super) const SCENES: [(&str, f64); 9] = [
    ("slot", REST_END),
    ("drawer", REST_END),
    ("key", REST_END),
    ("square-peg", REST_END),
    ("box-slide", 4.4),
    ("screwdriver", 5.4),
    ("ball-joint", 2.6),
    ("gears", 3.4),
    ("rollers", 3.4),
];

/// A scene that is measured only if it is named, because preparing it takes long.
pub(super) const LARGE: (&str, f64) = ("rollers-200k", 3.4);

/// The measured methods, all behind the coupling. With direct rendering, the probe sinks in as deep
/// as the hand presses, and fine meshes then have thousands of contacts.
const METHODS: [&str; 2] = ["coupled", "coupled-smooth"];

/// Length of the interval for the hum at rest, s.
const AT_REST: f64 = 1.0;
/// Length of the interval for the worst hum, s.
const ANYWHERE: f64 = 0.5;
/// Time after which the effects of the start are over, s.
const BEGUN: f64 = 0.8;
/// Time between two measurements of the overlap, s.
const JUDGED: f64 = 0.02;
/// The same time for bodies of more than [`MANY_TRIANGLES`] triangles, s.
const JUDGED_LARGE: f64 = 0.1;
/// Number of triangles above which a body counts as large.
const MANY_TRIANGLES: usize = 10_000;

/// Measures of one closed loop.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Felt {
    /// Hum at rest: N and N·m.
    rest: [f64; 2],
    /// Hum in the half second in which it is largest: N and N·m.
    worst: [f64; 2],
    /// Generated energy, J.
    energy: f64,
    /// True overlap, m.
    overlap: f64,
    /// Mean force at rest, N.
    mean_force: f64,
}

/// A scene with its samples for the true overlap.
struct Judged {
    ground: Ground,
    rest_end: f64,
    probe: SampledSolid,
    environment: SampledSolid,
    period: f64,
}

impl Judged {
    fn new(scene: &palpus_scenes::Scene, rest_end: f64) -> anyhow::Result<Self> {
        let (probe, environment) = (SampledSolid::new(&scene.probe)?, SampledSolid::new(&scene.environment)?);
        let triangles = scene.probe.face_count() + scene.environment.face_count();
        let period = if triangles > MANY_TRIANGLES { JUDGED_LARGE } else { JUDGED };
        Ok(Self { ground: Ground::unscripted(scene)?, rest_end, probe, environment, period })
    }

    /// Runs the method in the closed loop and measures it.
    fn felt(&self, entry: &Entry, tuning: &Tuning, drive: &Drive<'_>) -> anyhow::Result<Felt> {
        let seconds = self.ground.path.duration();
        let ticks = run(&self.ground, entry, tuning, drive, seconds)?;
        let rest = self.hum(&ticks, self.rest_end - AT_REST..self.rest_end);
        let starts = (BEGUN / ANYWHERE) as usize..(seconds / ANYWHERE) as usize * 2;
        let worst = starts.map(|k| k as f64 * ANYWHERE / 2.0).fold([0.0f64; 2], |worst, start| {
            let [force, torque] = self.hum(&ticks, start..start + ANYWHERE).unwrap_or_default();
            [worst[0].max(force), worst[1].max(torque)]
        });
        let energy = largest(&ticks.iter().map(|tick| tick.work[0] + tick.work[1]).collect::<Vec<_>>());
        let at_rest: Vec<DVec3> = ticks
            .iter()
            .filter(|tick| (self.rest_end - AT_REST..self.rest_end).contains(&tick.time))
            .map(|tick| tick.felt.force)
            .collect();
        let mean_force = at_rest.iter().sum::<DVec3>().length() / at_rest.len().max(1) as f64;
        // The loop ends early if a value is not finite.
        let rest = rest.unwrap_or([f64::INFINITY; 2]);
        let overlap = self.overlap(&ticks);
        Ok(Felt { rest, worst, energy, overlap, mean_force })
    }

    /// Returns the hum within `span` (s); `None` if the loop ended before it.
    fn hum(&self, ticks: &[LoopTick], span: Range<f64>) -> Option<[f64; 2]> {
        let within: Vec<Wrench> = ticks.iter().filter(|tick| span.contains(&tick.time)).map(|tick| tick.felt).collect();
        let whole = ticks.last().is_some_and(|tick| tick.time >= span.end - 0.01);
        whole.then(|| [cycle(&within, |felt| felt.force), cycle(&within, |felt| felt.torque)])
    }

    /// Returns the largest true overlap, m.
    fn overlap(&self, ticks: &[LoopTick]) -> f64 {
        let step = (self.period / crate::bench::TICK) as usize;
        let judged = ticks.iter().step_by(step);
        judged.map(|tick| overlap(&self.probe, &self.environment, &tick.shown)).fold(0.0, f64::max)
    }
}

/// Returns the drive of a hand that follows the scene's path.
fn follow<'a>(hand: HandImpedance, intent: &'a dyn Fn(f64) -> Pose) -> Drive<'a> {
    Drive { hand, intent, load: Wrench::ZERO }
}

/// Measures every method on the scenes `names`, with every hand of `effort`.
pub(super) fn measure_all(names: &[&'static str], entries: &[Entry], effort: &Effort) -> anyhow::Result<Vec<Row>> {
    let scenes = names.iter().map(|name| judged(name)).collect::<anyhow::Result<Vec<_>>>()?;
    let entries: Vec<&Entry> = entries.iter().filter(|entry| METHODS.contains(&entry.name)).collect();
    let rows = shared_out(scenes.len() * entries.len(), |k| {
        let (scene, entry) = (&scenes[k / entries.len()], entries[k % entries.len()]);
        measure(scene, entry, effort)
            .with_context(|| format!("{} on {} could not be measured", entry.name, scene.ground.name))
    })?;
    Ok(rows.into_iter().flatten().collect())
}

fn judged(name: &str) -> anyhow::Result<Judged> {
    let scene = palpus_scenes::scene(name).ok_or_else(|| anyhow!("there is no scene called {name}"))?;
    let known = SCENES.iter().chain([&LARGE]).find(|(known, _)| *known == name);
    let (_, rest_end) = known.ok_or_else(|| anyhow!("{name} has no time at rest"))?;
    Judged::new(&scene, *rest_end)
}

fn measure(scene: &Judged, entry: &Entry, effort: &Effort) -> anyhow::Result<Vec<Row>> {
    let mut rows = Rows::new(scene.ground.name, entry.name);
    // Without a hand there is no path to follow.
    for &(name, hand) in HANDS.iter().filter(|(name, _)| effort.hands.contains(name) && *name != "none") {
        let intent = |time: f64| scene.ground.path.pose(time);
        let felt = scene.felt(entry, &Tuning::of(&scene.ground), &follow(hand, &intent))?;
        rows.add(name, "hum at rest", "N", felt.rest[0]);
        rows.add(name, "hum at rest torque", "N·m", felt.rest[1]);
        rows.add(name, "worst hum", "N", felt.worst[0]);
        rows.add(name, "worst hum torque", "N·m", felt.worst[1]);
        rows.add(name, "energy generated", "J", felt.energy);
        rows.add(name, "true overlap", "m", felt.overlap);
        rows.add(name, "mean force at rest", "N", felt.mean_force);
    }
    Ok(rows.rows)
}
