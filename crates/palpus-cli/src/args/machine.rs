//! Arguments of `doctor`, `soak` and `devices`.

use std::path::PathBuf;

use clap::Args;

use crate::durations::{Span, seconds};

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus doctor\n  palpus doctor --scene intestine --duration 30 --json\n\nMeasures a bare timer at 1 kHz and the scene's loop, each for the duration, and then the timer at rates from 500 Hz to 10 kHz, each for a fifth of\nthe duration. It asks for the same priority and memory as `palpus run`.\nExit status: 0 if the machine holds 1 kHz, 1 if not."
)]
pub(crate) struct DoctorArguments {
    /// The scene whose steps are timed: a built-in scene (`palpus run --list`) or a scene file
    /// (TOML).
    #[arg(long, default_value = "spoon-cup", value_name = "NAME")]
    pub(crate) scene: String,
    /// How long each of the two measurements takes: 30s, 2m, or seconds.
    #[arg(long, default_value = "5s", value_name = "TIME", value_parser = seconds)]
    pub(crate) duration: f64,
    /// Prints one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus soak --duration 10m\n  palpus soak my-scene.toml --duration 1h --hand firm\n  palpus soak --models models --duration 1h     the paper's armadillo and intestine\n\nThe report (soak.json, soak.md, soak.html, plots) is rewritten every minute. Ctrl-C ends the run with its report.\nExit status: 0 if the loop held its rate; 1 after a fault, after an allocation in the loop, or if more than 0.1 % of the ticks were late by more\nthan 0.5 ms and this share is larger than that share for the bare timer."
)]
pub(crate) struct SoakArguments {
    /// A built-in scene (`palpus run --list`) or a scene file (TOML).
    #[arg(default_value = "intestine")]
    pub(crate) scene: String,
    /// Duration of the run: 90s, 10m, 1h, 1h30m.
    #[arg(long, default_value = "10m", value_name = "TIME")]
    pub(crate) duration: Span,
    /// How long the bare timer is measured before and after the run; 0 skips this.
    #[arg(long, default_value = "20s", value_name = "TIME")]
    pub(crate) timer: Span,
    /// Seed of the motion of the hand.
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// The simulated hand: relaxed, normal, firm or tight [default: the scene's, or normal].
    #[arg(long, value_name = "PRESET")]
    pub(crate) hand: Option<String>,
    /// Ticks per second [default: the scene's, or 1000].
    #[arg(long, value_name = "HZ")]
    pub(crate) rate: Option<f64>,
    /// A folder with armadillo_31240.obj and intestine_colon_male_24846.obj, which are used as the
    /// scene; the scene file is written to --out.
    #[arg(long, value_name = "DIR", conflicts_with = "scene")]
    pub(crate) models: Option<PathBuf>,
    /// Lets the scene file name meshes outside its own folder.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// The folder of the report.
    #[arg(long, default_value = "palpus-out/soak", value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Also records every tick, for `palpus replay`; the ending chooses CSV, Parquet or MCAP. An
    /// hour of CSV is about two gigabytes.
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Does not ask the system for real-time priority, locked memory, large pages or a core of its
    /// own.
    #[arg(long)]
    pub(crate) no_realtime: bool,
    /// Prints one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  palpus devices\n  palpus devices --json | jq .missing\n  palpus devices --conformance /tmp/palpus.sock     test a driver of your own\n\nExit status with --conformance: 0 if the driver passed, 1 if it did not or nothing listens at the address."
)]
pub(crate) struct DevicesArguments {
    /// Tests a driver for the bridge (docs/bridge.md) that listens at the path of a socket or at
    /// udp:127.0.0.1:PORT, in about five seconds. Hold the device: it is driven with up to 0.5 N.
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) conformance: Option<String>,
    /// Prints one JSON document.
    #[arg(long)]
    pub(crate) json: bool,
}
