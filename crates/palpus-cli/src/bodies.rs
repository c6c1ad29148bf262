//! Prepares a body from a mesh, a file or a scene: reads it from the user's cache, or builds it
//! with a progress bar.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, anyhow};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus_io::{BodyCache, BodyKey, CacheMiss, ContentHash, MeshFileError, Threads, read_mesh_from, read_mesh_noting};

use crate::{files, output};

/// A body and its origin.
pub(crate) struct Prepared {
    /// The body.
    pub(crate) body: Body,
    /// Content hash of the polygons as read.
    pub(crate) hash: ContentHash,
    /// Time from polygons to body.
    pub(crate) seconds: f64,
    /// True if the body came from the cache.
    pub(crate) kept: bool,
}

/// Cache of prepared bodies for the whole program; `None` with `--no-cache`.
static CACHE: OnceLock<Option<BodyCache>> = OnceLock::new();

/// Sets, before the first body is prepared, whether the cache is used.
pub(crate) fn use_cache(yes: bool) {
    CACHE.get_or_init(|| if yes { BodyCache::of_user() } else { None });
}

/// How progress is reported while a body is prepared.
pub(crate) enum Teller<'a> {
    /// With a bar in the terminal.
    Bar,
    /// With calls that get the name of the body and the finished share, 0 to 1.
    Calls(&'a (dyn Fn(&str, f64) + Sync)),
}

/// Reads a mesh file, with a note if its format differs from its extension.
pub(crate) fn read_mesh(path: &Path) -> Result<PolygonSoup, MeshFileError> {
    read_mesh_noting(path, &mut |notice| output::note(format!("note: {notice}")))
}

/// Reads and prepares a model file, or the model from standard input for `-`, in model units.
pub(crate) fn prepare_file(path: &Path, settings: &BodySettings) -> anyhow::Result<Prepared> {
    if !files::is_standard(path) {
        return prepare_mesh_telling(path, &read_mesh(path)?, settings, &Teller::Bar);
    }
    let name = files::input_name(path);
    let soup = read_mesh_from(files::read_standard()?, &name)?;
    prepare_soup(&name, &soup, settings).with_context(|| format!("the model from {name} cannot be prepared"))
}

/// Prepares two bodies at the same time, and reports their mean progress to `teller`. Much of a
/// preparation runs on one thread, so together they take little longer than the slower one.
pub(crate) fn prepare_two(
    teller: &Teller<'_>,
    one: impl FnOnce(&Teller<'_>) -> anyhow::Result<Prepared>,
    other: impl FnOnce(&Teller<'_>) -> anyhow::Result<Prepared> + Send,
) -> anyhow::Result<[Prepared; 2]> {
    let shares = [const { AtomicU64::new(0) }; 2];
    let bar = matches!(teller, Teller::Bar).then(|| bar(BOTH));
    let tell = |which: usize, done: f64| {
        shares[which].store((done * BAR_STEPS) as u64, Ordering::Relaxed);
        let mean = shares.iter().map(|share| share.load(Ordering::Relaxed)).sum::<u64>() / 2;
        match (teller, &bar) {
            (Teller::Calls(tell), _) => tell(BOTH, mean as f64 / BAR_STEPS),
            (Teller::Bar, bar) => bar.iter().for_each(|bar| bar.set_position(mean)),
        }
    };
    let (of_one, of_other) = (|_: &str, done: f64| tell(0, done), |_: &str, done: f64| tell(1, done));
    let prepared = thread::scope(|scope| {
        let working = scope.spawn(|| other(&Teller::Calls(&of_other)));
        let one = one(&Teller::Calls(&of_one));
        let other = working.join().map_err(|_| anyhow!("a body could not be prepared; please report this"))?;
        Ok([one?, other?])
    });
    bar.iter().for_each(ProgressBar::finish_and_clear);
    prepared
}

/// Name of two bodies that are prepared together, in reports of progress.
const BOTH: &str = "both bodies";

/// Prepares the polygons of a model file, and reports progress to `teller`.
pub(crate) fn prepare_mesh_telling(
    path: &Path,
    soup: &PolygonSoup,
    settings: &BodySettings,
    teller: &Teller<'_>,
) -> anyhow::Result<Prepared> {
    let name = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    prepare_soup_telling(&name, soup, settings, teller)
        .with_context(|| format!("{} cannot be prepared", path.display()))
}

/// Prepares polygons; the bar shows `name`.
pub(crate) fn prepare_soup(name: &str, soup: &PolygonSoup, settings: &BodySettings) -> anyhow::Result<Prepared> {
    prepare_soup_telling(name, soup, settings, &Teller::Bar)
}

/// Prepares polygons, and reports progress to `teller`.
pub(crate) fn prepare_soup_telling(
    name: &str,
    soup: &PolygonSoup,
    settings: &BodySettings,
    teller: &Teller<'_>,
) -> anyhow::Result<Prepared> {
    let begin = Instant::now();
    let threads = Threads::all();
    let hash = ContentHash::of_soup(soup);
    let key = BodyKey::new(&hash, settings);
    let cache = CACHE.get().and_then(Option::as_ref);
    let prepared = |body: Body, kept| {
        let seconds = begin.elapsed().as_secs_f64();
        let (triangles, pieces) = (body.mesh().triangles().len(), body.pieces().len());
        let whence = if kept { "from the cache" } else { "prepared" };
        output::detail(format!("{name}: {triangles} triangles, {pieces} convex pieces, {whence} in {seconds:.2} s"));
        Prepared { body, hash, seconds, kept }
    };
    match cache.map(|cache| cache.load(&key, soup, settings, &threads)) {
        Some(Ok(body)) => {
            if let Teller::Calls(tell) = teller {
                tell(name, 1.0);
            }
            return Ok(prepared(body, true));
        }
        Some(Err(miss)) if !matches!(miss, CacheMiss::Absent) => {
            output::note(format!("note: {name} is prepared again, because {miss}"));
        }
        _ => {}
    }
    let body = match teller {
        Teller::Bar => {
            let bar = bar(name);
            let mut progress = |done: f64| bar.set_position((done * BAR_STEPS) as u64);
            let body = Body::from_soup_with(soup, settings, &threads, &mut progress);
            bar.finish_and_clear();
            body
        }
        Teller::Calls(tell) => Body::from_soup_with(soup, settings, &threads, &mut |done| tell(name, done)),
    };
    let prepared = prepared(body?, false);
    if let Some(cache) = cache
        && let Err(error) = cache.store(&key, &prepared.body)
    {
        let folder = cache.folder().display();
        output::note(format!("note: {name} could not be stored in {folder} ({error}); --no-cache turns the cache off"));
    }
    Ok(prepared)
}

const BAR_STEPS: f64 = 1000.0;

/// Creates a bar on standard error. The bar is hidden at first, so that it does not flicker for
/// small models.
fn bar(name: &str) -> ProgressBar {
    let target = if output::is_quiet() { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
    let bar = ProgressBar::with_draw_target(Some(BAR_STEPS as u64), target);
    if let Ok(style) = ProgressStyle::with_template("{msg:24!} [{bar:40}] {percent:>3} % {elapsed}") {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_message(format!("preparing {name}"));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
