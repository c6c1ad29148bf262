//! Two hands in one scene: two devices in one loop, each with its own safety chain, recording and summary.
//!
//! 1. The scene's second tool becomes a stage of its own, and each tool with its device a plan, as for one hand ([`crate::run`]).
//! 2. One servo thread turns both devices ([`palpus_device::Servo::run_both`]) around one engine ([`TwoEngine`]).
//! 3. Each tool is recorded in a file of its own; the two name each other, and `palpus replay` of either runs both again ([`replay`]).

mod engine;
pub(crate) mod other;
pub(crate) mod replay;

use anyhow::bail;

pub(crate) use self::engine::TwoEngine;
use crate::args::RunArguments;

/// What the two are called.
pub(crate) const NAMES: [&str; 2] = ["first", "second"];

/// The arguments that hold for the second hand.
pub(crate) fn second_arguments(arguments: &RunArguments) -> anyhow::Result<RunArguments> {
    if arguments.second_device.as_ref().is_some_and(|device| device != "sim" && *device == arguments.device) {
        bail!("both hands cannot hold the device `{}`; name another one with --second-device", arguments.device);
    }
    Ok(RunArguments {
        device: arguments.second_device.clone().unwrap_or_else(|| "sim".to_owned()),
        hand: arguments.second_hand.clone(),
        hand_path: None,
        fault: Vec::new(),
        ..arguments.clone()
    })
}
