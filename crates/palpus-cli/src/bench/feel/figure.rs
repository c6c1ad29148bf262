//! The plots of a scene: what every method felt on the same poses, and what the normal hand felt while it held still.

use plotters::prelude::RGBColor;

use super::Outcome;
use super::ground::{Ground, JUDGED, TICK};
use crate::plots::{self, BLUE, Figure, GREEN, Panel, Series, VERMILION, bands};

/// Of the methods, in their order; after Okabe and Ito.
const COLORS: [RGBColor; 10] = [
    VERMILION,
    BLUE,
    GREEN,
    RGBColor(204, 121, 167),
    RGBColor(150, 75, 0),
    RGBColor(0, 60, 130),
    RGBColor(120, 120, 120),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// Bins of a curve; each shows its least and its largest value.
const BINS: usize = 400;

/// The plots of one scene, as SVG.
pub(super) fn of_scene(ground: &Ground, curves: &[(&'static str, &Outcome)]) -> anyhow::Result<Vec<String>> {
    let mut figures = vec![plots::svg(&open_loop(ground, curves))?];
    if curves.iter().any(|(_, outcome)| !outcome.held.is_empty()) {
        figures.push(plots::svg(&held(ground, curves))?);
    }
    Ok(figures)
}

fn open_loop(ground: &Ground, curves: &[(&'static str, &Outcome)]) -> Figure {
    let series = |of: &dyn Fn(&Outcome) -> Vec<(f64, f64)>| -> Vec<Series> {
        let one = |(k, (label, outcome)): (usize, &(&'static str, &Outcome))| Series {
            label,
            color: COLORS[k % COLORS.len()],
            points: envelope(&of(outcome)),
        };
        curves.iter().enumerate().filter(|(_, (_, outcome))| !outcome.curve.times.is_empty()).map(one).collect()
    };
    let felt = |outcome: &Outcome, of: &dyn Fn(&palpus::algebra::Wrench) -> f64| -> Vec<(f64, f64)> {
        outcome.curve.times.iter().zip(&outcome.curve.wrenches).map(|(time, felt)| (*time, of(felt))).collect()
    };
    let steps = |outcome: &Outcome| -> Vec<(f64, f64)> {
        let pairs = outcome.curve.wrenches.windows(2).zip(outcome.curve.times.iter().skip(1));
        pairs.map(|(pair, time)| (*time, pair[1].force.distance(pair[0].force))).collect()
    };
    let panel = |title, unit, series| Panel { title, unit, series, thick_in_bands: false };
    let depths = ground.depths.iter().enumerate().map(|(k, depth)| ((k * JUDGED) as f64 * TICK, *depth > 0.0));
    Figure {
        title: format!("{}, open loop: the same poses for all (shaded: overlapping)", ground.name),
        x_label: "time (s)",
        log_x: false,
        bands: bands(depths),
        panels: vec![
            panel("force", "N", series(&|outcome| felt(outcome, &|w| w.force.length()))),
            panel("torque", "mN·m", series(&|outcome| felt(outcome, &|w| w.torque.length() * 1e3))),
            panel("change of the force in a millisecond", "N", series(&steps)),
        ],
    }
}

fn held(ground: &Ground, curves: &[(&'static str, &Outcome)]) -> Figure {
    let panels = curves.iter().enumerate().map(|(k, &(label, outcome))| Panel {
        title: label,
        unit: "N",
        series: vec![Series {
            label,
            color: COLORS[k % COLORS.len()],
            points: envelope(
                &outcome.held.iter().map(|tick| (tick.time, tick.felt.force.length())).collect::<Vec<_>>(),
            ),
        }],
        thick_in_bands: false,
    });
    Figure {
        title: format!("{}, held by a normal hand that presses with 1 N", ground.name),
        x_label: "time (s)",
        log_x: false,
        bands: Vec::new(),
        panels: panels.collect(),
    }
}

/// The least and the largest of each bin, in the order in which they came.
fn envelope(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut thinned = Vec::new();
    for bin in points.chunks(points.len().div_ceil(BINS).max(1)) {
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (Some(&low), Some(&high)) = (bin.iter().min_by(by_height), bin.iter().max_by(by_height)) else { continue };
        let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
        thinned.push(first);
        if second.0 > first.0 {
            thinned.push(second);
        }
    }
    thinned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_envelope_keeps_the_extremes() {
        let points: Vec<(f64, f64)> = (0..10_000).map(|k| (f64::from(k), if k == 7777 { 9.0 } else { 1.0 })).collect();
        let thinned = envelope(&points);
        assert!(thinned.len() <= 2 * BINS && thinned.contains(&(7777.0, 9.0)));
        assert!(thinned.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(envelope(&[(0.0, 1.0), (1.0, 2.0)]), [(0.0, 1.0), (1.0, 2.0)]);
    }
}
