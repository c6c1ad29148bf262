//! Two hands in one scene: two devices in one loop, each with its own safety chain, recording and summary.
//!
//! 1. The scene's second tool becomes a stage of its own, and each tool with its device a [`Plan`], as for one hand.
//! 2. One servo thread turns both devices ([`Servo::run_both`]) around one engine ([`engine::TwoEngine`]).
//! 3. Each tool is recorded in a file of its own; the two name each other, and `palpus replay` of either runs both again ([`replay`]).

mod engine;
pub(crate) mod replay;

use std::cell::Cell;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use anyhow::bail;
use palpus_device::{DeviceState, RealTimeClaims, RunStatistics, Servo, ServoTick, StepOutcome, ToolOutcome, claim};
use serde::Serialize;

use self::engine::TwoEngine;
use crate::args::RunArguments;
use crate::engine::Detail;
use crate::files::beside;
use crate::recording::Recording;
use crate::run::{Beginning, Plan, beginning, has_failed, joined, tick_at};
use crate::stage::Stage;
use crate::summary::{Gatherer, Summary};
use crate::{output, picture, safety, summary};

/// What the two are called.
const NAMES: [&str; 2] = ["first", "second"];

/// The summaries of both; the first one's stands where that of a single tool does.
#[derive(Serialize)]
struct Both<'a> {
    #[serde(flatten)]
    first: &'a Summary,
    second: &'a Summary,
}

/// What a run of both leaves behind.
struct Turned {
    statistics: [RunStatistics; 2],
    gatherers: [Gatherer; 2],
    claims: Option<RealTimeClaims>,
    engine: TwoEngine,
}

/// The same, with what the loop's thread does not have.
struct Finished {
    turned: Turned,
    recordings: Vec<PathBuf>,
    stage: Stage,
}

/// The arguments that hold for the second hand.
fn second_arguments(arguments: &RunArguments) -> RunArguments {
    RunArguments {
        device: arguments.second_device.clone().unwrap_or_else(|| "sim".to_owned()),
        hand: arguments.second_hand.clone(),
        hand_path: None,
        fault: Vec::new(),
        ..arguments.clone()
    }
}

/// Runs `stage`, which has a second tool.
pub(crate) fn run(arguments: &RunArguments, stage: Stage, stop: &Arc<AtomicBool>) -> anyhow::Result<ExitCode> {
    let Some(second) = stage.of_second() else { bail!("{} has no second tool", arguments.scene) };
    if arguments.second_device.as_ref().is_some_and(|device| device != "sim" && *device == arguments.device) {
        bail!("both hands cannot hold the device `{}`; name another one with --second-device", arguments.device);
    }
    let other = second_arguments(arguments);
    let plans =
        [Plan::new(arguments, &arguments.scene, stage, false)?, Plan::new(&other, &arguments.scene, second, false)?];
    if arguments.limits {
        return plans
            .iter()
            .try_for_each(|plan| safety::print(plan.spec(), &plan.limits, arguments.json))
            .map(|()| ExitCode::SUCCESS);
    }
    let mut engine = TwoEngine::new([&plans[0].stage, &plans[1].stage], [plans[0].settings, plans[1].settings])?;
    let rate_hz = plans[0].rate_hz;
    let seconds = plans[0].options.duration.unwrap_or_default();
    if let Some(at) = arguments.at {
        engine.keep(tick_at(at, seconds, rate_hz)?);
    }
    if !arguments.json {
        for (plan, (name, arguments)) in plans.iter().zip(NAMES.into_iter().zip([arguments, &other])) {
            output::note(format!("the {name} hand:"));
            plan.announce(arguments, Some("two hands have no window yet"));
        }
    }
    let begin = beginning(arguments);
    let limits = plans.each_ref().map(|plan| plan.limits);
    let torque_max = plans[0].settings.limits.torque;
    let Finished { turned, recordings, stage } = turn(plans, engine, &begin, stop)?;
    let Turned { statistics, gatherers, claims, engine } = turned;
    let [first, second] = gatherers;
    let summaries = [
        first.finish(&statistics[0], &limits[0], claims.as_ref()),
        second.finish(&statistics[1], &limits[1], claims.as_ref()),
    ];
    report(arguments, &summaries, &recordings)?;
    if let Some(file) = &arguments.screenshot {
        let moment = engine.shown(1.0 / rate_hz);
        picture::write_run(&arguments.scene, &stage, torque_max, moment, file, &arguments.picture)?;
    }
    let any_failed = statistics.iter().any(|statistics| has_failed(&statistics.end));
    Ok(if any_failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Runs both devices on a thread of their own.
fn turn(
    plans: [Plan; 2],
    mut engine: TwoEngine,
    beginning: &Beginning<'_>,
    stop: &Arc<AtomicBool>,
) -> anyhow::Result<Finished> {
    let [first, second] = plans;
    let stage = first.stage;
    let mut servos = [Servo::new(first.options)?, Servo::new(second.options)?];
    let files = beginning.record.map(|path| [path.to_owned(), beside(path, NAMES[1])]);
    let (mut rows, mut writings) = ([None, None], Vec::new());
    if let Some(files) = &files {
        for (k, mut header) in [first.header, second.header].into_iter().enumerate() {
            replay::name_other(k, &files[1 - k], &mut header.scene.more);
            let recording = Recording::start(&files[k], &header)?;
            rows[k] = Some(recording.rows);
            writings.push(recording.writing);
        }
    }
    let mut gatherers = [Gatherer::new()?, Gatherer::new()?];
    let (mut device, mut other, script) = (first.device, second.device, first.script);
    let (claims, stopped) = (beginning.claims, Arc::clone(stop));
    let thread = std::thread::Builder::new().name("servo".to_owned()).spawn(move || {
        let mut observe = |which: usize, tick: &ServoTick, detail: &Detail| {
            gatherers[which].add(tick, detail);
            if let Some(rows) = &mut rows[which] {
                rows.row(tick, detail);
            }
        };
        let claims = claims.as_ref().map(claim);
        // What goes wrong in the step on purpose does so around that of the first tool.
        let aside = Cell::new(None);
        let mut scripted = script.step(|state: &DeviceState, dt| {
            let [first, second] = engine.step(&[*state, aside.take().unwrap_or(*state)], dt);
            let StepOutcome { wrench, saturated, detail } = first.outcome;
            StepOutcome { wrench, saturated, detail: (detail, first.received, second) }
        });
        let step = |states: &[DeviceState; 2], dt: f64| {
            aside.set(Some(states[1]));
            let StepOutcome { wrench, saturated, detail: (detail, received, second) } = scripted(&states[0], dt);
            [ToolOutcome { outcome: StepOutcome { wrench, saturated, detail }, received }, second]
        };
        let [one, two] = &mut servos;
        let statistics = one.run_both(two, [&mut device, &mut other], step, &mut observe, &stopped);
        drop(scripted);
        Turned { statistics, gatherers, claims, engine }
    })?;
    while !thread.is_finished() {
        std::thread::sleep(LOOK);
    }
    let turned = joined(thread.join())?;
    stop.store(true, Ordering::Relaxed);
    for writing in writings {
        writing.finish()?.iter().for_each(output::note);
    }
    Ok(Finished { turned, recordings: files.map(Vec::from).unwrap_or_default(), stage })
}

/// Between two looks whether the loop is over.
const LOOK: Duration = Duration::from_millis(20);

fn report(arguments: &RunArguments, summaries: &[Summary; 2], recordings: &[PathBuf]) -> anyhow::Result<()> {
    let [first, second] = summaries;
    if arguments.json {
        return output::json(&Both { first, second });
    }
    for (name, summary) in NAMES.iter().zip(summaries) {
        output::line(format!("{:>14}", format!("{name} hand")));
        summary::print(summary);
    }
    for file in recordings {
        output::line(format!("{:>14}  {}", "recorded", file.display()));
    }
    if let Some(file) = recordings.first() {
        output::line(format!("{:>14}  palpus replay {}", "again", file.display()));
    }
    Ok(())
}
