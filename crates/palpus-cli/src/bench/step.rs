//! `palpus bench step`: the time of the engine step over a list of poses.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;

use palpus::algebra::{WallClock, quantile};
use palpus::body::BodySettings;
use palpus::render::{ProbeState, Renderer};
use palpus_io::read_poses;

use super::TICK;
use crate::{bodies, output, query};

pub(super) fn step(a: &Path, b: &Path, poses: &Path, out: &Path, tolerance: Option<f64>) -> anyhow::Result<ExitCode> {
    let poses = read_poses(poses)?;
    let settings = BodySettings::default();
    let a = Arc::new(bodies::prepare_file(a, &settings)?.body);
    let b = Arc::new(bodies::prepare_file(b, &settings)?.body);
    let tolerance = query::tolerance_of(tolerance, &a, &b)?;
    let mut renderer = Renderer::new(a, b, super::settings(tolerance))?;
    let clock = WallClock::new();
    let mut file = query::create(out)?;
    writeln!(file, "frame,query_us,depth_us,force_us,total_us,contacts,clusters,separation")?;
    let mut totals = Vec::with_capacity(poses.len());
    for (frame, pose) in poses.iter().enumerate() {
        let tick = renderer.step(&ProbeState::at(*pose), TICK, &clock).summary();
        let micros = |ns: u64| ns as f64 / 1e3;
        let times = &tick.times;
        let (query, depth, force, total) =
            (micros(times.query), micros(times.depth), micros(times.force), micros(times.total));
        let (contacts, clusters, separation) = (tick.contacts, tick.clusters, tick.separation);
        writeln!(file, "{frame},{query},{depth},{force},{total},{contacts},{clusters},{separation}")?;
        totals.push(total);
    }
    file.flush()?;
    if let [Some(p50), Some(p99), Some(max)] = [0.5, 0.99, 1.0].map(|share| quantile(&mut totals, share)) {
        output::line(format!("{} steps: p50 {p50:.1} µs, p99 {p99:.1} µs, max {max:.1} µs", totals.len()));
    }
    Ok(ExitCode::SUCCESS)
}
