//! Recording off the servo thread.
//!
//! 1. The servo thread pushes rows into a bounded queue: no lock, no allocation, no waiting. A full
//!    queue drops the row and counts it.
//! 2. A writer thread takes them out in order and hands them to the caller's [`Sink`], which is
//!    also called when the queue is empty.
//! 3. [`Recording::finish`] lets the writer drain the queue and returns how much was written and
//!    dropped.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// How long the writer sleeps when it finds the queue empty: a few ticks, so that a queue of a
/// second never fills.
const IDLE: Duration = Duration::from_millis(2);

/// Destination of the rows of a recording. All calls come from the writer's thread; after the first
/// error there are no more.
pub trait Sink<R>: Send + 'static {
    /// Writes a row.
    fn write(&mut self, row: &R) -> io::Result<()>;

    /// There is no row to write at the moment: what was kept back may have to go now. Called every
    /// few milliseconds.
    fn idle(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// There was no error, and no row will come any more.
    fn finish(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<R, W: FnMut(&R) -> io::Result<()> + Send + 'static> Sink<R> for W {
    fn write(&mut self, row: &R) -> io::Result<()> {
        self(row)
    }
}

/// The servo thread's end of a recording.
#[derive(Debug)]
pub struct Recorder<R> {
    queue: rtrb::Producer<R>,
    dropped: Arc<AtomicU64>,
}

impl<R: Copy> Recorder<R> {
    /// Puts a row into the queue, or drops and counts it when the queue is full. Never waits or
    /// allocates.
    pub fn push(&mut self, row: R) {
        if !self.try_push(row) {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Puts a row into the queue; false when it is full, and then nothing is counted: for what the
    /// caller holds and tries again. Never waits or allocates.
    #[must_use]
    pub fn try_push(&mut self, row: R) -> bool {
        self.queue.push(row).is_ok()
    }

    /// Rows dropped so far.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// A recording under way: the writer thread.
#[derive(Debug)]
pub struct Recording {
    writer: JoinHandle<(u64, Option<io::Error>)>,
    finished: Arc<AtomicBool>,
    dropped: Arc<AtomicU64>,
}

/// Outcome of a recording.
#[derive(Debug)]
pub struct RecordingSummary {
    /// Rows handed to the sink without an error.
    pub written: u64,
    /// Rows that found the queue full, because the writer was too slow or had failed.
    pub dropped: u64,
    /// The error that ended the writing early.
    pub error: Option<io::Error>,
}

/// Starts a thread that hands every row pushed into the answered [`Recorder`] to `sink`, in order,
/// through a queue of `capacity` rows.
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

/// Takes rows out of the queue until there will be no more, and counts them.
fn drain<R>(
    sink: &mut impl Sink<R>,
    queue: &mut rtrb::Consumer<R>,
    ending: &AtomicBool,
    written: &mut u64,
) -> io::Result<()> {
    loop {
        // Read before the queue is drained, so that rows pushed before the end was announced are
        // still written.
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
    /// Writes what is still in the queue and ends the writer thread.
    ///
    /// # Panics
    /// With the writing function's own panic.
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
    fn rows_arrive_in_order_and_none_is_lost_when_there_is_room() {
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
    fn a_full_queue_drops_and_counts() {
        let (gate, closed) = mpsc::channel::<()>();
        let (mut recorder, recording) = record(8, move |_: &u32| {
            // Held here until the gate is dropped.
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
    fn an_error_of_the_writing_function_is_reported_once() {
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
