//! The measurements of `palpus bench`, and their arguments.

use std::path::PathBuf;

use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// Measures the paper's Table 1 and Figures 4, 5 and 6, and writes them as PNG, SVG, CSV, text
    /// and JSON.
    #[command(after_help = "Example:\n  palpus bench figures --out figures")]
    Figures {
        /// The folder for the files.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/figures")]
        out: PathBuf,
        /// A folder with other meshes of the paper's triangle counts, as further rows of Table 1.
        #[arg(long, value_name = "DIR")]
        models: Option<PathBuf>,
    },
    /// Writes the plots of docs/penetration-depth.md and docs/global-depth.md, as SVG.
    #[command(after_help = "Example:\n  palpus bench depth --out plots")]
    Depth {
        /// The folder for the files.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/depth")]
        out: PathBuf,
    },
    /// Measures what contact feels like (steps of force and torque, errors, energy, stability) for
    /// every method, scene and hand.
    #[command(
        after_help = "Examples:\n  palpus bench feel --out feel\n  palpus bench feel --scene v-groove --method smooth --quick\n  palpus bench feel --sweep 200\n\nWrites feel.md, feel.html (with plots), feel.csv and feel.json. Every run gives the same numbers."
    )]
    Feel {
        /// The folder for the files.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/feel")]
        out: PathBuf,
        /// Only this scene.
        #[arg(long, value_name = "NAME")]
        scene: Option<String>,
        /// Only this method.
        #[arg(long, value_name = "NAME")]
        method: Option<String>,
        /// Measures less, in half a minute: parts of the scripts, one hand, a coarse search.
        #[arg(long)]
        quick: bool,
        /// Runs only the flush sweep: this many random cases of parts with play, tested for hum,
        /// energy and true overlap.
        #[arg(long, value_name = "N", conflicts_with_all = ["scene", "method", "quick"])]
        sweep: Option<usize>,
        /// Seed of the sweep's first case, decimal or hexadecimal (0x…).
        #[arg(long, value_name = "SEED", requires = "sweep", value_parser = seed)]
        seed: Option<u64>,
    },
    /// Compares engines on the same recorded motions: palpus's methods, the baselines, and any
    /// engine that answers in CSV. Measures errors, force steps, energy, pop-throughs and time.
    #[command(
        after_help = "Examples:\n  palpus bench open --out open --scenes-only\n  palpus bench open --out open --engine coal=my-answers\n\ndocs/open-benchmark.md describes how an engine takes part."
    )]
    Open {
        /// The folder for the files.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/open")]
        out: PathBuf,
        /// Only this scene.
        #[arg(long, value_name = "NAME")]
        scene: Option<String>,
        /// Also measures parts with a known play. Their models are in this folder or in its
        /// subfolders; parts without models are left out.
        #[arg(long, value_name = "DIR")]
        models: Option<PathBuf>,
        /// Another engine: its name and the folder of its answers, with one file SCENE.csv for
        /// each scene. May be given several times.
        #[arg(long = "engine", value_name = "NAME=DIR", value_parser = engine)]
        engines: Vec<(String, PathBuf)>,
        /// Writes only the scenes and motions, which other engines need.
        #[arg(long)]
        scenes_only: bool,
        /// Uses at most this many seconds of each motion. Answers of other engines must have the
        /// same length.
        #[arg(long, value_name = "S", value_parser = seconds)]
        seconds: Option<f64>,
    },
    /// Times the engine step against the number of triangles, against the number of contacts, and
    /// on real pairs. Writes plots, CSV, JSON and text.
    #[command(
        after_help = "Example:\n  palpus bench scale --models models --out scale\n\nbenches/peers/coal_scale.py runs this and times Coal's tolerance query on the same poses."
    )]
    Scale {
        /// The folder for the files.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/scale")]
        out: PathBuf,
        /// A folder with the real meshes of the pairs; pairs without meshes are skipped.
        #[arg(long, value_name = "DIR")]
        models: Option<PathBuf>,
        /// Ticks of contact per pair.
        #[arg(long, value_name = "N", default_value_t = 20_000)]
        ticks: usize,
        /// Number of passes over the same ticks. The smallest time of each tick counts, which
        /// removes most interruptions by the operating system.
        #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
        passes: u32,
        /// Only the pair of this name, or one of `triangles`, `contacts` (the two sweeps) and
        /// `hurried` (steps with and without a work limit).
        #[arg(long, value_name = "NAME")]
        only: Option<String>,
    },
    /// Measures close-fitting contact (a nut pressed on its thread, gears, a peg in its hole,
    /// scans): time and work of a step, and the error of the wrench.
    #[command(
        after_help = "Example:\n  palpus bench conformal --models models --out conformal\n\nTimes are processor time of one thread. docs/conformal.md describes the columns.\nbenches/peers/conformal_peers.py runs other engines on the same poses."
    )]
    Conformal {
        /// The folder for the files.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/conformal")]
        out: PathBuf,
        /// A folder with the real meshes; cases whose meshes are missing are left out.
        #[arg(long, value_name = "DIR")]
        models: Option<PathBuf>,
        /// Ticks per case.
        #[arg(long, value_name = "N", default_value_t = 2000, value_parser = ticks)]
        ticks: usize,
        /// Number of poses of each case at which the wrench is compared with the truth. For screw
        /// threads, each pose takes seconds.
        #[arg(long, value_name = "N", default_value_t = 24)]
        truths: usize,
        /// Only the case of this name, or the cases whose names begin with this text.
        #[arg(long, value_name = "NAME")]
        only: Option<String>,
        /// Also writes the bodies, the compared poses, the answers and the truth of each case to a
        /// folder, for other engines.
        #[arg(long)]
        traces: bool,
        /// Number of threads that take part in the steps of close-fitting parts, besides the thread
        /// that is timed.
        #[arg(long, value_name = "N", default_value_t = 0)]
        helpers: usize,
    },
    /// Times the engine step (query, depth, force) of two models over a list of poses.
    #[command(
        after_help = "Example:\n  palpus bench step spoon.obj cup.obj --poses path.csv --out step.csv --tolerance 0.01"
    )]
    Step {
        /// The model of body A.
        a: PathBuf,
        /// The model of body B.
        b: PathBuf,
        /// Poses of A in B's frame (CSV), as for `palpus query`.
        #[arg(long, value_name = "F.csv")]
        poses: PathBuf,
        /// The file of the times (CSV).
        #[arg(long, value_name = "R.csv")]
        out: PathBuf,
        /// Distance below which pieces are in contact, model units [default: 1 % of the smaller
        /// model's diagonal].
        #[arg(long, value_name = "T")]
        tolerance: Option<f64>,
    },
}

/// Reads a seed.
fn seed(text: &str) -> Result<u64, std::num::ParseIntError> {
    text.strip_prefix("0x").map_or_else(|| text.parse(), |digits| u64::from_str_radix(digits, 16))
}

/// Reads a number of ticks; the two stretches of a case need at least one tick each.
fn ticks(text: &str) -> Result<usize, String> {
    let ticks: usize = text.parse().map_err(|_| format!("{text} is not a number of ticks"))?;
    if ticks < 2 { Err("at least 2 ticks are needed".to_owned()) } else { Ok(ticks) }
}

/// Reads the name and the folder of an engine.
fn engine(text: &str) -> Result<(String, PathBuf), String> {
    let usable = |name: &str| !name.is_empty() && !name.contains([',', '|', '\n']);
    match text.split_once('=') {
        Some((name, folder)) if usable(name) && !folder.is_empty() => Ok((name.to_owned(), PathBuf::from(folder))),
        _ => Err(format!("{text} is not NAME=DIR, as in coal=my-answers")),
    }
}

/// Reads a length of time, s.
fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds > 0.0);
    seconds.ok_or_else(|| format!("{text} is not a number of seconds above 0"))
}
