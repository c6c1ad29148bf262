//! What can be typed: the commands, and in a file for each family of them, their arguments.

mod bench;
mod keep;
mod machine;
mod model;
mod picture;
mod recording;
mod run;

use clap::{CommandFactory, Parser, Subcommand};
use palpus_io::scene::FilePolicy;

pub(crate) use bench::BenchCommand;
pub(crate) use keep::KeepArguments;
pub(crate) use machine::{DevicesArguments, DoctorArguments, SoakArguments};
pub(crate) use model::{
    AxisName, ClearanceArguments, DepthArguments, InspectArguments, PairArguments, PrepareArguments, QueryArguments,
    ViewArguments,
};
pub(crate) use picture::{Direction, PictureArguments};
pub(crate) use recording::{ConvertArguments, ReplayArguments, ReportArguments};
pub(crate) use run::{ExportArguments, RunArguments};

/// 6-degree-of-freedom haptic rendering between triangle meshes.
///
/// Without a command: a spoon in a cup, felt by a simulated hand at 1 kHz (`palpus run spoon-cup`).
#[derive(Debug, Parser)]
#[command(
    name = "palpus",
    version,
    max_term_width = 110,
    propagate_version = true,
    after_help = "Example:\n  palpus query spoon.obj cup.obj --poses poses.csv --out contacts.csv"
)]
pub(crate) struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    /// Neither takes prepared bodies from the user's cache folder nor keeps any there.
    #[arg(long, global = true)]
    pub(crate) no_cache: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Runs the closed loop: device, contacts, wrench, device, a thousand times a second.
    Run(Box<RunArguments>),
    /// Answers contacts of two models for a list of poses.
    Query(QueryArguments),
    /// Bounds how deep two models of any shape are in each other: the least translation that frees them, with proof.
    Depth(DepthArguments),
    /// Tells how far apart two models are along a path, or how deep in each other, and where it is tightest.
    Clearance(ClearanceArguments),
    /// Decomposes models into convex pieces, builds their hierarchies of hulls and keeps both for the next time.
    Prepare(PrepareArguments),
    /// Tells the health, mass properties and pieces of a model.
    Inspect(InspectArguments),
    /// Shows a model: its convex pieces together or apart, the Gauss map of a piece, how deep it is felt; in a window or as a picture.
    View(ViewArguments),
    /// Runs a recording again and compares every wrench bit for bit; or shows it.
    Replay(ReplayArguments),
    /// Writes a recording in another format: CSV, Parquet or MCAP.
    Convert(ConvertArguments),
    /// Writes a built-in scene as files (meshes, scene file, the hand's poses), to start your own from.
    Export(ExportArguments),
    /// Makes one HTML page of a recorded run, or of the whole reproduction of the paper; it needs no network and can be mailed.
    Report(ReportArguments),
    /// Tells which haptic devices are there, and what it would take to have the others.
    Devices(DevicesArguments),
    /// Tells whether this machine can hold the loop, and what would help.
    Doctor(DoctorArguments),
    /// Runs the loop in real time for hours, in a hand that wanders, and reports how it held.
    Soak(SoakArguments),
    /// Reproduces the paper's table and figures on this machine, and times the engine step.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Prints completions for a shell.
    #[command(after_help = "Example:\n  palpus completions bash > ~/.local/share/bash-completion/completions/palpus")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

impl Command {
    /// What runs when nothing is typed.
    pub(crate) fn demonstration() -> Self {
        Self::Run(Box::new(RunArguments { scene: "spoon-cup".into(), ..RunArguments::parse_from(["run"]) }))
    }
}

/// Prints the completions of `shell` on standard output.
pub(crate) fn completions(shell: clap_complete::Shell) {
    clap_complete::generate(shell, &mut Arguments::command(), "palpus", &mut std::io::stdout());
}

/// What a scene file may name, by `--allow-outside`.
pub(crate) fn file_policy(allow_outside: bool) -> FilePolicy {
    if allow_outside { FilePolicy::Anywhere } else { FilePolicy::Inside }
}
