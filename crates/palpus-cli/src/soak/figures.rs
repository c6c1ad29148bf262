//! The plots of a soak run: values over time, and the distribution of the lateness.

use super::report::{Report, Row, Stretch};
use crate::plots::{self, BLUE, Figure, GREEN, Panel, Series, VERMILION};

/// Returns both plots as SVG.
pub(super) fn of(report: &Report) -> [String; 2] {
    [over_time(report), how_late(report)].map(|figure| plots::svg(&figure).as_str().to_owned())
}

fn over_time(report: &Report) -> Figure {
    let curve = |label, color, of: &dyn Fn(&Row) -> f64| {
        let points = report.rows.iter().map(|row| ((row.begin_s + row.end_s) / 120.0, of(row))).collect();
        Series::new(label, color, points)
    };
    let megabytes = |bytes: Option<u64>| bytes.map_or(f64::NAN, |bytes| bytes as f64 / 1048576.0);
    let memory = report.samples.iter().map(|(time, sample)| (time / 60.0, megabytes(sample.resident))).collect();
    Figure::new(
        format!("{}: the loop over time", report.scene),
        "time (min)",
        vec![
            Panel::lines("rate", "Hz", vec![curve("rate", BLUE, &|row| row.rate_hz)]),
            Panel::lines(
                "late by over half a millisecond",
                "% of ticks",
                vec![curve("late", VERMILION, &|row| row.late_share * 100.0)],
            ),
            Panel::lines(
                "a step takes",
                "µs",
                vec![curve("p99", VERMILION, &|row| row.step_us.p99), curve("median", BLUE, &|row| row.step_us.p50)],
            ),
            Panel::lines(
                "contacts",
                "",
                vec![
                    curve("most", GREEN, &|row| f64::from(row.contacts_max)),
                    curve("mean", BLUE, &|row| row.contacts_mean),
                ],
            ),
            Panel::lines("memory of the program", "MB", vec![Series::new("resident", BLUE, memory)]),
            Panel::lines(
                "work of other programs",
                "cores",
                vec![curve("others", VERMILION, &|row| row.others_cores.unwrap_or(f64::NAN))],
            ),
        ],
    )
}

/// Shares below one in ten million are not drawn.
const LEAST_LOG: f64 = -7.0;

fn how_late(report: &Report) -> Figure {
    let series = |label, color, stretch: &Stretch| {
        let log = |share: f64| if share > 0.0 { share.log10().max(LEAST_LOG) } else { f64::NAN };
        Series::new(label, color, stretch.beyond.iter().map(|&(late, share)| (late, log(share))).collect())
    };
    let mut curves = Vec::new();
    curves.extend(report.before.as_ref().map(|bare| series("timer before", GREEN, bare)));
    curves.extend(report.after.as_ref().map(|bare| series("timer after", BLUE, bare)));
    curves.push(series("the loop", VERMILION, &report.lateness()));
    Figure {
        log_x: true,
        ..Figure::new(
            "lateness of the ticks of the loop, and of a bare timer on the same machine",
            "late by more than (µs)",
            vec![Panel::lines("share of ticks that are later (−3: one in a thousand)", "power of ten", curves)],
        )
    }
}
