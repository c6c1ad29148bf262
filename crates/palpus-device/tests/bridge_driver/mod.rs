//! A bridge driver for tests: correct, or with one defect.
#![allow(dead_code, reason = "each test file uses only a part")]

pub(crate) mod client;
mod line;

use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};
use palpus_device::bridge_frames::{Body, Command, Frame, LONGEST, READY, State, WITHHELD, Welcome, decode, encode};
use palpus_device::{Axes, BridgeAddress, DeviceSpec};

use line::Line;

/// Defects of a driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Defect {
    NeverExpires,
    ExpiresUnsaid,
    PushesUnknowing,
    PushesStale,
    IgnoresCheck,
    IgnoresSequence,
    IgnoresNonce,
    SameSession,
    StreamsEarly,
    EchoesNothing,
    HalfTheRate,
    SkipsNumbers,
    GoesOnAfterClose,
    PushesAskew,
    ClockStands,
    SpeaksVersion2,
    PushesUnasked,
}

pub(crate) const DEFECTS: [Defect; 17] = [
    Defect::NeverExpires,
    Defect::ExpiresUnsaid,
    Defect::PushesUnknowing,
    Defect::PushesStale,
    Defect::IgnoresCheck,
    Defect::IgnoresSequence,
    Defect::IgnoresNonce,
    Defect::SameSession,
    Defect::StreamsEarly,
    Defect::EchoesNothing,
    Defect::HalfTheRate,
    Defect::SkipsNumbers,
    Defect::GoesOnAfterClose,
    Defect::PushesAskew,
    Defect::ClockStands,
    Defect::SpeaksVersion2,
    Defect::PushesUnasked,
];

/// Kind of connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Path,
    Udp,
}

/// Kinds of connections on this system.
pub(crate) const WAYS: &[Way] = if cfg!(target_os = "linux") { &[Way::Path, Way::Udp] } else { &[Way::Udp] };

/// Behaviour of a driver.
#[derive(Clone, Debug)]
pub(crate) struct Behaviour {
    pub(crate) way: Way,
    pub(crate) rate_hz: f64,
    /// Stated peak force, N.
    pub(crate) force_max: f64,
    pub(crate) defect: Option<Defect>,
    /// Number of states after which the driver ends the session with a close frame.
    pub(crate) closes_after: Option<u64>,
}

impl Behaviour {
    pub(crate) fn good(way: Way) -> Self {
        Self { way, rate_hz: 1000.0, force_max: spec().force_max, defect: None, closes_after: None }
    }
}

/// Data that a test reads and sets while the driver runs.
#[derive(Default)]
pub(crate) struct Seen {
    /// The applied wrench of each sent state.
    pub(crate) applied: Vec<Wrench>,
    /// All accepted commands.
    pub(crate) commands: Vec<Command>,
    /// Number of commands that did not arrive, from gaps in the sequence numbers.
    pub(crate) lost_commands: u64,
    /// Frames that are sent unchanged before each state.
    pub(crate) hostile: Vec<Vec<u8>>,
    pub(crate) sent: u64,
    pub(crate) session: u64,
}

#[derive(Default)]
struct Shared {
    seen: Mutex<Seen>,
    over: AtomicBool,
    silent: AtomicBool,
    withheld: AtomicBool,
}

pub(crate) struct StandIn {
    pub(crate) address: BridgeAddress,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

pub(crate) fn spec() -> DeviceSpec {
    DeviceSpec {
        name: Cow::Borrowed("stand-in"),
        force_max: 5.0,
        torque_max: 0.0,
        force_continuous: None,
        torque_continuous: None,
        actuated: Axes::TRANSLATION,
        sensed: Axes::TRANSLATION,
        buttons: 0,
        workspace: None,
        delay: 0.0,
        position_step: 0.0,
        angle_step: 0.0,
    }
}

/// Returns the pose in state number `sequence`: up and down by 1 cm.
pub(crate) fn pose(sequence: u64, rate_hz: f64) -> Pose {
    let phase = 10.0 * sequence as f64 / rate_hz;
    Pose { rotation: DQuat::IDENTITY, translation: DVec3::Z * 0.01 * phase.sin() }
}

impl StandIn {
    pub(crate) fn start(behaviour: Behaviour) -> Self {
        let (line, address) = Line::listen(behaviour.way, new_path());
        let shared = Arc::new(Shared::default());
        let (mut driver, own) = (Driver::new(behaviour, line, Arc::clone(&shared)), Arc::clone(&shared));
        let thread = std::thread::spawn(move || {
            while !own.over.load(Ordering::Relaxed) {
                driver.turn();
            }
        });
        Self { address, shared, thread: Some(thread) }
    }

    pub(crate) fn seen(&self) -> MutexGuard<'_, Seen> {
        self.shared.seen.lock().expect("no thread has panicked")
    }

    /// Stops sending states.
    pub(crate) fn fall_silent(&self) {
        self.shared.silent.store(true, Ordering::Relaxed);
    }

    pub(crate) fn withhold(&self, withheld: bool) {
        self.shared.withheld.store(withheld, Ordering::Relaxed);
    }

    /// Ends the driver. For its peer, the end looks like the end of the process.
    pub(crate) fn end(mut self) -> Seen {
        self.stop();
        std::mem::take(&mut *self.seen())
    }

    fn stop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().expect("the driver does not panic");
        }
    }
}

impl Drop for StandIn {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.stop();
        }
        self.shared.over.store(true, Ordering::Relaxed);
        if let BridgeAddress::Path(path) = &self.address {
            let _ = std::fs::remove_file(path);
        }
    }
}

/// Returns a short path, since the path of a socket has at most 107 bytes.
pub(crate) fn new_path() -> PathBuf {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    std::env::temp_dir().join(format!("palpus-{}-{number}.sock", std::process::id()))
}

struct Driver {
    behaviour: Behaviour,
    line: Line,
    shared: Arc<Shared>,
    begun: Instant,
    due: Instant,
    offer: Option<(u64, u64)>,
    session: Option<u64>,
    offers: u64,
    sent: u64,
    accepted: u64,
    floor: u64,
    withheld: bool,
    wrench: Wrench,
    until: u64,
    heard: Instant,
}

impl Driver {
    fn new(behaviour: Behaviour, line: Line, shared: Arc<Shared>) -> Self {
        let now = Instant::now();
        Self {
            behaviour,
            line,
            shared,
            begun: now,
            due: now,
            offer: None,
            session: None,
            offers: 0,
            sent: 0,
            accepted: 0,
            floor: 1,
            withheld: false,
            wrench: Wrench::ZERO,
            until: 0,
            heard: now,
        }
    }

    fn has(&self, defect: Defect) -> bool {
        self.behaviour.defect == Some(defect)
    }

    fn now_ns(&self) -> u64 {
        self.begun.elapsed().as_nanos() as u64
    }

    fn turn(&mut self) {
        let mut bytes = [0; LONGEST + 64];
        while let Some(length) = self.line.receive(&mut bytes, self.session.is_none()) {
            if length == 0 {
                self.end_session();
                break;
            }
            self.take(&mut bytes[..length]);
        }
        if self.session.is_some() && self.heard.elapsed() > Duration::from_millis(250) {
            self.end_session();
        }
        if self.wrench != Wrench::ZERO && self.now_ns() >= self.until && !self.has(Defect::NeverExpires) {
            self.withhold();
        }
        if self.shared.withheld.load(Ordering::Relaxed) {
            self.withhold();
        }
        let streams = self.session.is_some() || self.has(Defect::StreamsEarly) && self.offer.is_some();
        if streams && !self.shared.silent.load(Ordering::Relaxed) {
            self.send_state();
        }
        let rate = self.behaviour.rate_hz * if self.has(Defect::HalfTheRate) { 0.5 } else { 1.0 };
        self.due = (self.due + Duration::from_secs_f64(1.0 / rate)).max(Instant::now() - Duration::from_millis(20));
        std::thread::sleep(self.due.saturating_duration_since(Instant::now()));
    }

    fn take(&mut self, bytes: &mut [u8]) {
        if self.has(Defect::IgnoresCheck) && bytes.len() > 32 {
            repair(bytes);
        }
        let Ok(Frame { nonce, sequence, body }) = decode(bytes) else { return };
        match body {
            Body::Hello { .. } if self.session.is_none() => self.welcome(nonce, sequence),
            Body::Command(command) => {
                if self.session.is_none() && self.offer.is_some_and(|(_, session)| session == nonce) {
                    self.session = Some(nonce);
                    self.shared.seen.lock().expect("no thread has panicked").session = nonce;
                }
                let ours = self.session == Some(nonce) || self.has(Defect::IgnoresNonce) && self.session.is_some();
                if ours && (sequence > self.accepted || self.has(Defect::IgnoresSequence)) {
                    self.obey(sequence, command);
                }
            }
            Body::Close(_) if self.session == Some(nonce) && !self.has(Defect::GoesOnAfterClose) => self.end_session(),
            _ => {}
        }
    }

    fn welcome(&mut self, hello: u64, sequence: u64) {
        if self.offer.is_none_or(|(answered, _)| answered != hello) {
            self.offers += 1;
            // In a test the nonces need not be unpredictable, only different.
            let session = if self.has(Defect::SameSession) { 7 } else { hello.rotate_left(13) ^ self.offers };
            self.offer = Some((hello, session));
        }
        let session = self.offer.map_or(0, |(_, session)| session);
        let welcome = Welcome {
            session,
            rate_hz: self.behaviour.rate_hz,
            spec: DeviceSpec { force_max: self.behaviour.force_max, ..spec() },
        };
        let mut buffer = [0; LONGEST];
        let mut bytes = encode(&Frame { nonce: hello, sequence, body: Body::Welcome(welcome) }, &mut buffer).to_vec();
        if self.has(Defect::SpeaksVersion2) {
            bytes[4] = 2;
            repair(&mut bytes);
        }
        self.line.send(&bytes);
    }

    fn obey(&mut self, sequence: u64, command: Command) {
        {
            let mut seen = self.shared.seen.lock().expect("no thread has panicked");
            seen.lost_commands += sequence.saturating_sub(self.accepted + 1);
            seen.commands.push(command);
        }
        (self.accepted, self.heard) = (sequence, Instant::now());
        let until = command.time_ns + 1000 * u64::from(command.valid_for_us);
        let knows = (self.floor..=self.sent).contains(&command.echo) || self.has(Defect::PushesUnknowing);
        if command.wrench == Wrench::ZERO {
            self.wrench = Wrench::ZERO;
            self.withheld &= command.echo < self.floor;
        } else if knows && (self.now_ns() < until || self.has(Defect::PushesStale)) {
            (self.wrench, self.withheld) = (command.wrench, false);
            self.until = if self.has(Defect::PushesStale) { until.max(self.now_ns() + 20_000_000) } else { until };
        } else {
            self.withhold();
        }
    }

    fn withhold(&mut self) {
        (self.wrench, self.withheld, self.floor) = (Wrench::ZERO, true, self.sent + 1);
    }

    fn end_session(&mut self) {
        self.line.hang_up();
        (self.offer, self.session, self.sent, self.accepted, self.until) = (None, None, 0, 0, 0);
        (self.floor, self.withheld, self.wrench) = (1, false, Wrench::ZERO);
    }

    fn send_state(&mut self) {
        self.sent += if self.has(Defect::SkipsNumbers) { 2 } else { 1 };
        let askew = if self.has(Defect::PushesAskew) { -1.0 } else { 1.0 };
        let unasked = if self.has(Defect::PushesUnasked) { DVec3::Z } else { DVec3::ZERO };
        let unsaid = self.has(Defect::ExpiresUnsaid);
        let state = State {
            time_ns: if self.has(Defect::ClockStands) { 1 } else { self.now_ns() },
            pose: pose(self.sent, self.behaviour.rate_hz),
            twist: Twist::default(),
            applied: Wrench { torque: self.wrench.torque, force: self.wrench.force * askew + unasked },
            echo: if self.has(Defect::EchoesNothing) { 0 } else { self.accepted },
            buttons: 0,
            flags: READY | if self.withheld && !unsaid { WITHHELD } else { 0 },
        };
        let nonce = self.session.unwrap_or(0);
        let body = match self.behaviour.closes_after {
            Some(count) if self.sent > count => Body::Close(Cow::Borrowed("out of oil")),
            _ => Body::State(state),
        };
        let hostile = {
            let mut seen = self.shared.seen.lock().expect("no thread has panicked");
            seen.applied.push(self.wrench);
            seen.sent = self.sent;
            let count = seen.hostile.len().min(50);
            seen.hostile.drain(..count).collect::<Vec<_>>()
        };
        let mut buffer = [0; LONGEST];
        let state = encode(&Frame { nonce, sequence: self.sent, body }, &mut buffer);
        if hostile.is_empty() {
            return self.line.send(state);
        }
        // The whole flood must arrive, and the state must be sent after it.
        for frame in hostile.iter().map(Vec::as_slice).chain([state]) {
            self.line.send_patiently(frame);
        }
    }
}

/// Replaces the CRC-32 of a frame by the correct value.
pub(crate) fn repair(bytes: &mut [u8]) {
    bytes[12..16].fill(0);
    let check = crc32fast::hash(bytes);
    bytes[12..16].copy_from_slice(&check.to_le_bytes());
}
