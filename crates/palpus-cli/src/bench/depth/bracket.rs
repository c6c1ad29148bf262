//! The plots of docs/global-depth.md: a ring moves through another ring.
//!
//! 1. *Along a path*: both bounds of the depth, and the evaluations for each pose, with a warm
//!    start from the previous pose and with a cold start.
//! 2. *Over the budget*: how the bounds at one pose converge.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Body, BodySettings};
use palpus::depth::{GlobalDepth, GlobalMemory, GlobalSettings, Interior};
use palpus_io::Threads;
use palpus_scenes::shape;

use crate::plots::{BLUE, Figure, Panel, Series, VERMILION, write_svg};

/// Number of poses along the path.
const POSES: i32 = 240;
/// Half the length of the path, as a share of the ring's size.
const HALF_WAY: f64 = 0.75;
/// The position on the path at which the second plot is made, as a share of the ring's size.
const PLACE: f64 = 0.02;
/// The smallest budget.
const BUDGET: f64 = 10.0;
/// Factor between two successive budgets.
const FACTOR: f64 = 1.3;
/// Number of budgets.
const BUDGETS: i32 = 30;

/// Writes `depth_path.svg` and `depth_budget.svg` into `out`.
pub(super) fn write(out: &Path) -> anyhow::Result<()> {
    let ring = Body::from_soup(&shape::torus(), &BodySettings::default(), &mut |_| ())?;
    let interior = Interior::new(&ring, &Threads::all(), &mut |_| ());
    let query = GlobalDepth::new(&ring, &interior, &ring, &interior);
    let settings = GlobalSettings::new(&ring, &ring);
    path(&query, &settings, ring.size(), &out.join("depth_path.svg"))?;
    // With so small a gap, the bounds do not reach the gap with any budget of this plot.
    let settings = GlobalSettings { gap: 1e-3 * settings.gap, ..settings };
    budget(&query, &settings, ring.size(), &out.join("depth_budget.svg"))
}

/// Returns the pose of a ring that is perpendicular to the other ring, `aside` (m) from that ring's
/// centre.
fn pose(aside: f64) -> Pose {
    Pose::new(DQuat::from_rotation_x(FRAC_PI_2), DVec3::X * aside)
}

fn path(query: &GlobalDepth<'_>, settings: &GlobalSettings, size: f64, file: &Path) -> anyhow::Result<()> {
    let mut memory = GlobalMemory::default();
    let (mut lower, mut upper, mut after, mut cold) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for k in 0..=POSES {
        let aside = HALF_WAY * size * (2.0 * f64::from(k) / f64::from(POSES) - 1.0);
        let coherent = query.run(&pose(aside), settings, &mut memory);
        let alone = query.run(&pose(aside), settings, &mut GlobalMemory::default());
        let x = aside * 1e3;
        lower.push((x, coherent.lower * 1e3));
        upper.push((x, coherent.upper * 1e3));
        after.push((x, coherent.evaluations as f64));
        cold.push((x, alone.evaluations as f64));
    }
    let line = |label, color, points| Series::new(label, color, points);
    let bounds = vec![line("upper", VERMILION, upper), line("lower", BLUE, lower)];
    let work = vec![line("cold start", VERMILION, cold), line("warm start", BLUE, after)];
    let figure = Figure::new(
        "A ring moves through another one: the proven bounds of the depth",
        "distance of the centres (mm)",
        vec![Panel::lines("depth", "mm", bounds), Panel::lines("evaluations of a pose", "", work)],
    );
    write_svg(&figure, file)
}

fn budget(query: &GlobalDepth<'_>, settings: &GlobalSettings, size: f64, file: &Path) -> anyhow::Result<()> {
    let (mut lower, mut upper) = (Vec::new(), Vec::new());
    for k in 0..BUDGETS {
        let budget = (BUDGET * FACTOR.powi(k)) as u64;
        let settings = GlobalSettings { budget, ..*settings };
        let answer = query.run(&pose(PLACE * size), &settings, &mut GlobalMemory::default());
        lower.push((budget as f64, answer.lower * 1e3));
        upper.push((budget as f64, answer.upper * 1e3));
    }
    let figure = Figure {
        log_x: true,
        ..Figure::new(
            "One pose: the bounds over the budget",
            "budget (evaluations)",
            vec![Panel::lines(
                "depth",
                "mm",
                vec![Series::new("upper", VERMILION, upper), Series::new("lower", BLUE, lower)],
            )],
        )
    };
    write_svg(&figure, file)
}
