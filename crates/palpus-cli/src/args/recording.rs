//! Arguments of what is done with recordings.

use std::path::PathBuf;

use clap::Args;

use super::PictureArguments;

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus run spoon-cup --record run.csv && palpus replay run.csv\n  palpus replay run.csv --view\n  palpus replay run.csv --screenshot touch.png --at 2.5"
)]
pub(crate) struct ReplayArguments {
    /// The recording, of any format, whatever its name.
    pub(crate) recording: PathBuf,
    /// Shows it in a window: bodies, contacts and forces at every tick, curves of the whole run to go to and fro in.
    #[arg(long, group = "shown", conflicts_with = "json")]
    pub(crate) view: bool,
    /// Makes a picture (PNG) of the last tick, or of the one that --at names; needs no display.
    #[arg(long, value_name = "FILE", group = "shown", conflicts_with = "json")]
    pub(crate) screenshot: Option<PathBuf>,
    /// The seconds at which the picture is taken, or the window begins.
    #[arg(long, value_name = "S", requires = "shown")]
    pub(crate) at: Option<f64>,
    /// A folder in which the recorded meshes are looked for, under any name, when they are not where they were. May be given
    /// several times.
    #[arg(long, value_name = "DIR")]
    pub(crate) meshes: Vec<PathBuf>,
    /// Lets the recorded scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
    /// How the picture looks.
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus convert run.csv run.parquet\n  palpus convert run.parquet run.mcap\n\nNothing is lost on the way: each can be replayed bit for bit. What the formats hold is in docs/recordings.md."
)]
pub(crate) struct ConvertArguments {
    /// The recording, of any format, whatever its name.
    pub(crate) recording: PathBuf,
    /// Where it goes: a name that ends in .csv, .parquet or .mcap.
    pub(crate) out: PathBuf,
    /// Writes over a file of that name.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus run peg-hole --record peg.csv && palpus report peg.csv\n  palpus report palpus-out\n  palpus report --reproduce                    everything, under 20 minutes on two quiet cores\n  palpus report docs/report --reproduce --models ../models\n\nThe peers of the reproduction are Python's: pip install numpy coal mujoco. What is not here is said to be missing, and figures from the\ndocuments stand in its place, marked as such."
)]
pub(crate) struct ReportArguments {
    /// A recording, or a folder with recordings or with a reproduction [default: palpus-out; with --reproduce: palpus-out/report].
    #[arg(value_name = "PATH")]
    pub(crate) path: Option<PathBuf>,
    /// Where the page goes [default: beside the recording, ending in .html; report.html in the folder of a reproduction].
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Lets the recorded scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Measures the paper's table and figures, and all that goes beyond it, and makes a page of that.
    #[arg(long)]
    pub(crate) reproduce: bool,
    /// In two minutes: fewer ticks, fewer hands, no peers that have to be built.
    #[arg(long, requires = "reproduce")]
    pub(crate) quick: bool,
    /// A folder with real meshes for Table 1 and for the pairs beside Coal.
    #[arg(long, value_name = "DIR", requires = "reproduce")]
    pub(crate) models: Option<PathBuf>,
    /// Only this step, as the page calls it; what others measured before stays. May be given several times.
    #[arg(long, value_name = "STEP", requires = "reproduce")]
    pub(crate) only: Vec<String>,
}
