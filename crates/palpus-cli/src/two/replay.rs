//! `palpus replay` of one of two recordings that belong together: both are run again, since each tool is what the other one felt.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, bail};
use palpus::algebra::{Twist, Wrench};
use palpus::render::Limits;
use palpus_device::{ContactAccount, Cut, DeviceState, SafetyChain};
use palpus_io::{Recording, read_recording};
use serde::Serialize;

use super::engine::TwoEngine;
use super::other::other_of;
use crate::divergence::{Comparison, Report};
use crate::rerun::one::{self, elapsed, has_stepped, state, told, work_allowed};
use crate::rerun::places::Places;
use crate::safety;
use crate::stage::{self, Stage};

/// What `--json` says of both; the named one's stands where that of a single tool does.
#[derive(Serialize)]
pub(crate) struct Reports<'a> {
    #[serde(flatten)]
    pub(crate) report: &'a Report,
    pub(crate) other_tool: &'a Report,
}

/// Runs both again; answers what came of the named one and of the other.
pub(crate) fn both(recording: &Recording, places: &Places<'_>) -> anyhow::Result<[Report; 2]> {
    let path = places.recording;
    let Some((which, _)) = other_of(recording) else { bail!("{} is of one tool alone", path.display()) };
    let other = read_other(path, recording)?;
    let recordings = in_order(which, recording, &other);
    let mut comparisons = recordings.map(Comparison::new);
    let (_, mut engine) = ready(recordings, places)?;
    run_again(recordings, &mut engine, &mut |which, k, wrench, contacts| {
        comparisons[which].add(k, wrench, contacts);
        ControlFlow::Continue(())
    })?;
    let [first, second] = comparisons.map(|comparison| comparison.report());
    Ok(if which == 0 { [first, second] } else { [second, first] })
}

/// The recording that belongs to `recording`, which was read from `path`.
pub(crate) fn read_other(path: &Path, recording: &Recording) -> anyhow::Result<Recording> {
    let Some((which, name)) = other_of(recording) else { bail!("{} is of one tool alone", path.display()) };
    // A name and no path: a recording from elsewhere must not make the program read other files.
    if Path::new(name).file_name().is_none_or(|file| file != name) || name.contains('\\') {
        bail!("{name:?} is no name of a file beside {}", path.display());
    }
    let beside = path.with_file_name(name);
    let other = read_recording(&beside).with_context(|| {
        format!("{} is the recording of one of two tools, and that of the other is needed", path.display())
    })?;
    if other_of(&other).map(|(which, _)| which) != Some(1 - which) {
        bail!("{} is not the recording of the other tool", beside.display());
    }
    Ok(other)
}

/// The first tool's recording first; `recording` is that of tool `which`.
pub(crate) fn in_order<'a>(which: usize, recording: &'a Recording, other: &'a Recording) -> [&'a Recording; 2] {
    if which == 0 { [recording, other] } else { [other, recording] }
}

/// The recorded scene, and the engine as it was when the recordings began.
pub(crate) fn ready(recordings: [&Recording; 2], places: &Places<'_>) -> anyhow::Result<(Stage, TwoEngine)> {
    let first = one::replayable(recordings[0], Some(recordings[1]), places)?;
    one::check_rows(recordings[1])?;
    let Some(second) = first.of_second() else { bail!("the recorded scene has no second tool any more") };
    stage::check_content(&second, &recordings[1].header.scene)?;
    let settings = recordings.map(|recording| recording.header.scene.render);
    let engine = TwoEngine::new([&first, &second], settings)?;
    let crease_angle = recordings.into_iter().find_map(one::crease_angle);
    let engine = match crease_angle {
        Some(angle) => engine.with_surfaces(angle),
        None => engine,
    };
    Ok((first, engine))
}

/// Runs both on an engine that is [`ready`] and tells `each` of every row: of which tool, which row, the wrench for its device, contacts; until that
/// breaks off.
pub(crate) fn run_again(
    recordings: [&Recording; 2],
    engine: &mut TwoEngine,
    each: &mut dyn FnMut(usize, usize, &Wrench, u32) -> ControlFlow<()>,
) -> anyhow::Result<()> {
    let mut chains = chains(recordings)?;
    let mut contact = ContactAccount::new([chains[0].limits(), chains[1].limits()]);
    let mut available = [Limits::UNLIMITED; 2];
    let mut states = recordings.map(|recording| state(&recording.rows[0]));
    let mut changes = recordings.map(|recording| recording.changes.iter().peekable());
    let ticks = recordings.map(|recording| recording.rows.len()).into_iter().max().unwrap_or_default();
    for k in 0..ticks {
        let rows = recordings.map(|recording| recording.rows.get(k));
        for (held, row) in states.iter_mut().zip(rows) {
            // A device that was lost stays where it was.
            *held = row.map_or(DeviceState { twist: Twist::default(), ..*held }, state);
        }
        for (which, changes) in changes.iter_mut().enumerate() {
            while let Some((tick, settings)) = changes.next_if(|(tick, _)| *tick <= k as u64) {
                let problem =
                    || format!("the {} tool's settings from tick {tick} on cannot be set", super::NAMES[which]);
                engine.set_settings(which, settings).with_context(problem)?;
            }
        }
        let Some(dt) = rows.iter().flatten().next().map(|row| row.dt) else { break };
        engine.set_available(&available);
        engine.allow(rows.iter().flatten().find_map(|row| work_allowed(row)));
        let outcomes = rows.iter().flatten().all(|row| has_stepped(row)).then(|| engine.step(&states, dt));
        let received =
            outcomes.as_ref().map_or([[0.0; 2]; 2], |outcomes| outcomes.each_ref().map(|tool| tool.received));
        let from_objects =
            outcomes.as_ref().map_or([[0.0; 2]; 2], |outcomes| outcomes.each_ref().map(|tool| tool.outcome.received));
        let received = contact.pass(received);
        if rows.iter().flatten().any(|row| told(row).has(Cut::Panic)) {
            engine.forget();
        }
        for which in 0..2 {
            let Some(row) = rows[which] else { continue };
            let told = told(row);
            let [between, own] = [received[which], from_objects[which]];
            chains[which].receive([between[0] + own[0], between[1] + own[1]]);
            let outcome = outcomes.as_ref().map(|outcomes| &outcomes[which].outcome);
            let computed = outcome.map_or(Wrench::ZERO, |outcome| outcome.wrench);
            let shaped = chains[which].shape(&states[which], &computed, told, elapsed(row));
            // Of a device that was lost in the tick, the brake had the last word.
            let lost = told.has(Cut::Device);
            available[which] = if lost { Limits::UNLIMITED } else { shaped.available };
            let wrench = if lost { Wrench::ZERO } else { shaped.wrench };
            if each(which, k, &wrench, outcome.map_or(row.contacts, |outcome| outcome.detail.tick.contacts)).is_break()
            {
                return Ok(());
            }
        }
    }
    Ok(())
}

fn chains(recordings: [&Recording; 2]) -> anyhow::Result<[SafetyChain; 2]> {
    let chain = |recording: &Recording| {
        let header = &recording.header;
        let chain = safety::of_recording(&header.scene.more, 1.0 / header.rate_hz)?;
        chain.context("the recording's header does not say enough of its safety chain")
    };
    Ok([chain(recordings[0])?, chain(recordings[1])?])
}
