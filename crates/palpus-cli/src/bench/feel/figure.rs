//! The plots of a scene: the force of every method on the same poses, and the force on the normal
//! hand while this hand held still.

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
    let series = |of: &dyn Fn(&Outcome) -> Vec<(f64, f64)>| -> Vec<Series> {
        let one = |(k, (label, outcome)): (usize, &(&'static str, &Outcome))| Series::new(label, color(k), of(outcome));
        curves.iter().enumerate().filter(|(_, (_, outcome))| !outcome.curve.times.is_empty()).map(one).collect()
    };
    let felt = |outcome: &Outcome, of: &dyn Fn(&palpus::algebra::Wrench) -> f64| -> Vec<(f64, f64)> {
        outcome.curve.times.iter().zip(&outcome.curve.wrenches).map(|(time, felt)| (*time, of(felt))).collect()
    };
    let steps = |outcome: &Outcome| -> Vec<(f64, f64)> {
        let pairs = outcome.curve.wrenches.windows(2).zip(outcome.curve.times.iter().skip(1));
        pairs.map(|(pair, time)| (*time, pair[1].force.distance(pair[0].force))).collect()
    };

    let depths = ground.depths.iter().enumerate().map(|(k, depth)| ((k * JUDGED) as f64 * TICK, *depth > 0.0));
    Figure {
        bands: bands(depths),
        ..Figure::new(
            format!("{}, open loop: the same poses for all (shaded: overlapping)", ground.name),
            "time (s)",
            vec![
                Panel::lines("force", "N", series(&|outcome| felt(outcome, &|w| w.force.length()))),
                Panel::lines("torque", "mN·m", series(&|outcome| felt(outcome, &|w| w.torque.length() * 1e3))),
                Panel::lines("change of the force in a millisecond", "N", series(&steps)),
            ],
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
