//! The cost of a step against triangles at equal contacts, and against contacts at equal triangles.

use std::path::Path;
use std::sync::Arc;

use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, BodySettings};
use palpus::force::PairQuery;
use palpus_scenes::shape;

use super::motion::{Motion, stretches};
use super::timing::{self, Times};
use super::{Bodies, Row};
use crate::bench::random::Random;
use crate::bodies;
use crate::plots::{BLUE, Figure, GREEN, Panel, Series, VERMILION, write_svg};

/// Of the sides from which the pen comes.
const SEED: u64 = 0x5ca1_e002;
/// From a part drawn by hand to a CT scan.
const TRIANGLES: [usize; 6] = [1_000, 3_000, 10_000, 30_000, 100_000, 906_000];
/// The contacts that each size is brought to.
const CONTACTS: f64 = 8.0;
/// The sweep over contacts is made at this size.
const SIZE: usize = 100_000;
/// Tolerances of that sweep, m.
const TOLERANCES: [f64; 7] = [0.000_1, 0.000_2, 0.000_4, 0.000_8, 0.001_6, 0.003_2, 0.006_4];
/// How far the pen goes in and out, m: within the bark of every size.
const AMPLITUDE: f64 = 0.000_1;

/// Step times for a growing number of triangles.
pub(super) fn against_triangles(out: &Path, ticks: usize) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for triangles in TRIANGLES {
        let (bodies, poses) = pen_on_scan(triangles, ticks)?;
        let tolerance = tolerance_for(&bodies, &poses);
        let times = timing::time(&bodies, &poses, tolerance)?;
        rows.push(Row::new(format!("pen on {triangles}"), &bodies.a, &bodies.b, tolerance, times));
    }
    let figure = figure(
        format!("A pen on a scanned torus: the step against the torus's triangles, at {CONTACTS} contacts"),
        "triangles",
        &rows,
        &|row| row.triangles_b as f64,
    );
    write_svg(&figure, &out.join("triangles.svg"))?;
    Ok(rows)
}

/// Step times for a growing number of contacts.
pub(super) fn against_contacts(out: &Path, ticks: usize) -> anyhow::Result<Vec<Row>> {
    let (bodies, poses) = pen_on_scan(SIZE, ticks)?;
    let mut rows = Vec::new();
    for tolerance in TOLERANCES {
        let times = timing::time(&bodies, &poses, tolerance)?;
        rows.push(Row::new(format!("pen, {:.1} mm", tolerance * 1e3), &bodies.a, &bodies.b, tolerance, times));
    }
    let figure = figure(
        format!("A pen on a scanned torus of {SIZE} triangles: the step against contacts"),
        "contacts",
        &rows,
        &|row| row.times.contacts,
    );
    write_svg(&figure, &out.join("contacts.svg"))?;
    Ok(rows)
}

fn pen_on_scan(triangles: usize, ticks: usize) -> anyhow::Result<(Bodies, Vec<Vec<Pose>>)> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    let body = |name: &str, soup| anyhow::Ok(Arc::new(bodies::prepare_soup(name, &soup, &settings)?.body));
    let bodies =
        Bodies { a: body("the pen", shape::pen())?, b: body("the scanned torus", shape::scanned_torus(triangles))? };
    let poses = stretches(&Motion::Orbit, &bodies.a, &bodies.b, AMPLITUDE, ticks, &mut Random(SEED));
    Ok((bodies, poses))
}

/// The tolerance at which a tick has [`CONTACTS`] contacts on the average.
fn tolerance_for(bodies: &Bodies, poses: &[Vec<Pose>]) -> f64 {
    let Bodies { a, b } = bodies;
    let mut pair = PairQuery::new(a, b, 1 << 14);
    let mut contacts = |tolerance: f64| {
        let (mut sum, mut count) = (0, 0);
        for pose in poses.iter().flat_map(|stretch| stretch.iter().step_by(SAMPLE)) {
            pair.run(a, b, pose, tolerance, &NoClock);
            sum += pair.contacts().len();
            count += 1;
        }
        f64::from(sum as u32) / f64::from(count)
    };
    let (mut low, mut high) = (AMPLITUDE, largest_tolerance(b));
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        if contacts(middle) > CONTACTS { high = middle } else { low = middle }
    }
    (low * high).sqrt()
}

/// Every so many ticks are asked when contacts are counted.
const SAMPLE: usize = 50;
/// To a thousandth of the tolerance.
const BISECTIONS: usize = 12;

fn largest_tolerance(b: &Body) -> f64 {
    0.2 * b.size()
}

fn figure(title: String, x_label: &'static str, rows: &[Row], x: &dyn Fn(&Row) -> f64) -> Figure {
    let curve = |label, color, y: fn(&Times) -> f64| Series {
        label,
        color,
        points: rows.iter().map(|row| (x(row), y(&row.times))).collect(),
    };
    let panel = |title, unit, series| Panel { title, unit, series, thick_in_bands: false };
    Figure {
        title,
        x_label,
        log_x: true,
        bands: Vec::new(),
        panels: vec![
            panel(
                "engine step",
                "µs",
                vec![
                    curve("median", BLUE, |times| times.p50),
                    curve("99 %", GREEN, |times| times.p99),
                    curve("99.9 %", VERMILION, |times| times.p999),
                ],
            ),
            panel("contacts a tick", "number", vec![curve("contacts", BLUE, |times| times.contacts)]),
        ],
    }
}
