//! `palpus replay`: a recording once more, every wrench compared bit for bit.

use std::ops::ControlFlow;
use std::process::ExitCode;

use anyhow::{Context, bail};
use palpus::algebra::Wrench;
use palpus_device::{Cuts, DeviceState};
use palpus_io::record::SceneSource;
use palpus_io::scene::FilePolicy;
use palpus_io::{RecordRow, Recording, read_recording};
use serde::Serialize;

use crate::args::ReplayArguments;
use crate::engine::Engine;
use crate::stage::{self, Stage};
use crate::{output, safety};

/// What `--json` says.
#[derive(Serialize)]
struct Report {
    ticks: usize,
    identical: usize,
    /// The first tick whose wrench differs.
    first_divergence: Option<Divergence>,
}

#[derive(Serialize)]
struct Divergence {
    tick: u64,
    recorded_force: [f64; 3],
    replayed_force: [f64; 3],
    recorded_torque: [f64; 3],
    replayed_torque: [f64; 3],
    recorded_contacts: u32,
    replayed_contacts: u32,
}

pub(crate) fn replay(arguments: &ReplayArguments) -> anyhow::Result<ExitCode> {
    let recording = read_recording(&arguments.recording)?;
    if let Some(notice) = &recording.notice {
        output::note(format!("note: {notice}"));
    }
    if recording.header.scene.render.time_budget.is_some() {
        output::note(
            "note: recorded with a time budget; steps that ran out of time were cut short by a clock and come out differently",
        );
    }
    let mut report = Report { ticks: recording.rows.len(), identical: 0, first_divergence: None };
    let mut around = String::new();
    let policy = if arguments.allow_outside { FilePolicy::Anywhere } else { FilePolicy::Inside };
    run_again(&recording, policy, &[], &mut |k, wrench, contacts| {
        let row = &recording.rows[k];
        if row.same_wrench(wrench) {
            report.identical += 1;
        } else if report.first_divergence.is_none() {
            report.first_divergence = Some(divergence(row, wrench, contacts));
            around = state_around(&recording.rows, k);
        }
    })?;
    tell(&report, &around, arguments.json)?;
    Ok(if report.first_divergence.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs the recording again and tells `each` of every tick: which row, the wrench for the device, contacts. The engine comes back with
/// what the ticks `keep` have to show.
pub(crate) fn run_again(
    recording: &Recording,
    policy: FilePolicy,
    keep: &[u64],
    each: &mut dyn FnMut(usize, &Wrench, u32),
) -> anyhow::Result<(Stage, Engine)> {
    let stage = replayable(recording, policy)?;
    let mut engine = Engine::new(&stage, recording.header.scene.render)?;
    keep.iter().for_each(|tick| engine.keep(*tick));
    run_again_on(recording, &mut engine, &mut |k, wrench, contacts| {
        each(k, wrench, contacts);
        ControlFlow::Continue(())
    })?;
    Ok((stage, engine))
}

/// The recorded scene, ready to be run again, if it can be.
pub(crate) fn replayable(recording: &Recording, policy: FilePolicy) -> anyhow::Result<Stage> {
    if recording.rows.is_empty() {
        bail!("the recording has no ticks to replay");
    }
    check_gaps(recording)?;
    if !recording.changes.is_empty() {
        bail!("the recording has changes of settings, which are not replayed yet");
    }
    stage_of(recording, policy)
}

/// Runs a recording that is [`replayable`] on an engine of its stage, until `each` breaks off.
pub(crate) fn run_again_on(
    recording: &Recording,
    engine: &mut Engine,
    each: &mut dyn FnMut(usize, &Wrench, u32) -> ControlFlow<()>,
) -> anyhow::Result<()> {
    let header = &recording.header;
    let mut chain = safety::of_recording(&header.scene.more, 1.0 / header.rate_hz)?;
    for (k, row) in recording.rows.iter().enumerate() {
        let state =
            DeviceState { pose: row.pose, twist: row.twist, buttons: row.buttons, time: row.time_ns as f64 * 1e-9 };
        let outcome = engine.step(&state, row.dt);
        // Faults, which the device, the clock and the step's own trouble decide, are as recorded; all else the chain finds again.
        let told = Cuts::from_bits(row.faults).and(Cuts::TOLD);
        let wrench = match &mut chain {
            Some(chain) => chain.shape(&state, &outcome.wrench, told).wrench,
            None => outcome.wrench,
        };
        if each(k, &wrench, outcome.detail.tick.contacts).is_break() {
            break;
        }
    }
    Ok(())
}

/// The recorded scene, made ready again; refused if its meshes are others now.
fn stage_of(recording: &Recording, policy: FilePolicy) -> anyhow::Result<Stage> {
    let recorded = &recording.header.scene;
    let name = match &recorded.source {
        SceneSource::BuiltIn(name) | SceneSource::File(name) => name,
    };
    let mut stage = stage::prepare(name, policy).with_context(|| format!("the recorded scene `{name}` is not here"))?;
    stage::check_content(&stage, recorded)?;
    stage.environment_pose = recorded.environment.pose;
    Ok(stage)
}

/// What came before a tick decides its answer, so a replay needs every tick.
fn check_gaps(recording: &Recording) -> anyhow::Result<()> {
    for (k, row) in recording.rows.iter().enumerate() {
        if row.tick != k as u64 {
            bail!(
                "tick {k} is missing from the recording (the disk was too slow, it was cut, or the step panicked); it can't be replayed"
            );
        }
    }
    Ok(())
}

fn divergence(row: &RecordRow, wrench: &Wrench, contacts: u32) -> Divergence {
    Divergence {
        tick: row.tick,
        recorded_force: row.wrench.force.to_array(),
        replayed_force: wrench.force.to_array(),
        recorded_torque: row.wrench.torque.to_array(),
        replayed_torque: wrench.torque.to_array(),
        recorded_contacts: row.contacts,
        replayed_contacts: contacts,
    }
}

/// Ticks shown on each side of the first divergence.
const AROUND: usize = 3;

fn state_around(rows: &[RecordRow], k: usize) -> String {
    let mut text = String::from("   tick  contacts  clusters  separation (mm)   force (N)  position (mm)\n");
    for row in &rows[k.saturating_sub(AROUND)..(k + AROUND + 1).min(rows.len())] {
        let position = row.pose.translation * 1e3;
        text += &format!(
            "{} {:6}  {:8}  {:8}  {:15.6}  {:10.6}  {:.4} {:.4} {:.4}\n",
            if row.tick == rows[k].tick { '>' } else { ' ' },
            row.tick,
            row.contacts,
            row.clusters,
            row.separation * 1e3,
            row.wrench.force.length(),
            position.x,
            position.y,
            position.z
        );
    }
    text
}

fn tell(report: &Report, around: &str, json: bool) -> anyhow::Result<()> {
    if json {
        return output::json(report);
    }
    match &report.first_divergence {
        None => output::line(format!("all {} wrenches are the same, bit for bit", report.ticks)),
        Some(first) => {
            let differing = report.ticks - report.identical;
            output::line(format!("{differing} of {} wrenches differ; the first is tick {}:", report.ticks, first.tick));
            output::line(format!(
                "  force   recorded {:?}\n          replayed {:?}",
                first.recorded_force, first.replayed_force
            ));
            output::line(format!(
                "  torque  recorded {:?}\n          replayed {:?}",
                first.recorded_torque, first.replayed_torque
            ));
            output::line(format!(
                "  contacts recorded {}, replayed {}",
                first.recorded_contacts, first.replayed_contacts
            ));
            output::line(around);
        }
    }
    Ok(())
}
