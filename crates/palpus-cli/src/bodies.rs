//! From a mesh, file or scene, to a prepared body, with a bar that moves while it is prepared.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::Context;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus_io::{ContentHash, read_mesh};

use crate::threads::Threads;

/// A body and how it came about.
pub(crate) struct Prepared {
    /// The body.
    pub(crate) body: Body,
    /// Of the polygons as read.
    pub(crate) hash: ContentHash,
    /// From polygons to body.
    pub(crate) seconds: f64,
}

/// Reads and prepares a model file, in model units.
pub(crate) fn prepare_file(path: &Path, settings: &BodySettings) -> anyhow::Result<Prepared> {
    let soup = read_mesh(path)?;
    let name = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    prepare_soup(&name, &soup, settings).with_context(|| format!("{} cannot be prepared", path.display()))
}

/// Prepares polygons; `name` stands beside the bar.
pub(crate) fn prepare_soup(name: &str, soup: &PolygonSoup, settings: &BodySettings) -> anyhow::Result<Prepared> {
    let begin = Instant::now();
    let bar = bar(name);
    let mut progress = |done: f64| bar.set_position((done * BAR_STEPS) as u64);
    let body = Body::from_soup_with(soup, settings, &Threads::all(), &mut progress)?;
    bar.finish_and_clear();
    Ok(Prepared { body, hash: ContentHash::of_soup(soup), seconds: begin.elapsed().as_secs_f64() })
}

const BAR_STEPS: f64 = 1000.0;

/// A bar on standard error; it stays hidden for the first moments, so that small models do not flicker.
fn bar(name: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS as u64), ProgressDrawTarget::stderr_with_hz(10));
    if let Ok(style) = ProgressStyle::with_template("{msg:24!} [{bar:40}] {percent:>3} % {elapsed}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_message(format!("preparing {name}"));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
