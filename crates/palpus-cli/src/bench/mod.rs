//! `palpus bench`: the paper's table and figures as measured here, and the time of the engine step
//! as a function of triangles, contacts and bodies.

mod conformal;
mod depth;
mod feel;
mod figure_4;
mod figures;
mod scale;
mod step;
mod table;

use std::process::ExitCode;

use palpus::render::{Limits, Settings};

use crate::args::BenchCommand;
pub(crate) use table::find as find_model;

pub(crate) fn bench(command: &BenchCommand) -> anyhow::Result<ExitCode> {
    match command {
        BenchCommand::Figures { out, models } => figures::figures(out, models.as_deref()),
        BenchCommand::Depth { out } => depth::depth(out),
        BenchCommand::Feel { out, scene, method, quick, sweep, seed } => feel::feel(&feel::Wanted {
            out,
            scene: scene.as_deref(),
            method: method.as_deref(),
            quick: *quick,
            sweep: *sweep,
            seed: *seed,
        }),
        BenchCommand::Open { out, scene, models, engines, scenes_only, seconds } => {
            feel::open_benchmark(&feel::OpenAsked {
                out,
                scene: scene.as_deref(),
                models: models.as_deref(),
                engines,
                scenes_only: *scenes_only,
                seconds: seconds.unwrap_or(f64::INFINITY),
            })
        }
        BenchCommand::Scale { out, models, ticks, passes, only } => {
            let effort = scale::Effort { ticks: *ticks, passes: *passes };
            scale::scale(out, models.as_deref(), effort, only.as_deref())
        }
        BenchCommand::Conformal { out, models, ticks, truths, only, traces, helpers } => {
            let extent = [*ticks, *truths, *helpers];
            conformal::conformal(out, models.as_deref(), extent, only.as_deref(), *traces)
        }
        BenchCommand::Step { a, b, poses, out, tolerance } => step::step(a, b, poses, out, *tolerance),
    }
}

/// Length of a tick, s.
const TICK: f64 = 1e-3;

/// Moves the memory to large pages, as `palpus run` does before its loop starts. If the system
/// refuses, the benchmark runs with small pages, as the loop would.
fn use_large_pages() {
    let _ = palpus_alloc::use_large_pages(palpus_alloc::Extent::All);
}

/// Returns a renderer's settings with this tolerance: the settings of `palpus run`, without a
/// device's limits.
fn settings(tolerance: f64) -> Settings {
    Settings {
        contact_tolerance: tolerance,
        cluster_radius: CLUSTER_TOLERANCES * tolerance,
        limits: Limits { force: f64::INFINITY, torque: f64::INFINITY },
        ..Settings::default()
    }
}

/// Cluster radius in contact tolerances, as in the built-in scenes.
const CLUSTER_TOLERANCES: f64 = 4.0;
