//! Figure 4 of the paper, as a picture: a moment in which a spoon touches a cup in several
//! clusters, some penetrating and some within the tolerance, with the force of each cluster.

use std::fs;
use std::path::Path;

use palpus::WallClock;
use palpus::render::{Clustering, Renderer, Settings, WorkLimit};
use palpus_io::scene::FilePolicy;
use palpus_window::{Moment, View};
use serde::Serialize;

use super::TICK;
use super::figures::ticks;
use crate::files;
use crate::report::{Frame, Shot, of_moment};
use crate::stage::{self, Stage};

/// Content of the picture.
#[derive(Debug, Serialize)]
struct Description {
    tick: usize,
    contacts: usize,
    stiffness: f64,
    clusters: Vec<Cluster>,
}

#[derive(Debug, Serialize)]
struct Cluster {
    penetrating: bool,
    separation_m: f64,
    force_n: f64,
    contacts: u32,
}

/// Numbers of clusters in the paper's picture: one penetrates, and three are within the tolerance.
const PENETRATING: usize = 1;
const DISJOINT: usize = 3;

/// Writes the pictures (PNG; light and dark, whole and close up) and their description.
pub(super) fn figure_4(out: &Path) -> anyhow::Result<()> {
    let stage = stage::prepare("spoon-cup", FilePolicy::Inside)?;
    let as_in_the_paper = Settings { clustering: Clustering::Linkage, ..stage.settings };
    let mut renderer = Renderer::new(stage.probe.clone(), stage.environment.clone(), as_in_the_paper)?;
    renderer.allow(WorkLimit::Unlimited);
    let (moment, description) = choose(&stage, &mut renderer);
    for (frame, name) in [(Frame::Whole, "figure4"), (Frame::Contacts, "figure4_near")] {
        let shot =
            Shot { frame, view: View::Oblique, torque_max: as_in_the_paper.limits.torque, as_in_the_paper: true };
        let shots = of_moment(&stage, &moment, &shot)?;
        for (file, png) in [(format!("{name}.png"), &shots.light), (format!("{name}_dark.png"), &shots.dark)] {
            files::write(&out.join(file), png)?;
        }
    }
    fs::write(out.join("figure4.json"), serde_json::to_string_pretty(&description)?)?;
    Ok(())
}

/// Returns the moment of the script that is most like the paper's picture.
fn choose(stage: &Stage, renderer: &mut Renderer) -> (Moment, Description) {
    let clock = WallClock::new();
    let mut best: Option<(f64, Moment, Description)> = None;
    for k in 0..ticks(stage) {
        let time = k as f64 * TICK;
        let state = stage.scripted(time);
        let grip_a = renderer.settings().grip_a;
        let tick = renderer.step(&state, TICK, &clock);
        let forces = &tick.forces;
        let penetrating = forces.clusters.iter().filter(|cluster| cluster.separation < 0.0).count();
        let disjoint = forces.clusters.len() - penetrating;
        // Among ticks equally close to the paper's picture, takes the tick whose smallest force is
        // largest, so that every arrow can be seen.
        let least = forces.normal_forces.iter().copied().fold(f64::INFINITY, f64::min);
        let badness = (penetrating.abs_diff(PENETRATING) + disjoint.abs_diff(DISJOINT)) as f64 - least.min(0.5);
        if tick.contacts.is_empty() || best.as_ref().is_some_and(|known| known.0 <= badness) {
            continue;
        }
        let mut moment = Moment::new(tick.contacts.len());
        moment.fill(tick, time, grip_a);
        let clusters = forces.clusters.iter().zip(&forces.normal_forces).map(|(cluster, force)| Cluster {
            penetrating: cluster.separation < 0.0,
            separation_m: cluster.separation,
            force_n: *force,
            contacts: cluster.member_count,
        });
        let description = Description {
            tick: k,
            contacts: tick.contacts.len(),
            stiffness: stage.settings.stiffness,
            clusters: clusters.collect(),
        };
        best = Some((badness, moment, description));
    }
    let nothing = || Description { tick: 0, contacts: 0, stiffness: stage.settings.stiffness, clusters: Vec::new() };
    best.map_or_else(|| (Moment::new(0), nothing()), |(_, moment, description)| (moment, description))
}
