//! Writes recordings outside the servo thread.
//!
//! 1. The servo thread pushes rows into a bounded queue: no lock, no allocation, no waiting. A full
//!    queue drops the row and counts it.
//! 2. A writer thread removes the rows in order and passes them to the caller's [`Sink`]. The
//!    writer thread also calls the sink when the queue is empty.
//! 3. [`Recording::finish`] waits until the writer has emptied the queue, and returns the
//!    numbers of written and dropped rows.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Sleep of the writer when the queue is empty. The sleep lasts a few ticks, so a queue with room
/// for a second of rows never fills.
const IDLE: Duration = Duration::from_millis(2);

/// Destination of the rows of a recording. All calls come from the writer thread. After the first
/// error there are no more calls.
pub trait Sink<R>: Send + 'static {
    /// Writes a row.
    fn write(&mut self, row: &R) -> io::Result<()>;

    /// Lets the sink write its buffered rows. The writer thread calls this every few milliseconds
    /// while there is no new row.
    fn idle(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Completes the recording. The writer thread calls this once, after the last row, if there was
    /// no error.
    fn finish(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<R, W: FnMut(&R) -> io::Result<()> + Send + 'static> Sink<R> for W {
    fn write(&mut self, row: &R) -> io::Result<()> {
        self(row)
    }
}

/// The end of the servo thread: it pushes rows into the queue.
#[derive(Debug)]
pub struct Recorder<R> {
    queue: rtrb::Producer<R>,
    dropped: Arc<AtomicU64>,
}

impl<R: Copy> Recorder<R> {
    /// Pushes a row into the queue; if the queue is full, drops the row and counts it. Never waits
    /// or allocates.
    pub fn push(&mut self, row: R) {
        if !self.try_push(row) {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Pushes a row into the queue; returns false if the queue is full. A refused row is not
    /// counted as dropped, so the caller can keep it and try again. This never waits or allocates.
    #[must_use]
    pub fn try_push(&mut self, row: R) -> bool {
        self.queue.push(row).is_ok()
    }

    /// Returns the number of rows dropped so far.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// A running recording: the handle of the writer thread.
#[derive(Debug)]
pub struct Recording {
    writer: JoinHandle<(u64, Option<io::Error>)>,
    finished: Arc<AtomicBool>,
    dropped: Arc<AtomicU64>,
}

/// Outcome of a recording.
#[derive(Debug)]
pub struct RecordingSummary {
    /// Number of rows that the sink accepted.
    pub written: u64,
    /// Number of rows dropped because the queue was full: the writer was too slow or had failed.
    pub dropped: u64,
    /// The error that stopped the writer early; `None` without an error.
    pub error: Option<io::Error>,
}

/// Starts a writer thread that passes each row pushed into the returned [`Recorder`] to `sink`, in
/// order. The queue holds `capacity` rows.
pub fn record<R>(capacity: usize, mut sink: impl Sink<R>) -> (Recorder<R>, Recording)
where
    R: Copy + Send + 'static,
{
    let (producer, mut consumer) = rtrb::RingBuffer::new(capacity);
    let finished = Arc::new(AtomicBool::new(false));
    let dropped = Arc::new(AtomicU64::new(0));
    let ending = Arc::clone(&finished);
    let writer = std::thread::spawn(move || {
        let mut written = 0;
        let ended = drain(&mut sink, &mut consumer, &ending, &mut written);
        (written, ended.err())
    });
    (Recorder { queue: producer, dropped: Arc::clone(&dropped) }, Recording { writer, finished, dropped })
}

/// Passes rows from the queue to `sink` until the recording ends, and counts them in `written`.
fn drain<R>(
    sink: &mut impl Sink<R>,
    queue: &mut rtrb::Consumer<R>,
    ending: &AtomicBool,
    written: &mut u64,
) -> io::Result<()> {
    loop {
        // This flag is read before the loop below empties the queue. So rows that were pushed
        // before the end are still written.
        let last_round = ending.load(Ordering::Acquire) || queue.is_abandoned();
        while let Ok(row) = queue.pop() {
            sink.write(&row)?;
            *written += 1;
        }
        if last_round {
            return sink.finish();
        }
        sink.idle()?;
        std::thread::sleep(IDLE);
    }
}

impl Recording {
    /// Writes the rows that are still in the queue, and ends the writer thread.
    ///
    /// # Panics
    /// If the sink panicked in the writer thread.
    pub fn finish(self) -> RecordingSummary {
        self.finished.store(true, Ordering::Release);
        match self.writer.join() {
            Ok((written, error)) => RecordingSummary { written, dropped: self.dropped.load(Ordering::Relaxed), error },
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc;

    #[test]
    fn rows_arrive_in_order_if_queue_has_room() {
        let (rows, arrived) = mpsc::channel();
        let (mut recorder, recording) = record(1000, move |row: &u32| rows.send(*row).map_err(io::Error::other));
        for row in 0..1000 {
            recorder.push(row);
        }
        let summary = recording.finish();
        assert_eq!((summary.written, summary.dropped), (1000, 0));
        assert!(arrived.iter().eq(0..1000));
    }

    #[test]
    fn full_queue_drops_and_counts_rows() {
        let (gate, closed) = mpsc::channel::<()>();
        let (mut recorder, recording) = record(8, move |_: &u32| {
            // The writer waits here until the gate is dropped.
            let _ = closed.recv();
            Ok(())
        });
        for row in 0..100 {
            recorder.push(row);
        }
        assert!(recorder.dropped() >= 100 - 8 - 1);
        drop(gate);
        let summary = recording.finish();
        assert_eq!(summary.written + summary.dropped, 100);
    }

    #[test]
    fn sink_error_is_reported_once() {
        let mut calls = 0;
        let (mut recorder, recording) = record(8, move |_: &u32| {
            calls += 1;
            assert_eq!(calls, 1);
            Err(io::Error::other("the disk is full"))
        });
        recorder.push(1);
        recorder.push(2);
        let summary = recording.finish();
        assert_eq!(summary.written, 0);
        assert!(summary.error.is_some_and(|error| error.to_string() == "the disk is full"));
    }
}
