//! The recording that a run leaves: rows and changes of settings from the servo thread to a file.
//!
//! 1. The servo thread hands over every tick ([`Rows::row`]) and, between two ticks, every change of the engine's settings
//!    ([`Rows::change`]), through one bounded queue that keeps their order. It never waits.
//! 2. A thread of its own writes them ([`palpus_device::record`]), piece by piece ([`RecordingWriter`]): a program that is
//!    killed leaves a whole file, without its last second at most.
//! 3. [`Writing::finish`] writes the rest and says what was left out.
//!
//! A row that finds the queue full is dropped and counted. A change is held and offered again before the next row: it
//! says itself from which tick on it holds, so that it may come late but must not be missing.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use palpus::render::Settings;
use palpus_device::{Recorder, ServoTick, Sink, record};
use palpus_io::{RecordRow, RecordingHeader, RecordingWriter};

use crate::engine::Detail;

/// Entries that may wait for the writer: half a second at the highest rate.
const QUEUED: usize = 1 << 15;

/// What goes through the queue.
#[derive(Clone, Copy)]
enum Entry {
    Row(RecordRow),
    Change(u64, Settings),
}

/// The servo thread's end.
pub(crate) struct Rows {
    queue: Recorder<Entry>,
    /// A change that found the queue full.
    waiting: Option<(u64, Settings)>,
}

impl Rows {
    /// Records a tick. Never waits or allocates.
    pub(crate) fn row(&mut self, tick: &ServoTick, detail: &Detail) {
        self.offer();
        self.queue.push(Entry::Row(row(tick, detail)));
    }

    /// Records that the ticks from number `tick` on are stepped with these settings; to be called before that tick's
    /// row. Never waits or allocates.
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

fn row(tick: &ServoTick, detail: &Detail) -> RecordRow {
    let Detail { tick: engine, tool, .. } = detail;
    let micros = |ns: u64| ns as f64 / 1e3;
    RecordRow {
        tick: tick.index,
        time_ns: (tick.time * 1e9).round() as u64,
        dt: engine.dt,
        pose: tick.state.pose,
        twist: tick.state.twist,
        buttons: tick.state.buttons,
        wrench: tick.wrench,
        contacts: engine.contacts,
        clusters: engine.clusters,
        separation: engine.separation,
        query_us: micros(engine.times.query),
        depth_us: Some(micros(engine.times.depth)),
        force_us: micros(engine.times.force),
        total_us: micros(engine.times.total),
        saturated: tick.saturated,
        faults: tick.cuts.bits(),
        tool: Some(*tool),
    }
}

/// Writes the entries.
struct Pen(Option<RecordingWriter<File>>);

impl Sink<Entry> for Pen {
    fn write(&mut self, entry: &Entry) -> io::Result<()> {
        match (entry, &mut self.0) {
            (Entry::Row(row), Some(writer)) => writer.write(row)?,
            (Entry::Change(tick, settings), Some(writer)) => writer.change(*tick, settings),
            (_, None) => {}
        }
        Ok(())
    }

    fn idle(&mut self) -> io::Result<()> {
        self.0.as_mut().map_or(Ok(()), RecordingWriter::flush_when_due)
    }

    fn finish(&mut self) -> io::Result<()> {
        self.0.take().map_or(Ok(()), |writer| writer.finish().map(drop))
    }
}

/// A recording under way.
pub(crate) struct Recording {
    /// For the servo thread.
    pub(crate) rows: Rows,
    /// To end it.
    pub(crate) writing: Writing,
}

/// The writer's end.
pub(crate) struct Writing {
    path: PathBuf,
    thread: palpus_device::Recording,
}

impl Recording {
    /// Creates the file, and its folder if need be, and starts the writer.
    pub(crate) fn start(path: &Path, header: &RecordingHeader) -> anyhow::Result<Self> {
        let problem = || format!("{} could not be created; name another file with --record", path.display());
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).with_context(problem)?;
        }
        let writer = RecordingWriter::create(path, header).with_context(problem)?;
        let (queue, thread) = record(QUEUED, Pen(Some(writer)));
        let rows = Rows { queue, waiting: None };
        Ok(Self { rows, writing: Writing { path: path.to_owned(), thread } })
    }
}

impl Writing {
    /// The file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes what is still in the queue; answers what there is to say of the recording, a line each.
    pub(crate) fn finish(self) -> anyhow::Result<Vec<String>> {
        let written = self.thread.finish();
        if let Some(error) = written.error {
            return Err(anyhow!(error).context(format!("{} could not be written", self.path.display())));
        }
        let dropped = (written.dropped > 0)
            .then(|| format!("note: {} rows were not recorded, the disk was too slow", written.dropped));
        Ok(dropped.into_iter().collect())
    }
}
