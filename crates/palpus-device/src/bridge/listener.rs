//! The thread that receives states, and sends zero commands while the loop does not write.

use std::borrow::Cow;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use palpus::algebra::Wrench;

use super::frame::{self, Body, Command, Frame, State};
use super::session::{BUFFER, Session};
use super::socket::Received;
use crate::latest::Publisher;
use crate::realtime::{RealTimeOptions, claim};

/// If no state arrives for this time, the device is lost.
const LOST_TIME: Duration = Duration::from_millis(250);

/// Largest force (N) that the driver may apply without a command. A hand feels this force.
const UNASKED: f64 = 0.5;

/// A state, its sequence number, and the time at which it arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed {
    pub(super) sequence: u64,
    pub(super) state: State,
    pub(super) arrived: Instant,
}

/// Data that the loop and the listener thread share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) session: Session,
    /// Time for which a wrench is valid.
    pub(super) valid_for: Duration,
    /// True if the device is no longer needed.
    pub(super) over: AtomicBool,
    /// The reason why no more states will arrive; unset while states arrive.
    pub(super) lost: OnceLock<Cow<'static, str>>,
    pub(super) counts: Counts,
    opened: Instant,
    /// Time of the last sent command, ns since `opened`.
    written: AtomicU64,
    /// Time of the last sent command with a wrench, ns since `opened`.
    pushed: AtomicU64,
    /// True if the last command has a wrench.
    is_pushing: AtomicBool,
    /// Number of wrenches that the listener ended because the loop did not write.
    pub(super) interruptions: AtomicU64,
    /// Device time of the first state, ns.
    first_ns: AtomicU64,
}

#[derive(Debug, Default)]
pub(super) struct Counts {
    pub(super) states: AtomicU64,
    pub(super) lost: AtomicU64,
    pub(super) ignored: AtomicU64,
    pub(super) unsent: AtomicU64,
    pub(super) idle: AtomicU64,
}

impl Shared {
    pub(super) fn new(session: Session, valid_for: Duration) -> Self {
        Self {
            session,
            valid_for,
            over: AtomicBool::new(false),
            lost: OnceLock::new(),
            counts: Counts::default(),
            opened: Instant::now(),
            written: AtomicU64::new(0),
            pushed: AtomicU64::new(0),
            is_pushing: AtomicBool::new(false),
            interruptions: AtomicU64::new(0),
            first_ns: AtomicU64::new(0),
        }
    }

    /// Returns the device's time since the first state, s.
    pub(super) fn seconds(&self, time_ns: u64) -> f64 {
        let since = time_ns.wrapping_sub(self.first_ns.load(Ordering::Relaxed));
        // A device's clock may run backwards; the gate then reports a fault.
        (since as i64) as f64 * 1e-9
    }

    /// Sends a command. If the driver's queue is full, the command is counted as unsent.
    pub(super) fn send(&self, sequence: u64, command: Command) -> io::Result<()> {
        let sent = self.session.send(sequence, Body::Command(command))?;
        self.counts.unsent.fetch_add(u64::from(!sent), Ordering::Relaxed);
        let now = self.now();
        self.written.store(now, Ordering::Relaxed);
        let is_pushing = command.wrench != Wrench::ZERO;
        self.is_pushing.store(is_pushing, Ordering::Relaxed);
        if is_pushing {
            self.pushed.store(now, Ordering::Relaxed);
        }
        Ok(())
    }

    fn now(&self) -> u64 {
        u64::try_from(self.opened.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    /// Returns true if the last command with a wrench is too old to explain a wrench that the
    /// device still applies.
    fn is_at_rest(&self) -> bool {
        let since = self.now().saturating_sub(self.pushed.load(Ordering::Relaxed));
        Duration::from_nanos(since) > self.valid_for + LOST_TIME
    }

    /// Sends a zero command if the loop's last write is older than a wrench stays valid. The
    /// command keeps the session open.
    fn keep_alive(&self) -> io::Result<()> {
        let silent = self.now().saturating_sub(self.written.load(Ordering::Relaxed));
        if Duration::from_nanos(silent) <= self.valid_for {
            return Ok(());
        }
        self.counts.idle.fetch_add(1, Ordering::Relaxed);
        if self.is_pushing.load(Ordering::Relaxed) {
            self.interruptions.fetch_add(1, Ordering::Release);
        }
        self.send(self.session.next(), Command::default())
    }
}

/// The listener thread's side of the device.
pub(super) struct Listener {
    states: Publisher<Sensed>,
    shared: Arc<Shared>,
    /// Sequence of the newest state.
    newest: u64,
    heard: Instant,
}

impl Listener {
    pub(super) fn new(first: Sensed, states: Publisher<Sensed>, shared: Arc<Shared>) -> Self {
        shared.first_ns.store(first.state.time_ns, Ordering::Relaxed);
        Self { states, shared, newest: first.sequence, heard: first.arrived }
    }

    /// Runs until the device is no longer needed, or is lost.
    pub(super) fn run(mut self, priority: Option<u8>) {
        if priority.is_some() {
            // If this priority is refused, the loop's priority was refused too, and its message
            // says how to fix it.
            claim(&RealTimeOptions { priority, lock_memory: false, pin: false });
        }
        // `Ended` also reports a panic of this thread.
        let _ended = Ended(Arc::clone(&self.shared));
        while !self.shared.over.load(Ordering::Acquire) {
            if let Err(why) = self.turn() {
                let again = "palpus does not reconnect by itself, since the force would return unexpectedly: \
                    start the run again";
                let _ = self.shared.lost.set(Cow::Owned(format!("{why}; {again}")));
                return;
            }
        }
    }

    /// Handles the next frame, if one arrives in time.
    fn turn(&mut self) -> Result<(), String> {
        let mut buffer = BUFFER;
        match self.shared.session.socket.receive(&mut buffer).map_err(|error| gone(&error))? {
            Received::Frame(length) => self.take(&buffer[..length])?,
            Received::Nothing => {}
        }
        if self.heard.elapsed() > LOST_TIME {
            return Err(format!("the driver has sent no state for {} ms", LOST_TIME.as_millis()));
        }
        self.shared.keep_alive().map_err(|error| gone(&error))
    }

    fn take(&mut self, bytes: &[u8]) -> Result<(), String> {
        let counts = &self.shared.counts;
        match frame::decode(bytes) {
            Ok(Frame { nonce, sequence, body: Body::State(state) })
                if nonce == self.shared.session.nonce && sequence > self.newest =>
            {
                counts.states.fetch_add(1, Ordering::Relaxed);
                counts.lost.fetch_add(sequence - self.newest - 1, Ordering::Relaxed);
                let arrived = Instant::now();
                (self.newest, self.heard) = (sequence, arrived);
                self.states.publish(Sensed { sequence, state, arrived });
                let force = state.applied.force.length();
                if force > UNASKED && self.shared.is_at_rest() {
                    return Err(format!("the driver applies {force:.1} N although the command is zero"));
                }
                Ok(())
            }
            Ok(Frame { nonce, body: Body::Close(reason), .. }) if nonce == self.shared.session.nonce => {
                let reason = if reason.is_empty() { "without a reason".into() } else { reason };
                Err(format!("the driver has ended the session: {reason}"))
            }
            _ => {
                counts.ignored.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
        }
    }
}

/// Describes a failed connection.
pub(super) fn gone(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof | io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset => {
            "the driver has closed the connection".to_owned()
        }
        io::ErrorKind::ConnectionRefused => "the driver no longer listens".to_owned(),
        _ => format!("the connection to the driver is lost: {error}"),
    }
}

/// Marks the device as lost when the listener thread ends.
struct Ended(Arc<Shared>);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.lost.set(Cow::Borrowed("the thread that receives the driver's states has ended"));
    }
}
