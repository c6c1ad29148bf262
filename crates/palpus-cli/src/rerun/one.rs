//! The recording of one tool, run again.

use std::ops::ControlFlow;

use anyhow::{Context, bail};
use palpus::algebra::Wrench;
use palpus_device::{Cut, Cuts, DeviceState};
use palpus_io::Recording;
use palpus_io::record::SceneSource;
use palpus_io::scene::FilePolicy;

use crate::engine::Engine;
use crate::safety;
use crate::stage::{self, Stage};

/// Runs the recording of one tool again and tells `each` of every tick: which row, the wrench for the device, contacts.
pub(crate) fn run_again(
    recording: &Recording,
    policy: FilePolicy,
    each: &mut dyn FnMut(usize, &Wrench, u32),
) -> anyhow::Result<()> {
    let stage = replayable(recording, policy)?;
    let mut engine = engine_of(recording, &stage)?;
    run_again_on(recording, &mut engine, &mut |k, wrench, contacts| {
        each(k, wrench, contacts);
        ControlFlow::Continue(())
    })
}

/// The recorded scene, ready to be run again, if it can be.
pub(crate) fn replayable(recording: &Recording, policy: FilePolicy) -> anyhow::Result<Stage> {
    check_rows(recording)?;
    stage_of(recording, policy)
}

/// An error if the recorded device poses are not those of the grip, which is what this palpus takes
/// device poses to be.
pub(crate) fn check_poses(recording: &Recording) -> anyhow::Result<()> {
    let header = &recording.header;
    if !header.has_grip_poses() {
        bail!(
            "the recording is of format {}, in which device poses are those of the origin of the probe's mesh and not \
             of its grip; it can be read, plotted and converted, and replayed with palpus {}, which wrote it",
            header.format,
            header.palpus_version
        );
    }
    Ok(())
}

/// An error unless every tick of a run from its beginning is there, with device poses of the grip.
pub(crate) fn check_rows(recording: &Recording) -> anyhow::Result<()> {
    check_poses(recording)?;
    if recording.rows.is_empty() {
        bail!("the recording has no ticks to replay");
    }
    check_gaps(recording)
}

/// rad: the crease angle at which a change in the recording has shading on, if one has.
pub(crate) fn crease_angle(recording: &Recording) -> Option<f64> {
    recording.changes.iter().find_map(|(_, settings)| Some(settings.shading?.crease_angle))
}

/// The engine as it was when the recording began, able to take up what the recording's changes bring.
pub(crate) fn engine_of(recording: &Recording, stage: &Stage) -> anyhow::Result<Engine> {
    let engine = Engine::new(stage, recording.header.scene.render)?;
    Ok(match crease_angle(recording) {
        Some(angle) => engine.with_surfaces(angle),
        None => engine,
    })
}

/// Runs a recording that is [`replayable`] on an [`engine_of`] it, until `each` breaks off.
pub(crate) fn run_again_on(
    recording: &Recording,
    engine: &mut Engine,
    each: &mut dyn FnMut(usize, &Wrench, u32) -> ControlFlow<()>,
) -> anyhow::Result<()> {
    let header = &recording.header;
    let mut chain = safety::of_recording(&header.scene.more, 1.0 / header.rate_hz)?;
    let mut changes = recording.changes.iter().peekable();
    for (k, row) in recording.rows.iter().enumerate() {
        while let Some((tick, settings)) = changes.next_if(|(tick, _)| *tick <= row.tick) {
            engine.set_settings(settings).with_context(|| format!("the settings from tick {tick} on cannot be set"))?;
        }
        let state = DeviceState {
            pose: row.pose,
            twist: row.twist,
            buttons: row.buttons,
            time: row.time_ns as f64 * 1e-9,
            withheld: Cuts::from_bits(row.faults).has(Cut::Withheld),
        };
        let outcome = engine.step(&state, row.dt);
        // Faults, which the device, the clock and the step's own trouble decide, are as recorded; all else the chain finds again.
        let told = Cuts::from_bits(row.faults).and(Cuts::TOLD);
        let wrench = match &mut chain {
            Some(chain) => {
                let shaped = chain.shape(&state, &outcome.wrench, told, row.dt);
                engine.set_available(&shaped.available);
                shaped.wrench
            }
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
    if let Some(first) = recording.rows.first().filter(|row| row.tick > 0) {
        bail!(
            "the recording was begun in the course of a run, at tick {}: what the engine remembered then of the ticks before is not in it, so it can be \
             read but not replayed; a recording from the beginning of a run can",
            first.tick
        );
    }
    for (k, row) in recording.rows.iter().enumerate() {
        if row.tick != k as u64 {
            bail!(
                "tick {k} is missing from the recording (the disk was too slow, it was cut, or the step panicked); it can't be replayed"
            );
        }
    }
    Ok(())
}
