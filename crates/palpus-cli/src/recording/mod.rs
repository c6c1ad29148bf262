//! The recording of a run: passes rows and changes of settings from the servo thread to a file.
//!
//! 1. The servo thread passes every tick ([`Rows::row`]) and, between two ticks, every change of
//!    the engine's settings ([`Rows::change`]) to one bounded queue, which keeps their order. The
//!    servo thread never waits.
//! 2. A separate thread writes rows and changes ([`palpus_device::record`]), part by part
//!    ([`pen`]). If the program is killed, the file is complete except for at most the last second.
//!    If writing fails, a message is printed at once, and the run goes on.
//! 3. [`Writing::finish`] writes the rest and returns notes about missing rows.
//!
//! If the queue is full, a row is dropped and counted. A change is kept and put into the queue
//! before the next row. A change contains the number of its first tick, so it may arrive late, but
//! it must not be lost.

mod pen;

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Context;
use glam::{DQuat, DVec3};
use palpus::algebra::Pose;
use palpus::render::Settings;
use palpus_device::{DeviceState, Recorder, ServoTick, record};
use palpus_io::record::{RawState, ServoRecord};
use palpus_io::{RecordRow, RecordingHeader};

use crate::engine::Detail;
use crate::{files, output, tools, when};
pub(crate) use pen::first_part;
use pen::{Messages, Pen};

/// Largest number of entries that wait for the writer: a third of a second at the highest rate (100
/// kHz).
const QUEUED: usize = 1 << 15;

/// Items of the queue.
#[derive(Clone, Copy)]
#[allow(clippy::large_enum_variant, reason = "the servo thread may not obtain memory for a box")]
enum Entry {
    Row(RecordRow),
    Change(u64, Settings),
}

/// The servo thread's end of the queue.
pub(crate) struct Rows {
    queue: Recorder<Entry>,
    /// A change that waits because the queue was full.
    waiting: Option<(u64, Settings)>,
}

impl Rows {
    /// Records a tick. Without a `detail`, the tick's step gave no answer. Never waits or
    /// allocates.
    pub(crate) fn row(&mut self, tick: &ServoTick, detail: Option<&Detail>) {
        self.offer();
        self.queue.push(Entry::Row(row(tick, detail)));
    }

    /// Records that the ticks from number `tick` on use these settings. Call this before that
    /// tick's row. Never waits or allocates.
    pub(crate) fn change(&mut self, tick: u64, settings: &Settings) {
        self.waiting = Some((tick, *settings));
        self.offer();
    }

    /// Puts the waiting change into the queue, if there is room.
    fn offer(&mut self) {
        if let Some((tick, settings)) = self.waiting
            && self.queue.try_push(Entry::Change(tick, settings))
        {
            self.waiting = None;
        }
    }
}

fn row(tick: &ServoTick, detail: Option<&Detail>) -> RecordRow {
    let micros = |ns: u64| ns as f64 / 1e3;
    let engine = detail.map(|detail| &detail.tick);
    let times = engine.map(|engine| engine.times).unwrap_or_default();
    RecordRow {
        tick: tick.index,
        time_ns: (tick.time * 1e9).round() as u64,
        dt: engine.map_or(0.0, |engine| engine.dt),
        pose: tick.state.pose,
        twist: tick.state.twist,
        buttons: tick.state.buttons,
        wrench: tick.wrench,
        contacts: engine.map_or(0, |engine| engine.contacts),
        clusters: engine.map_or(0, |engine| engine.clusters),
        separation: engine.map_or(f64::INFINITY, |engine| engine.separation),
        query_us: micros(times.query),
        depth_us: Some(micros(times.depth)),
        force_us: micros(times.force),
        total_us: micros(times.total),
        saturated: tick.saturated,
        faults: tick.cuts.bits(),
        tool: Some(detail.map_or(NOWHERE, |detail| detail.tool)),
        servo: Some(ServoRecord {
            utc_ns: when::utc_ns(),
            lateness_s: tick.lateness_s,
            elapsed_s: tick.elapsed_s,
            phase: tick.phase as u32,
            stepped: detail.is_some(),
            work: engine.map_or(0, |engine| engine.work),
            work_allowed: engine.and_then(|engine| engine.work_allowed).and_then(NonZeroU64::new),
            device_time_s: tick.read.time,
            raw: raw(tick),
        }),
    }
}

/// The pose of a tool in a tick without a rendered pose.
const NOWHERE: Pose =
    Pose { rotation: DQuat::from_xyzw(f64::NAN, f64::NAN, f64::NAN, f64::NAN), translation: DVec3::NAN };

/// Returns the raw state, if the step got a different state.
fn raw(tick: &ServoTick) -> Option<RawState> {
    let DeviceState { pose, twist, .. } = tick.read;
    // A state with NaN is unequal to itself, so it counts as replaced.
    (pose != tick.state.pose || twist != tick.state.twist).then_some(RawState { pose, twist })
}

/// Options of a recording.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RecordingOptions {
    /// True to overwrite an existing file; else the recording gets a free name.
    pub(crate) overwrite: bool,
    /// Largest size of all files of a recording together, bytes.
    pub(crate) limit: Option<u64>,
}

/// Returns free names for the recordings of this many tools. `file` is the requested name of the
/// first recording.
pub(crate) fn free(file: &Path, tools: usize) -> Vec<PathBuf> {
    let all = |path: &Path| tools::recordings(path.to_owned(), tools);
    all(&files::first_free(file, |path| all(path).iter().all(|path| !path.exists())))
}

/// Returns the names of the recordings of a run: the requested names, or free names with a message.
pub(crate) fn of_run(file: &Path, tools: usize, keep: &RecordingOptions) -> Vec<PathBuf> {
    if keep.overwrite {
        return tools::recordings(file.to_owned(), tools);
    }
    let free = free(file, tools);
    if free[0] != file {
        output::note(format!("{} exists already; recording to {}", file.display(), free[0].display()));
    }
    free
}

/// An open recording.
pub(crate) struct Recording {
    /// The end of the queue for the servo thread.
    pub(crate) rows: Rows,
    /// The writer's thread.
    pub(crate) writing: Writing,
}

/// The writer's thread.
pub(crate) struct Writing {
    path: PathBuf,
    thread: palpus_device::Recording,
    messages: Arc<Messages>,
}

impl Recording {
    /// Creates the file, and its folder if necessary, and starts the writer.
    pub(crate) fn start(path: &Path, header: &RecordingHeader, keep: &RecordingOptions) -> anyhow::Result<Self> {
        let problem = || format!("{} could not be created; name another file with --record", path.display());
        files::make_folder_of(path).with_context(problem)?;
        if keep.overwrite && path.exists() {
            std::fs::remove_file(path).with_context(problem)?;
        }
        let header = RecordingHeader { start_utc: Some(when::rfc_3339(when::utc_ns())), ..header.clone() };
        let messages = Arc::new(Messages::default());
        let pen = Pen::new(path, header, keep.limit, Arc::clone(&messages)).with_context(problem)?;
        let (queue, thread) = record(QUEUED, pen);
        let rows = Rows { queue, waiting: None };
        Ok(Self { rows, writing: Writing { path: path.to_owned(), thread, messages } })
    }
}

impl Writing {
    /// Returns the file, or the first of several files.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the write error, if there was one; the file ends at that point.
    #[cfg(feature = "window")]
    pub(crate) fn trouble(&self) -> Option<String> {
        self.messages.trouble()
    }

    /// Writes the rest of the queue, and returns notes about the recording, one for each line. If a
    /// recording could not be written, a note reports it; the run's summary is still complete.
    pub(crate) fn finish(self) -> Vec<String> {
        let written = self.thread.finish();
        let path = self.path.display();
        let mut notes: Vec<String> = self.messages.parts().into_iter().collect();
        if let Some(error) = written.error {
            notes.push(format!(
                "note: {path} is not complete: writing failed before the end of the run ({error}); the last {} ticks are missing",
                written.dropped
            ));
        } else if written.dropped > 0 {
            notes.push(format!("note: {} rows were not recorded, because the disk was too slow", written.dropped));
        }
        notes
    }
}

#[cfg(test)]
mod tests {
    use palpus_alloc::allocations_of_this_thread;
    use palpus_io::read_recording;
    use palpus_io::scene::FilePolicy;

    use super::*;
    use crate::fault_log::tests::ticks;

    #[test]
    fn recording_a_tick_does_not_allocate() {
        crate::bodies::use_cache(false);
        let stage = crate::stage::prepare("pen-sphere", FilePolicy::Inside).expect("the scene is built in");
        let header = stage.header(stage.settings, "sim", 1000.0);
        let path = std::env::temp_dir().join(format!("palpus-rows-{}.csv", std::process::id()));
        let keep = RecordingOptions { overwrite: true, limit: None };
        let Recording { mut rows, writing } = Recording::start(&path, &header, &keep).expect("the file can be written");
        let ticks = ticks();
        let before = allocations_of_this_thread();
        rows.change(0, &stage.settings);
        ticks.iter().for_each(|tick| rows.row(tick, None));
        assert_eq!(allocations_of_this_thread(), before, "the servo thread must not allocate");
        assert!(writing.finish().is_empty());
        let read = read_recording(&path).expect("the recording can be read");
        std::fs::remove_file(&path).expect("the file can be deleted");
        assert_eq!(read.rows.len(), ticks.len());
        for (row, tick) in read.rows.iter().zip(&ticks) {
            let servo = row.servo.expect("the row has format 3");
            assert!(row.same_wrench(&tick.wrench) && !servo.stepped && servo.phase == tick.phase as u32);
        }
    }
}
