//! Measures the error of a step with limited work. The wrench on the hand is compared with the
//! wrench without a limit, for the same motion of the device, both behind the default coupling.

use std::path::PathBuf;
use std::sync::Arc;

use palpus::algebra::{NoClock, Wrench, quantile_of_sorted};
use palpus::body::Body;
use palpus::render::{ProbeState, Renderer, Settings, WorkLimit};
use serde::Serialize;

use super::pairs::{self, Pair};
use crate::bench::TICK;

/// Work limit of a step, in units of work: 0.6 ms at 100 ns for each unit.
pub(super) const ALLOWED: u64 = 6000;
/// Number of ticks of the comparison. Without a limit, a tick of the nut on its thread takes a
/// tenth of a second.
const TICKS: usize = 600;
/// Default tolerance of a scene, as a share of the smaller body.
const TOLERANCE: f64 = 0.01;

/// Results for one pair.
#[derive(Debug, Serialize)]
pub(super) struct Hurried {
    name: &'static str,
    ticks: usize,
    /// Share of the ticks in which the limit was reached, and share of the contacts that were
    /// extrapolated in these ticks.
    late: f64,
    held: f64,
    force: Difference,
    torque: Difference,
}

/// Errors of force (N) or torque (N·m).
#[derive(Debug, Serialize)]
pub(super) struct Difference {
    /// Largest value without a limit.
    most: f64,
    /// Difference from the step without a limit.
    mean: f64,
    p99: f64,
    worst: f64,
    /// Largest change in a tick, without and with the limit.
    step: f64,
    hurried_step: f64,
}

pub(super) fn measure(pair: &Pair, files: &[PathBuf; 2], ticks: usize) -> anyhow::Result<Hurried> {
    let (bodies, stretches) = pairs::posed(pair, files, ticks.min(TICKS))?;
    let settings = settings(&bodies.a, &bodies.b);
    let renderer = || Renderer::new(Arc::clone(&bodies.a), Arc::clone(&bodies.b), settings);
    let (mut full, mut hurried) = (renderer()?, renderer()?);
    let (mut force, mut torque) = (Gathered::default(), Gathered::default());
    let (mut late, mut held, mut contacts, mut count) = (0, 0.0, 0.0, 0);
    for stretch in &stretches {
        full.clear();
        hurried.clear();
        // The first step begins at the roots of both bodies. There is no force yet, so this step is
        // left out of the comparison.
        hurried.allow(WorkLimit::Unlimited);
        for renderer in [&mut full, &mut hurried] {
            renderer.step(&ProbeState::at(stretch[0]), TICK, &NoClock);
        }
        hurried.allow(WorkLimit::Units(ALLOWED));
        let mut last: Option<[Wrench; 2]> = None;
        for pose in &stretch[1..] {
            let state = ProbeState::at(*pose);
            let expected = full.step(&state, TICK, &NoClock).commanded;
            let tick = hurried.step(&state, TICK, &NoClock);
            let now = [expected, tick.commanded];
            force.add(now.map(|wrench| wrench.force), last.map(|last| last.map(|wrench| wrench.force)));
            torque.add(now.map(|wrench| wrench.torque), last.map(|last| last.map(|wrench| wrench.torque)));
            late += u32::from(tick.is_late());
            held += f64::from(tick.counters.query.held);
            contacts += tick.contacts.len() as f64;
            count += 1;
            last = Some(now);
        }
    }
    Ok(Hurried {
        name: pair.name,
        ticks: count,
        late: f64::from(late) / count.max(1) as f64,
        held: held / f64::max(contacts, 1.0),
        force: force.finish(),
        torque: torque.finish(),
    })
}

/// Returns the settings of a scene file that names only two meshes.
fn settings(a: &Body, b: &Body) -> Settings {
    Settings::coupled(Settings::default().limits, TICK, TOLERANCE * a.size().min(b.size()))
}

#[derive(Default)]
struct Gathered {
    most: f64,
    differences: Vec<f64>,
    steps: [f64; 2],
}

impl Gathered {
    fn add(&mut self, [full, hurried]: [glam::DVec3; 2], last: Option<[glam::DVec3; 2]>) {
        self.most = self.most.max(full.length());
        self.differences.push(full.distance(hurried));
        if let Some([full_last, hurried_last]) = last {
            self.steps[0] = self.steps[0].max(full.distance(full_last));
            self.steps[1] = self.steps[1].max(hurried.distance(hurried_last));
        }
    }

    fn finish(mut self) -> Difference {
        self.differences.sort_by(f64::total_cmp);
        let at = |share| quantile_of_sorted(&self.differences, share).unwrap_or(0.0);
        Difference {
            most: self.most,
            mean: self.differences.iter().sum::<f64>() / self.differences.len().max(1) as f64,
            p99: at(0.99),
            worst: at(1.0),
            step: self.steps[0],
            hurried_step: self.steps[1],
        }
    }
}

/// Returns the results of the pairs as text.
pub(super) fn text(rows: &[Hurried]) -> String {
    let mut text = format!("with {ALLOWED} units of work in a step, compared with no limit:\n");
    for row in rows {
        let Hurried { name, ticks, late, held, force, torque } = row;
        text += &format!(
            "{name}: {ticks} ticks, {:.0} % of them at the work limit, {:.0} % of the contacts extrapolated\n",
            100.0 * late,
            100.0 * held
        );
        for (what, scale, unit, d) in [("force", 1.0, "N", force), ("torque", 1e3, "mN·m", torque)] {
            let said = |x: f64| format!("{:.3}", x * scale);
            text += &format!(
                "  {what}: to {} {unit}; off by {} in the mean, {} (p99), {} at most; largest step {} without the limit, {} with it\n",
                said(d.most),
                said(d.mean),
                said(d.p99),
                said(d.worst),
                said(d.step),
                said(d.hurried_step)
            );
        }
    }
    text
}
