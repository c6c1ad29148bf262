//! The plots of a scene: the force of every method on the same poses, and the force on the normal
//! hand while this hand held still. Each method has its own panel, since many curves in one panel
//! would hide each other.

use super::Outcome;
use super::ground::{Ground, JUDGED};
use crate::bench::TICK;
use crate::plots::{self, BLUE, Figure, GREEN, Ink, Panel, Series, VERMILION, bands};

/// Returns the colour of the `k`-th method.
fn color(k: usize) -> Ink {
    match k {
        0 => VERMILION,
        1 => BLUE,
        2 => GREEN,
        _ => Ink::nth(k),
    }
}

/// Returns the plots of one scene, as SVG.
pub(super) fn of_scene(ground: &Ground, curves: &[(&'static str, &Outcome)]) -> Vec<plots::Svg> {
    let mut figures = vec![plots::svg(&open_loop(ground, curves))];
    if curves.iter().any(|(_, outcome)| !outcome.held.is_empty()) {
        figures.push(plots::svg(&held(ground, curves)));
    }
    figures
}

fn open_loop(ground: &Ground, curves: &[(&'static str, &Outcome)]) -> Figure {
    let force = |(k, (label, outcome)): (usize, &(&'static str, &Outcome))| {
        let curve = &outcome.curve;
        let points = curve.times.iter().zip(&curve.wrenches).map(|(time, felt)| (*time, felt.force.length())).collect();
        Panel::lines(label, "force, N", vec![Series::new(label, color(k), points)])
    };
    let is_measured = |(_, (_, outcome)): &(usize, &(&'static str, &Outcome))| !outcome.curve.times.is_empty();
    let depths = ground.depths.iter().enumerate().map(|(k, depth)| ((k * JUDGED) as f64 * TICK, *depth > 0.0));
    Figure {
        bands: bands(depths),
        ..Figure::new(
            format!("{}, open loop: the same poses for all methods (shaded: overlapping)", ground.name),
            "time (s)",
            curves.iter().enumerate().filter(is_measured).map(force).collect(),
        )
    }
}

fn held(ground: &Ground, curves: &[(&'static str, &Outcome)]) -> Figure {
    let panels = curves.iter().enumerate().map(|(k, &(label, outcome))| {
        Panel::lines(
            label,
            "N",
            vec![Series::new(
                label,
                color(k),
                outcome.held.iter().map(|tick| (tick.time, tick.felt.force.length())).collect(),
            )],
        )
    });
    Figure::new(format!("{}, held by a normal hand that presses with 1 N", ground.name), "time (s)", panels.collect())
}
