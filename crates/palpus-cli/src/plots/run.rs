//! The plots of a recorded run.

use glam::DVec3;
use palpus::algebra::quantile;
use palpus_io::RecordRow;

use super::{BLUE, Drawn, Figure, GREEN, Panel, Series, VERMILION, bands, histogram};

/// Makes the plots of a run: force, torque, contacts, separation, times.
pub(crate) fn run_figure(name: &str, rows: &[RecordRow]) -> Figure {
    let curve = |value: &dyn Fn(&RecordRow) -> f64| -> Vec<(f64, f64)> {
        rows.iter().map(|row| (seconds(row), value(row))).collect()
    };
    let axes = |value: &dyn Fn(&RecordRow) -> DVec3| {
        [("x", VERMILION), ("y", GREEN), ("z", BLUE)]
            .into_iter()
            .enumerate()
            .map(|(axis, (label, color))| Series::new(label, color, curve(&|row| value(row)[axis])))
            .collect()
    };
    let title =
        if name.is_empty() { String::new() } else { format!("{name}: what the hand felt (shaded: penetrating)") };
    Figure {
        bands: bands(rows.iter().map(|row| (seconds(row), row.separation < 0.0))),
        ..Figure::new(
            title,
            "time (s)",
            vec![
                Panel::lines("force", "N", axes(&|row| row.wrench.force)),
                Panel::lines("torque", "mN·m", axes(&|row| row.wrench.torque * 1e3)),
                Panel::lines(
                    "contacts and their clusters",
                    "number",
                    vec![
                        Series::new("contacts", BLUE, curve(&|row| f64::from(row.contacts))),
                        Series::new("clusters", GREEN, curve(&|row| f64::from(row.clusters))),
                    ],
                ),
                Panel::lines(
                    "separation: least distance, or minus the greatest depth",
                    "mm",
                    // The separation is infinite where no pair is near.
                    vec![Series::new("separation", BLUE, curve(&|row| row.separation * 1e3))],
                ),
                Panel::lines(
                    "contact query and force computation, the slowest 1 % cut off",
                    "µs",
                    vec![
                        Series::new("contact query", BLUE, cut(curve(&query_us))),
                        Series::new("force", VERMILION, cut(curve(&|row| row.force_us))),
                    ],
                ),
            ],
        )
    }
}

/// Makes histograms of the step times, and of the change of force from tick to tick.
pub(crate) fn run_histograms(rows: &[RecordRow]) -> [Figure; 2] {
    let one = |title, x_label, label, points| Figure {
        log_x: true,
        ..Figure::new(
            "",
            x_label,
            vec![Panel { title, unit: "ticks", series: vec![Series::new(label, BLUE, points)], drawn: Drawn::Bars }],
        )
    };
    let steps = rows.windows(2).map(|pair| pair[1].wrench.force.distance(pair[0].wrench.force) * 1e3);
    [
        one("how long steps took", "engine step (µs)", "step", histogram(rows.iter().map(|row| row.total_us))),
        one("by how much the force changed", "change of the force in a tick (mN)", "change", histogram(steps)),
    ]
}

/// Returns the time of contact query and depth, which together are the paper's contact query, µs.
pub(crate) fn query_us(row: &RecordRow) -> f64 {
    row.query_us + row.depth_us.unwrap_or(0.0)
}

/// Returns the time since the run began, s.
pub(crate) fn seconds(row: &RecordRow) -> f64 {
    row.time_ns as f64 * 1e-9
}

/// Returns the curve without outliers, because pauses of the operating system would flatten all
/// other values.
fn cut(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let mut values: Vec<f64> = points.iter().map(|point| point.1).collect();
    if let Some(ceiling) = quantile(&mut values, 0.99) {
        points.iter_mut().for_each(|point| point.1 = point.1.min(ceiling));
    }
    points
}
