//! Arguments of what needs a scene: to run it, to write it as files.

use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum};
use palpus::render::Clustering;
use palpus_device::Rearm;
use palpus_io::scene::CouplingMode;

use super::{KeepArguments, PictureArguments};
use crate::durations::seconds;

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
    /// a program of your own by `bridge:/path/to.sock` or `bridge:udp:127.0.0.1:PORT` (docs/bridge.md); see `palpus devices`.
    /// Where a scene has several tools, once for each, in their order [default: sim].
    #[arg(long, value_name = "DEVICE")]
    pub(crate) device: Vec<String>,
    /// The simulated hand: relaxed, normal, firm, tight or none [default: the scene's, or normal]. Once for each tool, as --device.
    #[arg(long, value_name = "PRESET")]
    pub(crate) hand: Vec<String>,
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
    /// The device of the second hand, where the scene has a second tool: the same as a second --device.
    #[arg(long, value_name = "DEVICE")]
    pub(crate) second_device: Option<String>,
    /// The second simulated hand: the same as a second --hand.
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
    /// How long to run: 90s, 10m, 1h30m, or seconds [default: 10, or with a window until it is closed].
    #[arg(long, value_name = "TIME", value_parser = seconds)]
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
    /// What is kept.
    #[command(flatten)]
    pub(crate) keep: KeepArguments,
    /// Lets the scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Makes something go wrong, to see what the safety chain makes of it: a name and when, such as `pose-jump@1.5`.
    #[arg(long, value_name = "NAME@S")]
    pub(crate) fault: Vec<String>,
    /// Ends with success although there were faults or the loop did not hold its rate. Faults on purpose (--fault) are no failure anyway.
    #[arg(long)]
    pub(crate) lenient: bool,
    /// Ends the run at its first fault instead of engaging again.
    #[arg(long)]
    pub(crate) stop_on_fault: bool,
    /// Who gives the force back after three faults in ten seconds: a person (a button of the device, G in the window, or r and Enter in
    /// the terminal), or nobody has to, for tests.
    #[arg(long, value_enum, value_name = "WHO", default_value_t = Rearming::Person)]
    pub(crate) rearm: Rearming,
    /// Forces only while a button of the device, or G in the window, is held; so it is with any device that has buttons.
    #[arg(long)]
    pub(crate) dead_man: bool,
    /// The largest force, N, where the device gives more.
    #[arg(long, value_name = "N", value_parser = limit)]
    pub(crate) max_force: Option<f64>,
    /// The largest torque, N·m, where the device gives more.
    #[arg(long, value_name = "N·m", value_parser = limit)]
    pub(crate) max_torque: Option<f64>,
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

/// A limit that lowers what the device gives.
fn limit(text: &str) -> Result<f64, String> {
    let limit = text.parse().ok().filter(|limit: &f64| *limit > 0.0 && limit.is_finite());
    limit.ok_or_else(|| "a limit is a positive number, such as 2.5".to_owned())
}

/// Who gives the force back after three faults in ten seconds.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Rearming {
    /// A person.
    Person,
    /// The engagement, as after any other fault.
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
#[command(after_help = "Example:\n  palpus export spoon-cup mine && palpus run mine/scene.toml")]
pub(crate) struct ExportArguments {
    /// The scene; see `palpus run --list`.
    pub(crate) scene: String,
    /// The folder for tool.obj, part.obj, hand.csv and scene.toml, which may not be there yet.
    pub(crate) folder: PathBuf,
}
