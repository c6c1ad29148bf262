//! Input of a replay from a recording: its scene, a check that all its ticks exist, and the
//! content of each row.

use std::num::NonZeroU64;
use std::path::Path;

use anyhow::{Context, bail};
use palpus_device::{Cut, Cuts, DeviceState, LATE};
use palpus_io::record::{SceneSource, ServoRecord};
use palpus_io::{ContentHash, RecordRow, Recording};

use super::places::{Places, tell_changes};
use crate::recording::first_part;
use crate::stage::{self, Stage};

/// Returns an error if the recorded device poses do not refer to the grip, because this version
/// takes device poses at the grip.
pub(crate) fn check_poses(recording: &Recording) -> anyhow::Result<()> {
    let header = &recording.header;
    if !header.has_grip_poses() {
        bail!(
            "the recording has format {}, in which device poses place the origin of the probe's mesh and not its \
            grip; it can be read, plotted and converted, and replayed with palpus {}, which wrote it",
            header.format,
            header.palpus_version
        );
    }
    Ok(())
}

/// Fails unless the recording has every tick from the beginning, with device poses of the grip.
pub(crate) fn check_rows(recording: &Recording) -> anyhow::Result<()> {
    check_poses(recording)?;
    if recording.rows.is_empty() {
        bail!("the recording has no ticks to replay");
    }
    check_gaps(recording)
}

/// Returns the crease angle of a recorded change that turns shading on, if there is one, rad.
pub(crate) fn crease_angle(recording: &Recording) -> Option<f64> {
    recording.changes.iter().find_map(|(_, settings)| Some(settings.shading?.crease_angle))
}

/// Returns the state that the engine and the safety chain received.
pub(crate) fn state(row: &RecordRow) -> DeviceState {
    DeviceState {
        pose: row.pose,
        twist: row.twist,
        buttons: row.buttons,
        time: row.servo.map_or(row.time_ns as f64 * 1e-9, |servo| servo.device_time_s),
        withheld: Cuts::from_bits(row.faults).has(Cut::Withheld),
    }
}

/// Returns the recorded input of the safety chain: faults that come from the device, the clock and
/// the step. The chain computes everything else again.
pub(crate) fn recorded_cuts(row: &RecordRow) -> Cuts {
    Cuts::from_bits(row.faults).and(Cuts::INPUTS)
}

/// False if the step panicked, or the loop only damped the grip. Recordings of older formats do not
/// have these ticks.
pub(crate) fn has_stepped(row: &RecordRow) -> bool {
    row.servo.is_none_or(|servo| servo.stepped)
}

/// Returns the work limit of the engine's query. Recordings of older formats lack this limit: their
/// runs had no limit, or a time limit.
pub(crate) fn work_allowed(row: &RecordRow) -> Option<u64> {
    row.servo.and_then(|servo| servo.work_allowed).map(NonZeroU64::get)
}

/// True if the tick began so late that the servo loop counts it. Recordings of older formats do not
/// have this value.
#[cfg_attr(not(feature = "window"), allow(dead_code, reason = "only the window shows it"))]
pub(crate) fn is_late(servo: Option<&ServoRecord>) -> bool {
    servo.is_some_and(|servo| servo.lateness_s > LATE.as_secs_f64())
}

/// Returns the time since the previous tick, s, for the chain; the nominal period for older
/// formats.
pub(crate) fn elapsed(row: &RecordRow) -> f64 {
    row.servo.map_or(row.dt, |servo| servo.elapsed_s)
}

/// Prepares the scene of the first tool's `recording`. Fails if its meshes have changed. `others`:
/// the contents of the other tools' meshes.
pub(super) fn stage_of(recording: &Recording, others: &[ContentHash], places: &Places<'_>) -> anyhow::Result<Stage> {
    let recorded = &recording.header.scene;
    let (name, file) = match &recorded.source {
        SceneSource::BuiltIn(name) => (name, None),
        SceneSource::File(name) => (name, Some(Path::new(name))),
    };
    tell_changes(&recording.header, file);
    let stage = match file.zip(recorded.text.as_deref()) {
        Some((path, text)) => places.stage(recorded, text, path, others),
        None => stage::prepare(name, places.policy),
    };
    let mut stage =
        stage.with_context(|| format!("the recorded scene `{name}` is not available as it was recorded"))?;
    stage::check_content(&stage, recorded)?;
    stage.environment_pose = recorded.environment.pose;
    Ok(stage)
}

/// Fails if a tick is missing. Earlier ticks affect the result, so a replay needs every tick.
fn check_gaps(recording: &Recording) -> anyhow::Result<()> {
    let header = &recording.header;
    if let Some(first) = first_part(header) {
        bail!(
            "this is a later part of a large recording; it lacks the engine's state at its beginning, so it can \
            be read but not replayed; the first part, {first}, can be replayed up to its end"
        );
    }
    if let Some(first) = recording.rows.first().filter(|row| row.tick > 0) {
        bail!(
            "the recording was started during a run, at tick {}: it lacks the engine's state from earlier ticks, \
            so it can be read but not replayed; a recording from the beginning of a run can be replayed",
            first.tick
        );
    }
    for (k, row) in recording.rows.iter().enumerate() {
        if row.tick != k as u64 {
            bail!(
                "tick {k} is missing from the recording (the disk was too slow, the file was cut, or the step panicked in an older palpus); it cannot be replayed"
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn late_ticks_are_found_by_recorded_lateness() {
        let late = |lateness_s| is_late(Some(&ServoRecord { lateness_s, ..ServoRecord::default() }));
        assert!(late(0.6e-3) && !late(0.4e-3));
        assert!(!is_late(None), "format 2 does not store the lateness");
    }
}
