//! Arguments of the commands that take a scene: `run` and `export`.

use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum};
use palpus::render::Clustering;
use palpus_device::Rearm;
use palpus_io::scene::CouplingMode;

use super::{KeepArguments, PictureArguments};
use crate::durations::seconds;

#[derive(Clone, Debug, Parser)]
#[command(
    after_help = "Examples:\n  palpus run                             a spoon in a cup\n  palpus run peg-hole --hand firm --json\n  palpus run tool.stl part.obj            two meshes of your own\n  palpus run my-scene.toml --record run.csv\n  palpus run intestine --fast --duration 60\n  palpus run peg-hole --screenshot peg.png --at 2.5"
)]
pub(crate) struct RunArguments {
    /// A built-in scene (see --list), a scene file (TOML, docs/scene-file.md), or the mesh of the
    /// probe (obj, stl, ply, off, gltf, glb).
    #[arg(default_value = "spoon-cup")]
    pub(crate) scene: String,
    /// The mesh that the probe touches, if the first argument is a mesh.
    pub(crate) environment: Option<String>,
    /// The unit of both meshes (mm, cm, m, inch, …), or given twice, of each mesh [default: likely
    /// units for their sizes].
    #[arg(long, value_name = "UNIT", requires = "environment")]
    pub(crate) unit: Vec<String>,
    /// Lists the built-in scenes.
    #[arg(long)]
    pub(crate) list: bool,
    /// The device: `sim` (simulated device and hand), `replay:FILE` (the hand of a recording),
    /// `haply` (or `haply:ws://HOST:PORT`), `spacemouse` (or `spacemouse:/dev/hidrawN`),
    /// `force-dimension` or `openhaptics` (or with `:LIBRARY`, the path of the maker's library), or
    /// `bridge:/path/to.sock` or `bridge:udp:127.0.0.1:PORT` for a driver of your own
    /// (docs/bridge.md). If there are several devices of a kind, name one: `haply#ARM`,
    /// `force-dimension#2`, `openhaptics#NAME`. If the scene has several tools, give the option
    /// once for each tool, in their order. See `palpus devices` [default: sim].
    #[arg(long, value_name = "DEVICE")]
    pub(crate) device: Vec<String>,
    /// The simulated hand: relaxed, normal, firm, tight or none; once for each tool, like --device
    /// [default: the scene's, or normal].
    #[arg(long, value_name = "PRESET")]
    pub(crate) hand: Vec<String>,
    /// A file that the simulated hand follows: poses half a second apart (CSV), or a recorded hand
    /// with times (CSV with a time column, or TUM's `timestamp tx ty tz qx qy qz qw`), which is
    /// moved to the start of the scene.
    #[arg(long, value_name = "FILE")]
    pub(crate) hand_path: Option<PathBuf>,
    /// Scales the translations of a recorded hand.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "hand_path", value_parser = factor)]
    pub(crate) hand_scale: f64,
    /// Speed of the recorded hand, as a factor.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, requires = "hand_path", value_parser = factor)]
    pub(crate) hand_speed: f64,
    /// The device of the second tool, if the scene has one: the same as a second --device.
    #[arg(long, value_name = "DEVICE")]
    pub(crate) second_device: Option<String>,
    /// The second simulated hand: the same as a second --hand.
    #[arg(long, value_name = "PRESET")]
    pub(crate) second_hand: Option<String>,
    /// Connects the tool to the hand by a virtual coupling, or lets the device move the tool
    /// directly as in the paper [default: the scene's, or coupled].
    #[arg(long, value_enum, value_name = "MODE")]
    pub(crate) rendering: Option<Rendering>,
    /// How contacts share stiffness: smoothly by direction, or in linked clusters as in the paper
    /// [default: the scene's, or smooth].
    #[arg(long, value_enum, value_name = "METHOD")]
    pub(crate) clustering: Option<ClusteringMethod>,
    /// Damps as soon as the loop has generated any energy. By default, damping begins when this
    /// energy exceeds the peak force times half a millimetre.
    #[arg(long)]
    pub(crate) passive: bool,
    /// Opens no window. This is the default without a display, and with --fast, --json or
    /// --screenshot.
    #[arg(long)]
    pub(crate) headless: bool,
    /// Runs in simulated time, as fast as possible, instead of real time.
    #[arg(long)]
    pub(crate) fast: bool,
    /// How long to run: 90s, 10m, 1h30m, or seconds [default: 10; with a window, until it is
    /// closed].
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    pub(crate) duration: Option<f64>,
    /// Ticks per second [default: the scene's, or 1000].
    #[arg(long, value_name = "HZ")]
    pub(crate) rate: Option<f64>,
    /// The file of the recording; its ending chooses the format: .csv, .parquet (data frames) or
    /// .mcap (robotics tools).
    #[arg(long, default_value = "palpus-out/run.csv", value_name = "FILE")]
    pub(crate) record: PathBuf,
    /// Writes no recording and no plot.
    #[arg(long)]
    pub(crate) no_record: bool,
    /// Recording and fault log.
    #[command(flatten)]
    pub(crate) keep: KeepArguments,
    /// Lets the scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Injects a fault to test the safety chain: its name and time, such as `pose-jump@1.5`.
    #[arg(long, value_name = "NAME@S")]
    pub(crate) fault: Vec<String>,
    /// Exits with success even if there were faults or the loop did not hold its rate. Faults
    /// injected by --fault never count.
    #[arg(long)]
    pub(crate) lenient: bool,
    /// Ends the run at the first fault instead of engaging again.
    #[arg(long)]
    pub(crate) stop_on_fault: bool,
    /// Selects who enables the force again after three faults in ten seconds: a person (a button of
    /// the device, G in the window, or r and Enter in the terminal), or the program itself, for
    /// tests.
    #[arg(long, value_enum, value_name = "WHO", default_value_t = Rearming::Person)]
    pub(crate) rearm: Rearming,
    /// If the probe starts inside the part, the device leads the probe out gently before contacts
    /// are rendered. The simulated hand follows.
    #[arg(long)]
    pub(crate) lead_out: bool,
    /// Gives force only while a button of the device, or G in the window, is held. Always on for
    /// devices with buttons.
    #[arg(long)]
    pub(crate) dead_man: bool,
    /// Lowers the device's largest force to this value, N.
    #[arg(long, value_name = "N", value_parser = limit)]
    pub(crate) max_force: Option<f64>,
    /// Lowers the device's largest torque to this value, N·m.
    #[arg(long, value_name = "N·m", value_parser = limit)]
    pub(crate) max_torque: Option<f64>,
    /// Prints the safety thresholds for the device, with their reasons.
    #[arg(long)]
    pub(crate) limits: bool,
    /// Does not ask the system for real-time priority, locked memory, large pages or a core of its
    /// own.
    #[arg(long)]
    pub(crate) no_realtime: bool,
    /// Writes a picture (PNG) of the last tick, or of the tick at --at; needs no display.
    #[arg(long, value_name = "FILE")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Time of the picture, s.
    #[arg(long, value_name = "S", requires = "screenshot")]
    pub(crate) at: Option<f64>,
    /// Look of the picture.
    #[command(flatten)]
    pub(crate) picture: PictureArguments,
    /// Prints the summary as one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Reads a factor.
fn factor(text: &str) -> Result<f64, String> {
    let factor = text.parse().ok().filter(|factor| (1e-3..=1e3).contains(factor));
    factor.ok_or_else(|| "a factor is a number from 0.001 to 1000".to_owned())
}

/// Reads a limit of force or torque.
fn limit(text: &str) -> Result<f64, String> {
    let limit = text.parse().ok().filter(|limit: &f64| *limit > 0.0 && limit.is_finite());
    limit.ok_or_else(|| "a limit is a positive number, such as 2.5".to_owned())
}

/// Decides who enables the force after three faults in ten seconds.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Rearming {
    /// A person.
    Person,
    /// The program, as after any other fault.
    Auto,
}

impl From<Rearming> for Rearm {
    fn from(rearming: Rearming) -> Self {
        match rearming {
            Rearming::Person => Self::ByPerson,
            Rearming::Auto => Self::Automatic,
        }
    }
}

/// How the tool follows the device.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Rendering {
    /// Through a virtual coupling.
    Coupled,
    /// The device moves the tool directly.
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

/// How contacts share stiffness.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum ClusteringMethod {
    /// Exact single linkage.
    Linkage,
    /// Smooth load sharing by direction.
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
#[command(after_help = "Example:\n  palpus export spoon-cup mine && palpus run mine/scene.toml")]
pub(crate) struct ExportArguments {
    /// The scene; see `palpus run --list`.
    pub(crate) scene: String,
    /// The folder for tool.obj, part.obj, hand.csv and scene.toml. Existing files are not
    /// overwritten.
    pub(crate) folder: PathBuf,
}
