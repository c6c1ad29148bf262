//! Measures the cost of a step as a function of the number of triangles at equal contacts, and of
//! the number of contacts at equal triangles.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use palpus::algebra::Pose;
use palpus::body::BodySettings;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus_scenes::shape;

use super::motion::{Orbit, PERIOD, STRETCH, nearest_query};
use super::timing::{self, Times};
use super::{Bodies, Effort, Row};
use crate::bodies;
use crate::plots::{BLUE, Figure, GREEN, Panel, Series, VERMILION, write_svg};
use palpus::algebra::Random;

/// Seed of the directions from which the ball comes.
const SEED: u64 = 0x5ca1_e002;
/// Numbers of triangles: the smallest number is usual for a hand-made part, the largest number for
/// a CT scan.
const TRIANGLES: [usize; 6] = [1_000, 3_000, 10_000, 30_000, 100_000, 906_000];
/// Mean number of contacts at each size.
const CONTACTS: f64 = 4.0;
/// Number of triangles in the sweep over contacts.
const SIZE: usize = 100_000;
/// Tolerances of the sweep over contacts, m.
const TOLERANCES: [f64; 7] = [0.000_01, 0.000_02, 0.000_04, 0.000_08, 0.000_16, 0.000_32, 0.000_64];

/// Measures step times for a growing number of triangles.
pub(super) fn against_triangles(out: &Path, effort: Effort) -> anyhow::Result<Vec<Row>> {
    let mut rows = Vec::new();
    for triangles in TRIANGLES {
        let bodies = ball_on_scan(triangles)?;
        let touches = Touches::new(&bodies, effort.ticks);
        let tolerance = tolerance_for(&bodies, &touches);
        let times = timing::time(&bodies, &touches.poses(tolerance), tolerance, effort.passes)?;
        rows.push(Row::new(format!("ball on {triangles}"), &bodies.a, &bodies.b, tolerance, times));
    }
    let figure = figure(
        format!("A ball on a scanned torus: the step against the torus's triangles, at {CONTACTS} contacts"),
        "triangles",
        &rows,
        &|row| row.triangles_b as f64,
    );
    write_svg(&figure, &out.join("triangles.svg"))?;
    Ok(rows)
}

/// Measures step times for a growing number of contacts.
pub(super) fn against_contacts(out: &Path, effort: Effort) -> anyhow::Result<Vec<Row>> {
    let bodies = ball_on_scan(SIZE)?;
    let touches = Touches::new(&bodies, effort.ticks);
    let mut rows = Vec::new();
    for tolerance in TOLERANCES {
        let times = timing::time(&bodies, &touches.poses(tolerance), tolerance, effort.passes)?;
        rows.push(Row::new(format!("ball, {:.0} µm", tolerance * 1e6), &bodies.a, &bodies.b, tolerance, times));
    }
    let figure = figure(
        format!("A ball on a scanned torus of {SIZE} triangles: the step against contacts"),
        "contacts",
        &rows,
        &|row| row.times.contacts,
    );
    write_svg(&figure, &out.join("contacts.svg"))?;
    Ok(rows)
}

/// Prepares a ball of 4 cm and the scanned torus.
fn ball_on_scan(triangles: usize) -> anyhow::Result<Bodies> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    let body = |name: &str, soup| anyhow::Ok(Arc::new(bodies::prepare_soup(name, &soup, &settings)?.body));
    Ok(Bodies {
        a: body("the ball", shape::sphere(BALL_RADIUS, BALL_SUBDIVISIONS))?,
        b: body("the scanned torus", shape::scanned_torus(triangles))?,
    })
}

/// Radius of the ball, m.
const BALL_RADIUS: f64 = 0.02;
/// Number of subdivisions; the ball then has 5120 triangles.
const BALL_SUBDIVISIONS: u32 = 4;

/// Places at which the ball touches the torus, and the number of ticks.
struct Touches {
    orbits: Vec<Orbit>,
    ticks: usize,
}

impl Touches {
    fn new(bodies: &Bodies, ticks: usize) -> Self {
        let mut random = Random::new(SEED);
        let mut query = nearest_query(&bodies.a, &bodies.b);
        let orbits = (0..ticks.div_ceil(STRETCH)).map(|_| Orbit::touching(&mut query, GAP, &mut random)).collect();
        Self { orbits, ticks }
    }

    /// Returns the stretches of the motion for a tolerance. The ball sinks in by a share of the
    /// tolerance.
    fn poses(&self, tolerance: f64) -> Vec<Vec<Pose>> {
        let slide = |orbit: &Orbit, count: usize| {
            let pose = |k: usize| orbit.slide(TAU * k as f64 / PERIOD, SIDEWAYS, SINKS * tolerance);
            (0..=count).map(pose).collect()
        };
        let count = |k: usize| (self.ticks - k * STRETCH).min(STRETCH);
        self.orbits.iter().enumerate().map(|(k, orbit)| slide(orbit, count(k))).collect()
    }
}

/// Returns the tolerance at which a tick has [`CONTACTS`] contacts on average.
fn tolerance_for(bodies: &Bodies, touches: &Touches) -> f64 {
    let settings = QuerySettings { capacity: 1 << 14, ..QuerySettings::default() };
    let mut query = ContactQuery::new(bodies.a.clone(), bodies.b.clone(), settings);
    let mut contacts = |tolerance: f64| {
        let (mut sum, mut count) = (0, 0);
        query.set_tolerance(tolerance);
        for pose in touches.poses(tolerance).iter().flat_map(|stretch| stretch.iter().step_by(SAMPLE)) {
            sum += query.contacts(pose).len();
            count += 1;
        }
        f64::from(sum as u32) / f64::from(count)
    };
    let (mut low, mut high) = (LEAST_TOLERANCE, LARGEST_TOLERANCE);
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        if contacts(middle) > CONTACTS { high = middle } else { low = middle }
    }
    (low * high).sqrt()
}

/// Sliding distance of the ball to each side, m; at most 6 mm/s.
const SIDEWAYS: f64 = 0.000_5;
/// Depth of the ball, as a share of the tolerance.
const SINKS: f64 = 0.2;
/// Amplitude for [`Orbit::touching`], m: a gap of a hundredth of this counts as touching.
const GAP: f64 = 0.000_01;
/// Contacts are counted at one tick out of this number of ticks.
const SAMPLE: usize = 50;
/// Range of the search for the tolerance, m.
const LEAST_TOLERANCE: f64 = 1e-6;
const LARGEST_TOLERANCE: f64 = 1e-2;
/// With this many steps, the search ends within a hundredth of the tolerance.
const BISECTIONS: usize = 12;

fn figure(title: String, x_label: &'static str, rows: &[Row], x: &dyn Fn(&Row) -> f64) -> Figure {
    let curve = |label, color, y: fn(&Times) -> f64| {
        Series::new(label, color, rows.iter().map(|row| (x(row), y(&row.times))).collect())
    };
    let panel = |title, unit, series| Panel::lines(title, unit, series);
    Figure {
        log_x: true,
        ..Figure::new(
            title,
            x_label,
            vec![
                panel(
                    "engine step",
                    "µs",
                    vec![
                        curve("median", BLUE, |times| times.micros.p50),
                        curve("p99", GREEN, |times| times.micros.p99),
                        curve("p99.9", VERMILION, |times| times.micros.p999),
                    ],
                ),
                panel("contacts a tick", "number", vec![curve("contacts", BLUE, |times| times.contacts)]),
            ],
        )
    }
}
