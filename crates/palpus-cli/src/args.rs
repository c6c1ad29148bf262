//! What can be typed.

use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use palpus::render::Clustering;
use palpus_io::scene::CouplingMode;

use crate::soak::Span;

/// 6-degree-of-freedom haptic rendering between triangle meshes.
///
/// Without a command: a spoon in a cup, felt by a simulated hand at 1 kHz (`palpus run spoon-cup`).
#[derive(Debug, Parser)]
#[command(
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
    Run(RunArguments),
    /// Answers contacts of two models for a list of poses.
    Query(QueryArguments),
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
        Self::Run(RunArguments { scene: "spoon-cup".into(), ..RunArguments::parse_from(["run"]) })
    }
}

#[derive(Clone, Debug, Parser)]
#[command(
    after_help = "Examples:\n  palpus run                             a spoon in a cup for ten seconds\n  palpus run peg-hole --hand firm --json\n  palpus run my-scene.toml --record run.csv\n  palpus run intestine --fast --duration 60\n  palpus run peg-hole --screenshot peg.png --at 2.5"
)]
pub(crate) struct RunArguments {
    /// A built-in scene (see --list) or a scene file (TOML).
    #[arg(default_value = "spoon-cup")]
    pub(crate) scene: String,
    /// Names the built-in scenes and ends.
    #[arg(long)]
    pub(crate) list: bool,
    /// The device: `sim` (a simulated device in a simulated hand), `replay:FILE` (the hand of a recording), `haply` (or
    /// `haply:ws://HOST:PORT`), `spacemouse` (or `spacemouse:/dev/hidrawN`), `force-dimension` or `openhaptics` (or with
    /// `:LIBRARY`, the maker's library or a stand-in for it). Of several, one by `haply#ARM`, `force-dimension#2` or `openhaptics#NAME`;
    /// see `palpus devices`.
    #[arg(long, default_value = "sim", value_name = "DEVICE")]
    pub(crate) device: String,
    /// The simulated hand: relaxed, normal, firm, tight or none [default: the scene's, or normal].
    #[arg(long, value_name = "PRESET")]
    pub(crate) hand: Option<String>,
    /// A file that the simulated hand follows: poses (CSV, half a second apart) or a recorded hand at its own pace (CSV with a
    /// time, or TUM's `timestamp tx ty tz qx qy qz qw`), which begins where the scene does.
    #[arg(long, value_name = "FILE")]
    pub(crate) hand_path: Option<PathBuf>,
    /// Scales the way of a recorded hand.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "hand_path", value_parser = factor)]
    pub(crate) hand_scale: f64,
    /// So many times as fast.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "hand_path", value_parser = factor)]
    pub(crate) hand_speed: f64,
    /// The device of the second hand, where the scene has a second tool [default: sim].
    #[arg(long, value_name = "DEVICE")]
    pub(crate) second_device: Option<String>,
    /// The second simulated hand, as --hand.
    #[arg(long, value_name = "PRESET")]
    pub(crate) second_hand: Option<String>,
    /// How the hand meets the contacts: through a virtual coupling, or directly as in the paper [default: the scene's, or
    /// coupled].
    #[arg(long, value_enum, value_name = "MODE")]
    pub(crate) rendering: Option<Rendering>,
    /// How contacts near each other share their force: smoothly, or in linked clusters as in the paper [default: the
    /// scene's, or smooth].
    #[arg(long, value_enum, value_name = "METHOD")]
    pub(crate) clustering: Option<ClusteringMethod>,
    /// Takes back every bit of energy that the hand was given by the loop, instead of from half a millimetre at peak force on.
    #[arg(long)]
    pub(crate) passive: bool,
    /// Opens no window. There is none either without a display, and for --fast, --json and --screenshot.
    #[arg(long)]
    pub(crate) headless: bool,
    /// Simulated time, as fast as it goes, instead of real time.
    #[arg(long)]
    pub(crate) fast: bool,
    /// Seconds to run [default: 10, or with a window until it is closed].
    #[arg(long, value_name = "S")]
    pub(crate) duration: Option<f64>,
    /// Ticks per second [default: the scene's, or 1000].
    #[arg(long, value_name = "HZ")]
    pub(crate) rate: Option<f64>,
    /// Where the recording goes; its name chooses the format: .csv, .parquet (data frames) or .mcap (robotics tools).
    #[arg(long, default_value = "palpus-out/run.csv", value_name = "FILE")]
    pub(crate) record: PathBuf,
    /// Writes no recording and no plot.
    #[arg(long)]
    pub(crate) no_record: bool,
    /// Lets the scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Makes something go wrong, to see what the safety chain makes of it: a name and when, such as `pose-jump@1.5`.
    #[arg(long, value_name = "NAME@S")]
    pub(crate) fault: Vec<String>,
    /// Ends the run at its first fault instead of engaging again.
    #[arg(long)]
    pub(crate) stop_on_fault: bool,
    /// Prints the safety chain's thresholds for the device, with their reasons, and ends.
    #[arg(long)]
    pub(crate) limits: bool,
    /// Asks the system for neither real-time priority nor locked memory nor a core of its own.
    #[arg(long)]
    pub(crate) no_realtime: bool,
    /// Makes a picture (PNG) of the last tick, or of the one that --at names; needs no display.
    #[arg(long, value_name = "FILE")]
    pub(crate) screenshot: Option<PathBuf>,
    /// The seconds after which the picture is taken.
    #[arg(long, value_name = "S", requires = "screenshot")]
    pub(crate) at: Option<f64>,
    /// How the picture looks.
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    /// Prints the summary as one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

/// A factor that is one.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor| (1e-3..=1e3).contains(factor));
    factor.ok_or_else(|| "a factor is a number from 0.001 to 1000".to_owned())
}

/// How pictures look.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Pictures")]
pub(crate) struct PictureArguments {
    /// Width and height, pixels.
    #[arg(long, default_value = "1280x800", value_name = "WxH")]
    pub(crate) size: Size,
    /// From where.
    #[arg(long, value_enum, default_value_t = Direction::Oblique, value_name = "SIDE")]
    pub(crate) from: Direction,
    /// How much nearer than where everything is in the picture.
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR")]
    pub(crate) zoom: f64,
    /// Light on dark.
    #[arg(long)]
    pub(crate) dark: bool,
    /// Each convex piece in a colour of its own, also in pictures of runs.
    #[arg(long)]
    pub(crate) pieces: bool,
    /// One colour a body, and nothing to be seen through it.
    #[arg(long, conflicts_with = "pieces")]
    pub(crate) plain: bool,
    /// The sides of the triangles.
    #[arg(long)]
    pub(crate) wireframe: bool,
    /// Neither numbers nor legend.
    #[arg(long)]
    pub(crate) no_words: bool,
}

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Size(pub(crate) [usize; 2]);

impl std::str::FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|side| (MIN_SIDE..=MAX_SIDE).contains(side));
        let size = text.split_once('x').and_then(|(width, height)| Some(Self([side(width)?, side(height)?])));
        size.ok_or_else(|| format!("a size is two numbers from {MIN_SIDE} to {MAX_SIDE}, such as 1280x800"))
    }
}

/// Pixels: smaller pictures show nothing.
const MIN_SIDE: usize = 16;
/// Pixels: larger ones need more memory than most machines have.
const MAX_SIDE: usize = 8192;

/// From where a picture is taken.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Direction {
    /// From the front, the right and above.
    Oblique,
    /// Along +y.
    Front,
    /// Along −y.
    Back,
    /// Along +x.
    Left,
    /// Along −x.
    Right,
    /// Along −z.
    Top,
    /// Along +z.
    Bottom,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus view cup.obj                                    a window\n  palpus view cup.obj --screenshot cup.png\n  palpus view cup.obj --exploded --dark --screenshot pieces.png\n  palpus view cup.obj --gauss 3 --screenshot gauss.png\n  palpus view cup.obj --depth --axis z --offset 12.5 --screenshot depth.png\n\nDepth: at each point of the plane a probe as small as a point asks the query of the servo loop for its deepest contact. Beside it the distance to the mesh, and what is missing between the two."
)]
pub(crate) struct ViewArguments {
    /// The model.
    pub(crate) model: PathBuf,
    /// Where the picture goes (PNG); without, a window opens.
    #[arg(long, value_name = "FILE")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Shows the convex pieces apart, by this part of their distance from the middle.
    #[arg(long, value_name = "FACTOR", num_args = 0..=1, default_missing_value = "0.6")]
    pub(crate) exploded: Option<f64>,
    /// Shows a piece and its Gauss map: which directions it owns of the mesh, and which only its hull has. Pieces count from 0
    /// [default piece: the one with most faces].
    #[arg(long, value_name = "PIECE", num_args = 0..=1, conflicts_with_all = ["exploded", "depth"])]
    pub(crate) gauss: Option<Option<u32>>,
    /// Shows how deep the body is felt on a plane through it, beside the true depth where the mesh is closed.
    #[arg(long, conflicts_with = "exploded")]
    pub(crate) depth: bool,
    /// Across which axis of the model the plane lies.
    #[arg(long, value_enum, default_value_t = AxisName::Y, value_name = "AXIS")]
    pub(crate) axis: AxisName,
    /// Where on the axis, in model units [default: the middle of the model].
    #[arg(long, value_name = "OFFSET", allow_negative_numbers = true, requires = "depth")]
    pub(crate) offset: Option<f64>,
    /// Points along the plane's longer side at which the body is felt.
    #[arg(long, default_value_t = 320, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=4096), requires = "depth")]
    pub(crate) fineness: u32,
    /// How the picture looks.
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
}

/// An axis of a model.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum AxisName {
    /// The plane is seen along −x.
    X,
    /// The plane is seen along +y.
    Y,
    /// The plane is seen along −z.
    Z,
}

/// How the hand meets the contacts.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Rendering {
    /// Through a virtual coupling.
    Coupled,
    /// The probe is where the device is.
    Direct,
}

impl From<Rendering> for CouplingMode {
    fn from(rendering: Rendering) -> Self {
        match rendering {
            Rendering::Coupled => Self::Coupled,
            Rendering::Direct => Self::Direct,
        }
    }
}

/// How contacts near each other share their force.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ClusteringMethod {
    /// Exact single linkage.
    Linkage,
    /// By density, without clusters.
    Smooth,
}

impl From<ClusteringMethod> for Clustering {
    fn from(method: ClusteringMethod) -> Self {
        match method {
            ClusteringMethod::Linkage => Self::Linkage,
            ClusteringMethod::Smooth => Self::Smooth,
        }
    }
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus doctor\n  palpus doctor --scene intestine --duration 30 --json\n\nMeasures a bare timer at 1 kHz and the scene's loop, each for the duration, and the timer at rates from 500 Hz to 10 kHz, a fifth of it each, with\nthe priority and memory that `palpus run` would ask for.\nExit status: 0 the machine is fit for 1 kHz, 1 it is not."
)]
pub(crate) struct DoctorArguments {
    /// The scene whose steps are timed: a built-in one (`palpus run --list`) or a scene file (TOML).
    #[arg(long, default_value = "spoon-cup", value_name = "NAME")]
    pub(crate) scene: String,
    /// Seconds for each of the two measurements.
    #[arg(long, default_value_t = 5.0, value_name = "S")]
    pub(crate) duration: f64,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  palpus query spoon.obj cup.obj --poses poses.csv --out result.csv --tolerance 0.01\n\nPOSES has the columns tx,ty,tz,qx,qy,qz,qw: A placed in B's frame, in model units. The result has one row a pose, in B's frame; separation is the nearest distance, or minus the depth of the deepest contact; point_a - point_b = separation * normal.\nColumn certified: the distance, or the depth of every overlapping pair of convex pieces, is proven the least there is."
)]
pub(crate) struct QueryArguments {
    /// The model of body A (obj, stl, ply, off, gltf, glb).
    pub(crate) a: PathBuf,
    /// The model of body B.
    pub(crate) b: PathBuf,
    /// Poses of A in B's frame (CSV).
    #[arg(long, value_name = "F.csv")]
    pub(crate) poses: PathBuf,
    /// Where the results go (CSV).
    #[arg(long, value_name = "R.csv")]
    pub(crate) out: PathBuf,
    /// Contacts are pairs of pieces nearer than this, in model units [default: 1 % of the smaller model's diagonal].
    #[arg(long, value_name = "T")]
    pub(crate) tolerance: Option<f64>,
    /// Where every single contact goes (CSV).
    #[arg(long, value_name = "C.csv")]
    pub(crate) contacts: Option<PathBuf>,
    /// The haptic walk alone, without proof that a depth is globally the least; column certified is then false in overlap.
    #[arg(long)]
    pub(crate) local: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  palpus prepare cup.obj --pieces cup_pieces.obj")]
pub(crate) struct PrepareArguments {
    /// The models.
    #[arg(required = true)]
    pub(crate) models: Vec<PathBuf>,
    /// Where every convex piece goes, as a group of an OBJ file (one model only).
    #[arg(long, value_name = "OUT.obj")]
    pub(crate) pieces: Option<PathBuf>,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus inspect cup.obj --json\n  palpus inspect cup.obj --sweeps\n  palpus inspect cup.obj --picture cup.png"
)]
pub(crate) struct InspectArguments {
    /// The model.
    pub(crate) model: PathBuf,
    /// Sweeps a closed model with small probes as well: how deep it can be felt, and how truly.
    #[arg(long)]
    pub(crate) sweeps: bool,
    /// Probes of each sweep.
    #[arg(long, default_value_t = 1000, value_name = "N", requires = "sweeps")]
    pub(crate) samples: usize,
    /// Makes a picture (PNG) of the model, its convex pieces in colours.
    #[arg(long, value_name = "FILE")]
    pub(crate) picture: Option<PathBuf>,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

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
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  palpus export spoon-cup mine && palpus run mine/scene.toml")]
pub(crate) struct ExportArguments {
    /// The scene; see `palpus run --list`.
    pub(crate) scene: String,
    /// The folder for tool.obj, part.obj, hand.csv and scene.toml, which may not be there yet.
    pub(crate) folder: PathBuf,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus soak --duration 10m\n  palpus soak my-scene.toml --duration 1h --hand firm\n  palpus soak --models models --duration 1h     the paper's armadillo and intestine, out of a folder\n\nThe report (soak.json, soak.md, soak.html, plots) is written anew every minute. Ctrl-C ends the run with its report.\nExit status: 0 the loop held, 1 it did not: a fault, an allocation in the loop, more than 0.1 % of ticks late by over 0.5 ms\nand more than of the bare timer."
)]
pub(crate) struct SoakArguments {
    /// A built-in scene (`palpus run --list`) or a scene file (TOML).
    #[arg(default_value = "intestine")]
    pub(crate) scene: String,
    /// How long: 90s, 10m, 1h, 1h30m.
    #[arg(long, default_value = "10m", value_name = "TIME")]
    pub(crate) duration: Span,
    /// How long the bare timer is measured before and after; 0 leaves it out.
    #[arg(long, default_value = "20s", value_name = "TIME")]
    pub(crate) timer: Span,
    /// What the hand's way is drawn from.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// The simulated hand: relaxed, normal, firm or tight [default: the scene's, or normal].
    #[arg(long, value_name = "PRESET")]
    pub(crate) hand: Option<String>,
    /// Ticks per second [default: the scene's, or 1000].
    #[arg(long, value_name = "HZ")]
    pub(crate) rate: Option<f64>,
    /// A folder with armadillo_31240.obj and intestine_colon_male_24846.obj, which are then the scene; its file is left in --out.
    #[arg(long, value_name = "DIR", conflicts_with = "scene")]
    pub(crate) models: Option<PathBuf>,
    /// Lets the scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Where the report goes.
    #[arg(long, default_value = "palpus-out/soak", value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Records every tick as well, for `palpus replay`; by the end of the name CSV, Parquet or MCAP. An hour of CSV is about two gigabytes.
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Asks the system for neither real-time priority nor locked memory nor a core of its own.
    #[arg(long)]
    pub(crate) no_realtime: bool,
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
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

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  palpus devices\n  palpus devices --json | jq .missing")]
pub(crate) struct DevicesArguments {
    /// Prints one JSON document and nothing else.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    /// Writes the paper's Table 1 and Figures 4, 5 and 6, measured here, as PNG, SVG, CSV, text and JSON.
    #[command(after_help = "Example:\n  palpus bench figures --out figures")]
    Figures {
        /// Where the files go.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/figures")]
        out: PathBuf,
        /// A folder with other meshes at the paper's triangle counts, set beside the scenes' own in Table 1.
        #[arg(long, value_name = "DIR")]
        models: Option<PathBuf>,
    },
    /// Writes the plots of docs/penetration-depth.md, as SVG.
    #[command(after_help = "Example:\n  palpus bench depth --out plots")]
    Depth {
        /// Where the files go.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/depth")]
        out: PathBuf,
    },
    /// Measures what contact feels like: steps of force and torque, truth, energy, stability; every method on every scene in every hand.
    #[command(
        after_help = "Examples:\n  palpus bench feel --out feel\n  palpus bench feel --scene v-groove --method smooth --quick\n\nWrites feel.md, feel.html (with plots), feel.csv and feel.json. The same numbers come out of every run."
    )]
    Feel {
        /// Where the files go.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/feel")]
        out: PathBuf,
        /// Only this scene.
        #[arg(long, value_name = "NAME")]
        scene: Option<String>,
        /// Only this method.
        #[arg(long, value_name = "NAME")]
        method: Option<String>,
        /// Parts of the scripts, one hand, a coarse search: half a minute.
        #[arg(long)]
        quick: bool,
    },
    /// Times the engine step against the number of triangles and of contacts, and on real pairs; plots, CSV, JSON and text.
    #[command(
        after_help = "Example:\n  palpus bench scale --models models --out scale\n\nbenches/peers/coal_scale.py runs this and sets Coal's tolerance query on the same poses beside it."
    )]
    Scale {
        /// Where the files go.
        #[arg(long, value_name = "DIR", default_value = "palpus-out/scale")]
        out: PathBuf,
        /// A folder with the real meshes of the pairs; pairs whose meshes are not there are left out.
        #[arg(long, value_name = "DIR")]
        models: Option<PathBuf>,
        /// Ticks of contact per pair.
        #[arg(long, value_name = "N", default_value_t = 20_000)]
        ticks: usize,
        /// Of each tick the least time of so many passes is kept: what differs is what the operating system did meanwhile.
        #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
        passes: u32,
        /// Only the pair of this name, or `triangles` or `contacts` for one of the two sweeps.
        #[arg(long, value_name = "NAME")]
        only: Option<String>,
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
        /// Where the times go (CSV).
        #[arg(long, value_name = "R.csv")]
        out: PathBuf,
        /// Contacts are pairs of pieces nearer than this, in model units [default: 1 % of the smaller model's diagonal].
        #[arg(long, value_name = "T")]
        tolerance: Option<f64>,
    },
}

/// Prints the completions of `shell` on standard output.
pub(crate) fn completions(shell: clap_complete::Shell) {
    clap_complete::generate(shell, &mut Arguments::command(), "palpus", &mut std::io::stdout());
}

impl Default for PictureArguments {
    /// As when nothing is said.
    fn default() -> Self {
        let size = Size([1280, 800]);
        let from = Direction::Oblique;
        Self { size, from, zoom: 1.0, dark: false, pieces: false, plain: false, wireframe: false, no_words: false }
    }
}
