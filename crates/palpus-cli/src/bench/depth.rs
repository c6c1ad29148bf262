//! `palpus bench depth`: the plots of docs/penetration-depth.md and docs/global-depth.md.
//!
//! 1. *What a tilting box feels*: a box tilts on a table through flat contact. The plot shows the
//!    exact witness point and the centre of the contact patch.
//! 2. *Depths of whole bodies* ([`bracket`]).

mod bracket;

use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::anyhow;
use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Body, BodySettings};
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::force::{TiltShares, Tilted};
use palpus::render::Settings;
use palpus_scenes::shape;

use crate::plots::{BLUE, Figure, Panel, Series, VERMILION, write_svg};
use crate::{files, output};

pub(super) fn depth(out: &Path) -> anyhow::Result<ExitCode> {
    files::make_folder(out)?;
    tilting(&out.join("depth_witness.svg"))?;
    bracket::write(out)?;
    let names = "depth_witness.svg, depth_path.svg and depth_budget.svg";
    output::line(format!("written to {}: {names}", out.display()));
    Ok(ExitCode::SUCCESS)
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

/// Returns the point where the load acts: the mean of the contact points, weighted by tilt share
/// and engagement; `None` without contacts.
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
    let figure = Figure::new(
        "A box tilts through flat contact on a table: the contact point",
        "tilt (degrees)",
        vec![Panel::lines(
            "contact point along the box",
            "mm",
            vec![Series::new("exact", VERMILION, exact), Series::new("middle of the patch", BLUE, patches)],
        )],
    );
    write_svg(&figure, path)
}
