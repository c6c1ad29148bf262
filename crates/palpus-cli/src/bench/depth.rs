//! `palpus bench depth`: the plots of docs/penetration-depth.md and docs/global-depth.md.
//!
//! 1. *How often the walk is only local*: random overlapping poses of two rounded hulls, the depth
//!    of the walk from a cold start over the proven one.
//! 2. *What a tilting box feels*: the contact point of a box that tilts on a table, passing through
//!    flat contact: the exact witness point, and the centre of the contact patch.
//! 3. *Depths of whole bodies* ([`bracket`]).

mod bracket;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::anyhow;
use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Body, BodySettings};
use palpus::detect::{Contact, ContactQuery, Proof, QuerySettings};
use palpus::force::{TiltShares, Tilted};
use palpus::render::Settings;
use palpus_scenes::shape;

use crate::plots::{BLUE, Drawn, Figure, Panel, Series, VERMILION, write_svg};
use crate::{files, output};
use palpus::algebra::Random;

/// Seed of the shapes and poses of the first plot.
const SEED: u64 = 0xdeb7_0001;
const VERTICES: usize = 100;
const POSES: usize = 3000;

pub(super) fn depth(out: &Path) -> anyhow::Result<ExitCode> {
    files::make_folder(out)?;
    local(&out.join("depth_local.svg"))?;
    tilting(&out.join("depth_witness.svg"))?;
    bracket::write(out)?;
    let names = "depth_local.svg, depth_witness.svg, depth_path.svg and depth_budget.svg";
    output::line(format!("written to {}: {names}", out.display()));
    Ok(ExitCode::SUCCESS)
}

fn local(path: &Path) -> anyhow::Result<()> {
    let mut random = Random::new(SEED);
    let mut hull = |axes: DVec3| {
        let points: Vec<DVec3> = (0..VERTICES).map(|_| random.vector().normalize_or(DVec3::X) * axes).collect();
        Body::from_convex(&points)
    };
    let (a, b) = (hull(DVec3::new(1.0, 0.7, 0.5))?, hull(DVec3::new(0.6, 1.0, 0.8))?);
    let (a, b) = (Arc::new(a), Arc::new(b));
    let settings = QuerySettings { tolerance: 0.0, capacity: 1, ..QuerySettings::default() };
    let mut walk = ContactQuery::new(a.clone(), b.clone(), settings);
    let mut proof = ContactQuery::new(a, b, QuerySettings { proof: Proof::Prove, ..settings });
    let mut excess = Vec::with_capacity(POSES);
    while excess.len() < POSES {
        let pose = Pose::new(DQuat::from_scaled_axis(random.vector() * 3.0), random.vector());
        walk.clear();
        if let ([walked], [proven]) = (walk.contacts(&pose), proof.contacts(&pose))
            && proven.separation < 0.0
        {
            excess.push((walked.separation / proven.separation - 1.0).max(0.0) * 100.0);
        }
    }
    excess.sort_by(f64::total_cmp);
    // Differences below a millionth of the depth count as the same minimum.
    let beaten = excess.iter().filter(|percent| **percent > 1e-4).count();
    let share = 100.0 * beaten as f64 / POSES as f64;
    output::line(format!("{beaten} of {POSES} cold walks are only local ({share:.2} %), seed {SEED:#x}"));
    let rank = |k: usize| 100.0 * (k as f64 + 0.5) / POSES as f64;
    let tail = POSES - POSES / 20;
    let points = (tail..POSES).map(|k| (rank(k), excess[k])).collect();
    let figure = Figure {
        title: format!("The walk from a cold start against the proof: {beaten} of {POSES} poses are only local"),
        x_label: "poses, by how much the walk misses (%, the last twentieth)",
        bands: Vec::new(),
        log_x: false,
        marks: Vec::new(),
        panels: vec![Panel {
            title: "depth of the walk over the least depth",
            unit: "% too deep",
            series: vec![Series { label: "excess", color: BLUE, points }],
            drawn: Drawn::Lines,
        }],
    };
    write_svg(&figure, path)
}

/// Sides of the box, m.
const BOX: DVec3 = DVec3::new(0.06, 0.04, 0.02);
/// Half the range of tilts and the step between them, degrees.
const TILT: f64 = 2.0;
const TILT_STEP: f64 = 0.002;
/// Depth of the middle of the box's bottom below the table's top, m.
const PRESSED: f64 = 0.0005;
/// Contact tolerance, m.
const TOLERANCE: f64 = 0.002;

/// Returns the point where the load acts: the mean of the contacts, by tilt share and engagement;
/// `None` without contacts.
fn middle(contacts: &[Contact]) -> Option<DVec3> {
    let corners: Vec<Tilted> = contacts.iter().map(|contact| Tilted::of(contact, TOLERANCE)).collect();
    let mut shares = TiltShares::new(corners.len());
    shares.run(&corners);
    let load = |i: usize| shares.shares()[i] * corners[i].engagement;
    let whole: f64 = (0..corners.len()).map(load).sum();
    (whole > 0.0).then(|| (0..corners.len()).map(|i| corners[i].place * load(i)).sum::<DVec3>() / whole)
}

fn tilting(path: &Path) -> anyhow::Result<()> {
    let body = |soup| Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).map(Arc::new);
    let (a, b) = (body(shape::cuboid(BOX))?, body(shape::table())?);
    let curve = |patches: Option<f64>| -> anyhow::Result<Vec<(f64, f64)>> {
        let settings =
            QuerySettings { tolerance: TOLERANCE, capacity: 16, patch_angle: patches, ..QuerySettings::default() };
        let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
        let steps = (2.0 * TILT / TILT_STEP).round() as usize;
        (0..=steps)
            .map(|k| {
                let degrees = k as f64 * TILT_STEP - TILT;
                let turn = DQuat::from_rotation_y(degrees.to_radians());
                let pose = Pose::new(turn, DVec3::Z * -PRESSED - turn * (DVec3::Z * (-0.5 * BOX.z)));
                let middle = middle(query.contacts(&pose))
                    .ok_or_else(|| anyhow!("the box lost contact with the table at {degrees}°"))?;
                Ok((degrees, middle.x * 1e3))
            })
            .collect()
    };
    let patches = curve(Settings::default().patch_angle)?;
    let exact = curve(None)?;
    let figure = Figure {
        title: "A box tilts through flat contact on a table: the contact point".to_owned(),
        x_label: "tilt (degrees)",
        bands: Vec::new(),
        log_x: false,
        marks: Vec::new(),
        panels: vec![Panel {
            title: "contact point along the box",
            unit: "mm",
            series: vec![
                Series { label: "exact", color: VERMILION, points: exact },
                Series { label: "middle of the patch", color: BLUE, points: patches },
            ],
            drawn: Drawn::Lines,
        }],
    };
    write_svg(&figure, path)
}
