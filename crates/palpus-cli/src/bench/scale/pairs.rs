//! Pairs of real meshes in contact.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::BodySettings;
use serde::Serialize;

use super::motion::{Motion, stretches};
use super::{Bodies, Effort, Row, timing};
use crate::bench::table::find;
use crate::{bodies, query};
use palpus::algebra::Random;

/// A model of a pair.
pub(in crate::bench) struct Model {
    pub(super) file: &'static str,
    /// Metres per unit of the file.
    scale: f64,
}

/// Two models and their motion.
pub(in crate::bench) struct Pair {
    pub(in crate::bench) name: &'static str,
    pub(super) a: Model,
    pub(super) b: Model,
    motion: Motion,
    /// Contact tolerance, m.
    tolerance: f64,
    /// Amplitude of an orbit, m.
    amplitude: f64,
}

/// Seed of the directions from which bodies meet.
const SEED: u64 = 0x5ca1_e001;

/// Newell's tea set, scaled to the usual size.
const TEA: f64 = 0.08;

/// The pairs have the sizes of hand-held objects. The tolerances are typical choices of a user.
pub(in crate::bench) const PAIRS: [Pair; 6] = [
    // As in the paper, about 1 % of the smaller body.
    Pair {
        name: "spoon-cup",
        a: Model { file: "teaspoon_336.obj", scale: TEA },
        b: Model { file: "teacup_500.obj", scale: TEA },
        motion: Motion::Orbit,
        tolerance: 0.001,
        amplitude: 0.001,
    },
    Pair {
        name: "armadillo-intestine",
        a: Model { file: "armadillo_31240.obj", scale: 0.15 },
        b: Model { file: "intestine_colon_male_24846.obj", scale: 1.0 },
        motion: Motion::Orbit,
        tolerance: 0.002,
        amplitude: 0.002,
    },
    // The nut lies on the upper flank of the thread and turns to and fro by 3 degrees. The 0.06
    // mm of play are on one side.
    Pair {
        name: "nut-bolt",
        a: Model { file: "nut_m16_loose.obj", scale: 1.0 },
        b: Model { file: "bolt_m16_loose.obj", scale: 1.0 },
        motion: Motion::Screw {
            rest: DVec3::new(0.0, 0.0, 0.002_098),
            center: DVec3::ZERO,
            swing: 0.05,
            pitch: 0.002,
            sway: 0.000_03,
            lift: 0.000_005,
        },
        tolerance: 0.000_005,
        amplitude: 0.0,
    },
    // The teeth mesh with 0.18 mm of play. The rotation uses up the play on both sides.
    Pair {
        name: "gears",
        a: Model { file: "gear_medium.obj", scale: 1.0 },
        b: Model { file: "gear_large.obj", scale: 1.0 },
        motion: Motion::Screw {
            rest: DVec3::ZERO,
            center: DVec3::ZERO,
            swing: 0.01,
            pitch: 0.0,
            sway: 0.000_05,
            lift: 0.0,
        },
        tolerance: 0.000_1,
        amplitude: 0.0,
    },
    Pair {
        name: "drill-blade",
        a: Model { file: "ycb_power_drill.obj", scale: 1.0 },
        b: Model { file: "turbine_blade_199k.obj", scale: 0.0005 },
        motion: Motion::Orbit,
        tolerance: 0.000_5,
        amplitude: 0.000_5,
    },
    Pair {
        name: "lucy-embryo",
        a: Model { file: "lucy_100k.obj", scale: 0.0001 },
        b: Model { file: "chick_embryo_ct_iso50.obj.gz", scale: 0.0005 },
        motion: Motion::Orbit,
        tolerance: 0.000_3,
        amplitude: 0.000_5,
    },
];

impl Pair {
    /// Returns both files if they exist.
    pub(in crate::bench) fn files(&self, models: &Path) -> Option<[PathBuf; 2]> {
        Some([find(models, self.a.file)?, find(models, self.b.file)?])
    }
}

/// Files from which another library computes the same poses.
#[derive(Debug, Serialize)]
pub(super) struct Repeat {
    a: PathBuf,
    b: PathBuf,
    scale_a: f64,
    scale_b: f64,
    /// Poses of a in b's frame, m. The first pose of every stretch is not timed.
    poses: PathBuf,
    stretch_starts: Vec<usize>,
    seed: u64,
}

/// Returns the bodies of a pair, and `ticks` of its motion.
pub(in crate::bench) fn posed(
    pair: &Pair,
    files: &[PathBuf; 2],
    ticks: usize,
) -> anyhow::Result<(Bodies, Vec<Vec<Pose>>)> {
    let prepare = |model: &Model, file: &Path| {
        let settings = BodySettings { scale: model.scale, flatness: BodySettings::HAPTIC, ..BodySettings::default() };
        anyhow::Ok(Arc::new(bodies::prepare_file(file, &settings)?.body))
    };
    let bodies = Bodies { a: prepare(&pair.a, &files[0])?, b: prepare(&pair.b, &files[1])? };
    let mut motion = pair.motion;
    if let Motion::Screw { center, .. } = &mut motion {
        // A part turns about its own middle.
        let bounds = bodies.a.mesh().bounds();
        *center = (bounds.min + bounds.max) / 2.0;
    }
    let stretches = stretches(&motion, &bodies.a, &bodies.b, pair.amplitude, ticks, &mut Random::new(SEED));
    Ok((bodies, stretches))
}

/// Prepares, moves and times a pair, and writes its poses to `out`.
pub(super) fn measure(pair: &Pair, files: &[PathBuf; 2], out: &Path, effort: Effort) -> anyhow::Result<Row> {
    let (bodies, stretches) = posed(pair, files, effort.ticks)?;
    let poses = out.join(format!("{}_poses.csv", pair.name));
    let mut file = query::create(&poses)?;
    writeln!(file, "tx,ty,tz,qx,qy,qz,qw")?;
    let mut stretch_starts = Vec::new();
    let mut count = 0;
    for stretch in &stretches {
        stretch_starts.push(count);
        count += stretch.len();
        for pose in stretch {
            let (t, q) = (pose.translation, pose.rotation);
            writeln!(file, "{},{},{},{},{},{},{}", t.x, t.y, t.z, q.x, q.y, q.z, q.w)?;
        }
    }
    file.flush()?;
    let times = timing::time(&bodies, &stretches, pair.tolerance, effort.passes)?;
    let mut row = Row::new(pair.name.to_owned(), &bodies.a, &bodies.b, pair.tolerance, times);
    let [a, b] = files.clone();
    row.repeat = Some(Repeat { a, b, scale_a: pair.a.scale, scale_b: pair.b.scale, poses, stretch_starts, seed: SEED });
    Ok(row)
}
