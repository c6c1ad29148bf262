//! The recordings of one device of a session, one after the other.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::anyhow;
use palpus::render::Settings;
use palpus_io::RecordingHeader;

use super::servo_thread::{ORDERS, RecordingRequest};
use crate::recording::{Recording, RecordingOptions, Rows, Writing};
use crate::tools::name_recordings;

/// See the module's description.
pub(super) struct Recordings {
    header: RecordingHeader,
    /// Number of the device.
    which: usize,
    keep: RecordingOptions,
    orders: rtrb::Producer<RecordingRequest>,
    over: rtrb::Consumer<Rows>,
    writing: Option<Writing>,
    written: Vec<PathBuf>,
    notes: Vec<String>,
}

/// The servo thread's ends of the queues.
pub(super) type Ends = (rtrb::Consumer<RecordingRequest>, rtrb::Producer<Rows>);

/// Longest wait for the servo thread to release a recording: many ticks. A paused loop does not
/// answer.
const PATIENCE: Duration = Duration::from_millis(50);

impl Recordings {
    /// Creates the recordings of device `which`. `header`: header of a recording that begins with
    /// the run.
    pub(super) fn new(header: RecordingHeader, which: usize, keep: RecordingOptions) -> (Self, Ends) {
        let (orders, ordered) = rtrb::RingBuffer::new(ORDERS);
        // Capacity for the first recording and all later requests.
        let (put_down, over) = rtrb::RingBuffer::new(ORDERS + 1);
        (
            Self { header, which, keep, orders, over, writing: None, written: Vec::new(), notes: Vec::new() },
            (ordered, put_down),
        )
    }

    /// Returns the file that is being written.
    pub(super) fn path(&self) -> Option<&Path> {
        self.writing.as_ref().map(Writing::path)
    }

    /// Returns the error after which nothing is written.
    #[cfg(feature = "window")]
    pub(super) fn trouble(&self) -> Option<String> {
        self.writing.as_ref().and_then(Writing::trouble)
    }

    /// Creates this device's file, one of the `files` of all devices, and its writer; `settings`:
    /// the current settings.
    pub(super) fn start(&mut self, files: &[PathBuf], settings: &Settings) -> anyhow::Result<Rows> {
        self.header.scene.render = *settings;
        if files.len() > 1 {
            name_recordings(self.which, files, &mut self.header.scene.more);
        }
        let Recording { rows, writing } = Recording::start(&files[self.which], &self.header, &self.keep)?;
        self.writing = Some(writing);
        Ok(rows)
    }

    /// Begins a recording with the next tick of a run in progress.
    pub(super) fn begin(&mut self, files: &[PathBuf], settings: &Settings) -> anyhow::Result<()> {
        let rows = self.start(files, settings)?;
        let ordered = self.order(Some((rows, *settings)));
        if ordered.is_err() {
            self.writing = None;
        }
        ordered
    }

    fn order(&mut self, order: RecordingRequest) -> anyhow::Result<()> {
        while self.over.pop().is_ok() {}
        self.orders.push(order).map_err(|_| anyhow!("the loop does not answer; resume it first"))
    }

    /// Ends the current recording; returns its file.
    pub(super) fn stop(&mut self) -> anyhow::Result<Option<PathBuf>> {
        let Some(writing) = self.writing.take() else { return Ok(None) };
        self.order(None)?;
        let begin = Instant::now();
        while self.over.is_empty() && begin.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_micros(200));
        }
        let path = writing.path().to_owned();
        self.notes.extend(writing.finish());
        self.written.push(path.clone());
        Ok(Some(path))
    }

    /// Returns the files and the messages for the user, after the loop has ended.
    pub(super) fn finish(mut self) -> (Vec<PathBuf>, Vec<String>) {
        if let Some(writing) = self.writing.take() {
            let path = writing.path().to_owned();
            self.notes.extend(writing.finish());
            self.written.push(path);
        }
        (self.written, self.notes)
    }
}
