//! `palpus bench`: the paper's table and figures as measured here, and the time of the engine step against everything that
//! it could depend on.

mod depth;
mod feel;
mod figures;
mod random;
mod scale;
mod step;
mod table;

use std::process::ExitCode;

use palpus_io::RecordRow;

use crate::args::BenchCommand;
pub(crate) use table::find as find_model;

use crate::plots::{BLUE, Figure, GREEN, Panel, Series, VERMILION, bands};

pub(crate) fn bench(command: &BenchCommand) -> anyhow::Result<ExitCode> {
    match command {
        BenchCommand::Figures { out, models } => figures::figures(out, models.as_deref()),
        BenchCommand::Depth { out } => depth::depth(out),
        BenchCommand::Feel { out, scene, method, quick } => {
            feel::feel(&feel::Wanted { out, scene: scene.as_deref(), method: method.as_deref(), quick: *quick })
        }
        BenchCommand::Scale { out, models, ticks, passes, only } => {
            let effort = scale::Effort { ticks: *ticks, passes: *passes };
            scale::scale(out, models.as_deref(), effort, only.as_deref())
        }
        BenchCommand::Step { a, b, poses, out, tolerance } => step::step(a, b, poses, out, *tolerance),
    }
}

/// Points of one curve at the most; a longer run is thinned.
const MOST_POINTS: usize = 4000;

/// What a run felt like: force, torque, contacts, query time.
pub(crate) fn run_figure(name: &str, rows: &[RecordRow]) -> Figure {
    let stride = rows.len().div_ceil(MOST_POINTS);
    let curve = |value: &dyn Fn(&RecordRow) -> f64| -> Vec<(f64, f64)> {
        rows.iter().step_by(stride).map(|row| (seconds(row), value(row))).collect()
    };
    let force = |axis: usize| curve(&|row| row.wrench.force[axis]);
    let torque = |axis: usize| curve(&|row| row.wrench.torque[axis] * 1e3);
    let axes = |points: [Vec<(f64, f64)>; 3]| {
        points
            .into_iter()
            .zip([("x", VERMILION), ("y", GREEN), ("z", BLUE)])
            .map(|(points, (label, color))| Series { label, color, points })
            .collect()
    };
    let one = |label, color, points| vec![Series { label, color, points }];
    let panel = |title, unit, series| Panel { title, unit, series, thick_in_bands: false };
    Figure {
        title: format!("{name}: what the hand felt (shaded: penetrating)"),
        x_label: "time (s)",
        bands: bands(rows.iter().map(|row| (seconds(row), row.separation < 0.0))),
        log_x: false,
        panels: vec![
            panel("force", "N", axes([force(0), force(1), force(2)])),
            panel("torque", "mN·m", axes([torque(0), torque(1), torque(2)])),
            panel("contacts", "number", one("contacts", BLUE, curve(&|row| f64::from(row.contacts)))),
            panel("contact query (the slowest 1 % cut off)", "µs", one("query", BLUE, cut(curve(&query_us)))),
        ],
    }
}

fn query_us(row: &RecordRow) -> f64 {
    row.query_us + row.depth_us.unwrap_or(0.0)
}

/// The curve without what sticks out of it: the operating system's pauses would flatten all the rest.
fn cut(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let mut values: Vec<f64> = points.iter().map(|point| point.1).collect();
    values.sort_by(f64::total_cmp);
    if let Some(&ceiling) = values.get(values.len() * 99 / 100) {
        points.iter_mut().for_each(|point| point.1 = point.1.min(ceiling));
    }
    points
}

fn seconds(row: &RecordRow) -> f64 {
    row.time_ns as f64 * 1e-9
}
