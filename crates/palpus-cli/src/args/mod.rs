//! The command line: the commands, and in one file for each group of commands, their arguments.

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
/// Without a command, palpus simulates a hand with a spoon in a cup at 1 kHz
/// (`palpus run spoon-cup`).
#[derive(Debug, Parser)]
#[command(
    name = "palpus",
    version,
    max_term_width = 110,
    propagate_version = true,
    after_help = "Example:\n  palpus query spoon.obj cup.obj --poses poses.csv --out contacts.csv"
)]
pub(crate) struct Arguments {
    /// The command.
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
    /// Does not use the user's cache folder for prepared bodies.
    #[arg(long, global = true)]
    pub(crate) no_cache: bool,
    /// Prints only results and errors: no notes, no progress.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Also prints details of each step: models, their pieces, times, and whether they came from
    /// the cache.
    #[arg(short, long, global = true)]
    pub(crate) verbose: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Runs the closed loop of device, contacts and wrench a thousand times a second.
    Run(Box<RunArguments>),
    /// Computes distances and contacts of two models for a list of poses.
    Query(QueryArguments),
    /// Computes how deep two models of any shape overlap, with proven bounds: the shortest
    /// translation that separates them.
    Depth(DepthArguments),
    /// Computes the clearance of two models along a path, and finds the tightest places.
    Clearance(ClearanceArguments),
    /// Decomposes models into convex pieces, builds their hierarchies and caches both.
    Prepare(PrepareArguments),
    /// Reports the defects, mass properties and convex pieces of a model.
    Inspect(InspectArguments),
    /// Shows a model in a window or as a picture: its convex pieces, the Gauss map of a piece, or
    /// the felt depth.
    View(ViewArguments),
    /// Runs a recording again and compares every wrench bit for bit, or shows the recording.
    Replay(ReplayArguments),
    /// Converts a recording to CSV, Parquet or MCAP.
    Convert(ConvertArguments),
    /// Writes a built-in scene as files that you can edit: meshes, scene file, poses of the hand.
    Export(ExportArguments),
    /// Makes a self-contained HTML page of a recorded run, or of the reproduction of the paper.
    Report(ReportArguments),
    /// Lists the haptic devices that were found, and gives advice for the others.
    Devices(DevicesArguments),
    /// Measures whether this machine can hold 1 kHz, and gives advice.
    Doctor(DoctorArguments),
    /// Runs the loop in real time for a long time, with a hand that keeps moving, and reports
    /// lateness, faults and memory.
    Soak(SoakArguments),
    /// Measures the paper's table and figures, contact feel, and the time of an engine step.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Prints a completion script for a shell.
    #[command(after_help = "Example:\n  palpus completions bash > ~/.local/share/bash-completion/completions/palpus")]
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Prints the man page, or writes one for every command.
    #[command(after_help = "Examples:\n  palpus man | man -l -\n  palpus man --out ~/.local/share/man/man1")]
    Man(ManArguments),
}

impl Command {
    /// Returns the command that runs if the user names no command.
    pub(crate) fn demonstration() -> Self {
        Self::Run(Box::new(RunArguments { scene: "spoon-cup".into(), ..RunArguments::parse_from(["run"]) }))
    }
}

/// Folder for the man pages.
#[derive(Debug, clap::Args)]
pub(crate) struct ManArguments {
    /// A folder for the man pages of all commands.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<std::path::PathBuf>,
    /// Prints the help of all commands as one Markdown page instead: docs/command-line.md.
    #[arg(long, conflicts_with = "out")]
    pub(crate) markdown: bool,
}

/// Returns the program's commands, as a tree.
pub(crate) fn command_tree() -> clap::Command {
    let mut tree = Arguments::command();
    tree.build();
    tree
}

/// Prints the completions of `shell` on standard output.
pub(crate) fn completions(shell: clap_complete::Shell) {
    clap_complete::generate(shell, &mut Arguments::command(), "palpus", &mut std::io::stdout());
}

/// Returns which files a scene may name, depending on `--allow-outside`.
pub(crate) fn file_policy(allow_outside: bool) -> FilePolicy {
    if allow_outside { FilePolicy::Anywhere } else { FilePolicy::Inside }
}
