//! `palpus doctor`: measures whether this machine can hold the loop, and gives advice.
//!
//! 1. The machine: cores, governor, limits, kernel ([`machine`]).
//! 2. A bare loop with absolute deadlines at 1 kHz and the real-time rights that `palpus run`
//!    requests: how late the system wakes it ([`timer`]).
//! 3. The scene's closed loop on the simulated device: how long a step takes ([`scene`]).
//! 4. The bare loop at other rates, which shows how fast the scene's loop could be ([`rates`]).
//! 5. The load by other programs during the measurement ([`load`]).
//! 6. A verdict, and advice for each problem ([`verdict`]).
//!
//! The exit status is 1 if the machine is not fast enough. No step needs root. Properties that
//! cannot be read are reported as unknown.

pub(crate) mod load;
mod machine;
mod rates;
mod scene;
pub(crate) mod timer;
mod verdict;

use std::process::ExitCode;

use anyhow::bail;
use palpus_device::{Claimed, RealTimeClaims};
use serde::Serialize;

use crate::args::DoctorArguments;
use crate::output;
use load::Load;
use machine::Machine;
use rates::Rate;
use scene::SceneTimes;
use timer::Timer;
use verdict::{Fitness, Verdict};

/// Rate of the measurement, Hz: the usual rate of haptic devices.
const RATE_HZ: f64 = 1000.0;
/// Longest measurement, s.
const LONGEST: f64 = 600.0;
/// The measurement at each rate is shorter by this factor, and has at least this length (s).
const RATE_SHARE: f64 = 5.0;
const SHORTEST_RATE: f64 = 0.3;
/// Shortest measurement, s. With fewer ticks the 99.9th percentile is not meaningful.
const SHORTEST: f64 = 0.5;

/// All results. The field names are the interface of `--json`.
#[derive(Debug, Serialize)]
struct Report {
    verdict: Verdict,
    timer: Timer,
    scene: SceneTimes,
    rates: Vec<Rate>,
    real_time: Vec<ClaimLine>,
    machine: Machine,
    load: Option<Load>,
}

/// Outcome of a request for a real-time right.
#[derive(Clone, Debug, Serialize)]
struct ClaimLine {
    name: &'static str,
    granted: bool,
    what: String,
    mend: Option<String>,
}

pub(crate) fn doctor(arguments: &DoctorArguments) -> anyhow::Result<ExitCode> {
    if !(SHORTEST..=LONGEST).contains(&arguments.duration) {
        bail!("--duration must be from {SHORTEST} to {LONGEST} seconds, but is {}", arguments.duration);
    }
    let machine = Machine::look();
    let stage = scene::prepare(&arguments.scene)?;
    if !arguments.json {
        let seconds = arguments.duration;
        output::note(format!(
            "{seconds:.0} s of a bare timer, {seconds:.0} s of {}, then the timer at other rates; use the machine as usual meanwhile",
            arguments.scene
        ));
    }
    let before = load::Snapshot::take();
    let (timer, claims) = timer::measure(arguments.duration, RATE_HZ)?;
    let mut scene = scene::measure(&arguments.scene, &stage, arguments.duration)?;
    let rates = rates::measure((arguments.duration / RATE_SHARE).max(SHORTEST_RATE), &scene)?;
    scene.achievable_hz = rates::fastest(&rates);
    let load = load::between(before, load::Snapshot::take());
    let real_time = claims.as_ref().map_or(Vec::new(), claim_lines);
    let verdict = verdict::of(&timer, &scene, &real_time, &machine, load.as_ref());
    let report = Report { verdict, timer, scene, rates, real_time, machine, load };
    if arguments.json {
        output::json(&report)?;
    } else {
        print(&report);
    }
    let unfit = report.verdict.fitness == Fitness::NotFit;
    Ok(if unfit { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn claim_lines(claims: &RealTimeClaims) -> Vec<ClaimLine> {
    let line = |(name, claimed): (&'static str, &Claimed)| match claimed {
        Claimed::Granted(what) => ClaimLine { name, granted: true, what: what.clone(), mend: None },
        Claimed::Refused { why, mend } => {
            ClaimLine { name, granted: false, what: format!("no: {why}"), mend: Some(mend.clone()) }
        }
        Claimed::NotAsked => ClaimLine { name, granted: false, what: "not asked for".to_owned(), mend: None },
    };
    claims.lines().into_iter().map(line).collect()
}

fn print(report: &Report) {
    let Report { verdict, timer, scene, rates, real_time, machine, load } = report;
    let show = |name: &str, value: String| output::line(format!("{name:>16}  {value}"));
    show("verdict", verdict.words.clone());
    for reason in &verdict.notes {
        show("", reason.what.clone());
    }
    output::line("");
    show("timer at 1 kHz", timer.in_words());
    show("scene", scene.in_words());
    for claim in real_time {
        show(claim.name, claim.what.clone());
    }
    for (name, value) in machine.lines() {
        show(name, value);
    }
    show("other load", load.as_ref().map_or("not known here".to_owned(), Load::in_words));
    output::line("");
    output::line(format!("Rates, with {}:", scene.name));
    for line in rates::table(rates) {
        output::line(line);
    }
    let mends = verdict.mends();
    if mends.is_empty() {
        return;
    }
    output::line("");
    output::line("What would help:");
    for mend in mends {
        output::line(format!("  - {mend}"));
    }
}
