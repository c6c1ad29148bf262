//! Faults that a user injects to test the safety chain.

use std::time::Duration;

use anyhow::{Context, bail};
use glam::DVec3;
use palpus_device::{Fault, Script};

/// Names of the faults, and their meanings.
const FAULTS: [(&str, Fault); 17] = [
    ("non-finite-pose", Fault::NonFinitePose),
    ("non-finite-wrench", Fault::NonFiniteWrench),
    ("pose-jump", Fault::PoseJump(DVec3::new(0.0, 0.0, 0.05))),
    ("turn-jump", Fault::TurnJump(DVec3::new(0.5, 0.0, 0.0))),
    ("speed", Fault::Speed(5.0)),
    ("wrong-velocity", Fault::Velocity(DVec3::new(5.0, 0.0, 0.0), 1000)),
    ("withheld", Fault::Withheld(100)),
    ("frozen", Fault::Frozen(100)),
    ("clock-back", Fault::DeviceClock(-1.0)),
    ("clock-ahead", Fault::DeviceClock(1.0)),
    ("large-wrench", Fault::Wrench(1e3, 10.0)),
    ("large-torque", Fault::Wrench(0.1, 10.0)),
    ("late-read", Fault::LateRead(LATE)),
    ("late-step", Fault::LateStep(LATE)),
    ("late-steps", Fault::SlowSteps(1000, SLOW)),
    ("dropped", Fault::Dropped),
    ("panic", Fault::Panic),
];

/// A stall longer than the timeout of any device's watchdog.
const LATE: Duration = Duration::from_millis(100);
/// A delay of more than a period at 1 kHz, but below the timeout of every watchdog.
const SLOW: Duration = Duration::from_millis(3);

/// Parses texts such as `pose-jump@1.5`: the kind of fault, and its time in seconds. In simulated
/// time (`fast`) no tick is late.
pub(crate) fn script(words: &[String], rate_hz: f64, fast: bool) -> anyhow::Result<Script> {
    if let Some(word) = words.iter().find(|word| fast && word.starts_with("late-")) {
        bail!("in simulated time no tick is late, so `{word}` has no effect; leave out --fast");
    }
    let faults: Vec<(u64, Fault)> = words.iter().map(|word| fault(word, rate_hz)).collect::<Result<_, _>>()?;
    Ok(Script::new(&faults, None))
}

fn fault(word: &str, rate_hz: f64) -> anyhow::Result<(u64, Fault)> {
    let (name, seconds) = word
        .split_once('@')
        .with_context(|| format!("`{word}` is not a fault; write NAME@SECONDS, such as pose-jump@1.5"))?;
    let Some((_, fault)) = FAULTS.iter().find(|(known, _)| *known == name) else {
        let names: Vec<&str> = FAULTS.iter().map(|(known, _)| *known).collect();
        bail!("there is no fault `{name}`; faults are {}", names.join(", "));
    };
    let seconds: f64 = seconds
        .parse()
        .ok()
        .filter(|seconds| *seconds >= 0.0)
        .with_context(|| format!("`{seconds}` in `{word}` is not a number of seconds"))?;
    Ok(((seconds * rate_hz).round() as u64, *fault))
}
