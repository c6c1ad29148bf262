//! The thread that receives states, and says zero for a loop that is silent.

use std::borrow::Cow;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use palpus::algebra::Wrench;

use super::frame::{self, Body, Command, Frame, State};
use super::session::{BUFFER, Session};
use super::socket::Heard;
use crate::latest::Publisher;
use crate::realtime::{RealTimeOptions, claim};

/// Without a state for this long, the device is lost.
const LOST_TIME: Duration = Duration::from_millis(250);

/// N: a force without a command is felt from here on.
const UNASKED: f64 = 0.5;

/// A state, its number, and when it arrived.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensed {
    pub(super) sequence: u64,
    pub(super) state: State,
    pub(super) arrived: Instant,
}

/// State that the loop and the thread share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) session: Session,
    /// For which a wrench is valid.
    pub(super) valid_for: Duration,
    /// The device is not needed any more.
    pub(super) over: AtomicBool,
    /// Why there are no more states.
    pub(super) lost: OnceLock<Cow<'static, str>>,
    pub(super) counts: Counts,
    opened: Instant,
    /// ns since `opened` when the last command was sent.
    written: AtomicU64,
    /// ns since `opened` when the last command was sent that has a wrench.
    pushed: AtomicU64,
    /// The last command has a wrench.
    is_pushing: AtomicBool,
    /// How often a wrench was ended from here, because the loop was silent.
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

    /// s of the device's time since the first state.
    pub(super) fn seconds(&self, time_ns: u64) -> f64 {
        let since = time_ns.wrapping_sub(self.first_ns.load(Ordering::Relaxed));
        // A device's clock may run backwards; that is the gate's to judge.
        (since as i64) as f64 * 1e-9
    }

    /// Sends a command; one for which there is no room is counted.
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

    /// True if the last command to push is so long ago that it cannot explain an old wrench.
    fn is_at_rest(&self) -> bool {
        let since = self.now().saturating_sub(self.pushed.load(Ordering::Relaxed));
        Duration::from_nanos(since) > self.valid_for + LOST_TIME
    }

    /// Keeps the session alive without a wrench, where the loop has not written for as long as a
    /// wrench is valid.
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

/// The thread's side of the device.
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

    /// Until the device is not needed any more, or lost.
    pub(super) fn run(mut self, priority: Option<u8>) {
        if priority.is_some() {
            // If the priority is refused here, the loop's own was refused too, and its message
            // names the remedy.
            claim(&RealTimeOptions { priority, lock_memory: false, pin: false });
        }
        // Said also if this thread should panic.
        let _ended = Ended(Arc::clone(&self.shared));
        while !self.shared.over.load(Ordering::Acquire) {
            if let Err(why) = self.turn() {
                let again = "palpus does not connect again by itself, since a force would come back unasked: \
                    start the run again";
                let _ = self.shared.lost.set(Cow::Owned(format!("{why}; {again}")));
                return;
            }
        }
    }

    /// Takes the next frame, if one comes in time.
    fn turn(&mut self) -> Result<(), String> {
        let mut buffer = BUFFER;
        match self.shared.session.socket.receive(&mut buffer).map_err(|error| gone(&error))? {
            Heard::Frame(length) => self.take(&buffer[..length])?,
            Heard::Nothing => {}
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
                    return Err(format!("the driver pushes with {force:.1} N although the command is zero"));
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

/// Says that the connection is gone.
pub(super) fn gone(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof | io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset => {
            "the driver has closed the connection".to_owned()
        }
        io::ErrorKind::ConnectionRefused => "the driver does not listen any more".to_owned(),
        _ => format!("the connection to the driver is gone: {error}"),
    }
}

/// Signals the loop that the receiving thread has ended.
struct Ended(Arc<Shared>);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.lost.set(Cow::Borrowed("the thread that listens to the driver has ended"));
    }
}
