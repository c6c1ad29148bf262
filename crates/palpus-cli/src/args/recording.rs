//! Arguments of the commands that take recordings.

use std::path::PathBuf;

use clap::Args;

use super::PictureArguments;

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus run spoon-cup --record run.csv && palpus replay run.csv\n  palpus replay run.csv --view\n  palpus replay run.csv --screenshot touch.png --at 2.5"
)]
pub(crate) struct ReplayArguments {
    /// The recording; its content decides the format.
    pub(crate) recording: PathBuf,
    /// Shows the recording in a window: bodies, contacts and forces at every tick, and curves of
    /// the whole run.
    #[arg(long, group = "shown", conflicts_with = "json")]
    pub(crate) view: bool,
    /// Writes a picture (PNG) of the last tick, or of the tick at --at; needs no display.
    #[arg(long, value_name = "FILE", group = "shown", conflicts_with = "json")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Time of the picture, or time at which the window starts, s.
    #[arg(long, value_name = "S", requires = "shown")]
    pub(crate) at: Option<f64>,
    /// A folder to search for the recorded meshes, under any name, if they have moved. May be given
    /// several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) meshes: Vec<PathBuf>,
    /// Lets the recorded scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Prints one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
    /// Look of the picture.
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus convert run.csv run.parquet\n  palpus convert run.parquet run.mcap\n  palpus convert run.mcap - | head\n\nThe conversion loses nothing: each file can be replayed bit for bit. docs/recordings.md describes the formats."
)]
pub(crate) struct ConvertArguments {
    /// The recording; its content decides the format. `-` reads standard input.
    pub(crate) recording: PathBuf,
    /// The new file; its name ends in .csv, .parquet or .mcap. `-` writes CSV to standard output.
    pub(crate) out: PathBuf,
    /// Overwrites a file of that name.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus run peg-hole --record peg.csv && palpus report peg.csv\n  palpus report palpus-out\n  palpus report --reproduce                    everything, under 20 minutes on two quiet cores\n  palpus report docs/report --reproduce --models ../models\n\nThe comparison with other libraries needs Python: pip install numpy coal mujoco. Without them the page names what is missing and shows\nfigures of an earlier run, marked as such."
)]
pub(crate) struct ReportArguments {
    /// A recording, or a folder with recordings or with a reproduction [default: palpus-out; with
    /// --reproduce: palpus-out/report].
    #[arg(value_name = "PATH")]
    pub(crate) path: Option<PathBuf>,
    /// The file of the page [default: beside the recording, ending in .html; report.html in the
    /// folder of a reproduction].
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Lets the recorded scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Measures the paper's table and figures and all other benchmarks, and makes a page of them.
    #[arg(long)]
    pub(crate) reproduce: bool,
    /// Measures less, in two minutes: fewer ticks, fewer hands, and no steps that build programs.
    #[arg(long, requires = "reproduce")]
    pub(crate) quick: bool,
    /// A folder with real meshes for Table 1 and for the comparison with Coal.
    #[arg(long, value_name = "DIR", requires = "reproduce")]
    pub(crate) models: Option<PathBuf>,
    /// Measures only this step (by its name on the page) and keeps earlier measurements of the
    /// other steps. May be given several times.
    #[arg(long, value_name = "STEP", requires = "reproduce")]
    pub(crate) only: Vec<String>,
}
