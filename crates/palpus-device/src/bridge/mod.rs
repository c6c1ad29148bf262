//! The bridge: a process of one's own is a haptic device. `docs/bridge.md` specifies the protocol.
//!
//! The *driver* listens on a Unix socket or on a UDP port of this machine; palpus connects.
//!
//! 1. [`BridgeDevice::open`] says hello with a fresh nonce. The driver's welcome has that nonce,
//!    the session's nonce and the device's spec. A command without a wrench begins the session.
//! 2. The driver sends states at its own rate. A thread receives them (`listener`) and leaves the
//!    newest for the loop's next read. Frames with another nonce, an old sequence number, a wrong
//!    CRC or a number out of range are counted and change nothing.
//! 3. The loop's write sends the wrench itself, without waiting: the one system call on its path.
//!    Each command says which state it knows, and for how long after that state, by the device's
//!    own clock, its wrench is valid. Then the driver goes to zero by itself, whatever happened to
//!    palpus, and stays there until a command knows of it.
//! 4. A state is `withheld` while the driver says so, while there is no newer one for 5 ms, and
//!    after the thread has ended a wrench of a loop that was silent.
//! 5. The device is lost if no state comes for a quarter of a second, the connection closes, the
//!    driver says goodbye, or it pushes although it was commanded zero. It does not connect again
//!    by itself: a force would come back unexpectedly.
//!
//! **Why a thread, when the loop could read the socket?** A session must stay alive before the loop
//! begins and while it stalls, and states must not pile up meanwhile: then the first state that the
//! loop sees would be an old one. Writes are not left to the thread, which would have to be woken.

mod address;
mod conformance;
mod fields;
pub mod frame;
mod listener;
mod session;
mod socket;

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use palpus::algebra::Wrench;

use crate::device::{Brake, BrakeFlag, DeviceError, DeviceSpec, DeviceState, HapticDevice, OwnWatchdog};
use crate::found::Finding;
use crate::latest::{Newest, latest};
use crate::safety::SafetyLimits;
use frame::{Command, MOST_VALID_FOR_US, READY};
use listener::{Listener, Sensed, Shared};
use session::Session;

pub use address::BridgeAddress;
pub use conformance::{Check, conformance};

/// Hz: with slower drivers, states would be stale as a matter of course.
const SLOWEST: f64 = 500.0;
/// Hz: the loop's usual rate, for the driver to know and for thresholds.
const USUAL_RATE: f64 = 1000.0;
/// A state that is older is withheld, unless three of the driver's periods are longer.
const STALE_TIME: Duration = Duration::from_millis(5);
const STALE_PERIODS: f64 = 3.0;

/// After so long without a read, the next one waits for a fresh state, at most as long again.
const PAUSE: Duration = Duration::from_millis(100);

/// How to find a driver.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BridgeOptions {
    /// Address at which it listens.
    pub address: BridgeAddress,
    /// `SCHED_FIFO` priority of the thread that receives, where it is allowed; best one above the
    /// loop's. `None` does not ask.
    pub priority: Option<u8>,
}

/// Reason why the bridge has no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BridgeError {
    /// The text is no address.
    #[error("`{0}` is no address of a driver; write the path of its socket, or udp:127.0.0.1:PORT")]
    Address(String),
    /// Only this machine may be asked.
    #[error("{0} is not on this machine; a bridge takes loopback addresses only, such as 127.0.0.1 or [::1]")]
    NotHere(String),
    /// This system has no Unix sockets of packets.
    #[error("`{0}` is a path, and this system has no such sockets; use udp:127.0.0.1:PORT")]
    UdpOnly(String),
    /// No driver listens at the address.
    #[error("no driver listens at {address} ({why}); start it first")]
    NoDriver {
        /// Where.
        address: String,
        /// The reason.
        why: String,
    },
    /// Somebody listens, but does not follow the protocol.
    #[error("the driver at {address} does not speak the bridge's protocol: {why}")]
    NotUnderstood {
        /// Where.
        address: String,
        /// The reason.
        why: String,
    },
    /// The driver's device cannot be used.
    #[error("the driver at {address} cannot be used: {why}")]
    Unusable {
        /// Where.
        address: String,
        /// The reason.
        why: String,
    },
}

/// Counters of the connection so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BridgeCounts {
    /// States that were taken.
    pub states: u64,
    /// States that did not arrive, by the gaps in their numbers.
    pub lost: u64,
    /// Frames that were ignored: damaged, old, or of another session.
    pub ignored: u64,
    /// Commands for which the driver had no room, since it does not read.
    pub unsent: u64,
    /// Commands without a wrench that were sent because the loop had not written.
    pub idle: u64,
}

/// A device behind the bridge; see the module's outline.
pub struct BridgeDevice {
    spec: DeviceSpec,
    notes: Vec<String>,
    states: Newest<Sensed>,
    /// The state that was read last.
    known: Sensed,
    /// When that was.
    read: Option<Instant>,
    /// Wrenches that the thread had ended at the last read.
    interruptions: u64,
    /// Commands that the thread had sent at the last write.
    idle: u64,
    /// Age from which on a state is withheld.
    stale: Duration,
    shared: Arc<Shared>,
    brake: Arc<BridgeBrake>,
    thread: Option<JoinHandle<()>>,
}

impl BridgeDevice {
    /// Connects and begins a session. Takes at most about two seconds.
    ///
    /// # Errors
    /// Fails if there is no driver, or none that can be used; each error says what mends it.
    pub fn open(options: &BridgeOptions) -> Result<Self, BridgeError> {
        let address = &options.address;
        let (session, welcome) = Session::open(address, USUAL_RATE)?;
        if welcome.rate_hz < SLOWEST {
            let why = format!("it sends {} states a second, and {SLOWEST} are needed at least", welcome.rate_hz);
            return Err(BridgeError::Unusable { address: address.to_string(), why });
        }
        let spec = welcome.spec;
        let valid_for = valid_for(&spec);
        let (sequence, state) = session.begin(address)?;
        let shared = Arc::new(Shared::new(session, valid_for));
        let first = Sensed { sequence, state, arrived: Instant::now() };
        let (states_in, states) = latest(first);
        let listener = Listener::new(first, states_in, Arc::clone(&shared));
        let priority = options.priority;
        let thread = std::thread::Builder::new().name("bridge".to_owned()).spawn(move || listener.run(priority));
        let thread =
            thread.map_err(|error| BridgeError::Unusable { address: address.to_string(), why: error.to_string() })?;
        let notes = vec![format!(
            "driver at {address}: {} states a second; a wrench is valid for {:.0} ms",
            welcome.rate_hz,
            valid_for.as_secs_f64() * 1e3
        )];
        let brake = Arc::new(BridgeBrake { flag: BrakeFlag::default(), shared: Arc::clone(&shared) });
        let stale = STALE_TIME.max(Duration::from_secs_f64(STALE_PERIODS / welcome.rate_hz));
        Ok(Self {
            spec,
            notes,
            states,
            known: first,
            read: None,
            interruptions: 0,
            idle: 0,
            stale,
            shared,
            brake,
            thread: Some(thread),
        })
    }

    /// Facts about the driver for the recording.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Counters of the connection so far.
    pub fn counts(&self) -> BridgeCounts {
        let read = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let counts = &self.shared.counts;
        BridgeCounts {
            states: read(&counts.states),
            lost: read(&counts.lost),
            ignored: read(&counts.ignored),
            unsent: read(&counts.unsent),
            idle: read(&counts.idle),
        }
    }

    /// Waits for a fresh state. While a loop starts, the system locks the program's memory, which
    /// holds the thread up; if the loop began with an old state, the next one would look like a
    /// leap of the device's clock.
    fn wait_for_fresh(&mut self) {
        let begun = Instant::now();
        while self.states.get().arrived.elapsed() > self.stale && begun.elapsed() < PAUSE {
            std::thread::sleep(STALE_TIME / 10);
        }
    }

    fn alive(&self) -> Result<(), DeviceError> {
        self.shared.lost.get().map_or(Ok(()), |why| Err(DeviceError::Lost(why.clone())))
    }
}

/// For how long a wrench may be held: as long as the watchdog allows.
fn valid_for(spec: &DeviceSpec) -> Duration {
    let stall = SafetyLimits::of(spec, USUAL_RATE).stall;
    Duration::from_secs_f64(stall.min(1e-6 * f64::from(MOST_VALID_FOR_US)))
}

impl HapticDevice for BridgeDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    /// The newest state; the same one again, with its time, while there is no newer one. Does not
    /// wait, but for a fresh state when a loop begins.
    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.alive()?;
        if self.read.is_none_or(|read| read.elapsed() > PAUSE) {
            self.wait_for_fresh();
        }
        self.read = Some(Instant::now());
        let interruptions = self.shared.interruptions.load(Ordering::Acquire);
        let is_interrupted = interruptions != self.interruptions;
        self.interruptions = interruptions;
        self.known = *self.states.get();
        let Sensed { state, arrived, .. } = self.known;
        Ok(DeviceState {
            pose: state.pose,
            twist: state.twist,
            buttons: state.buttons,
            time: self.shared.seconds(state.time_ns),
            withheld: state.flags != READY || arrived.elapsed() > self.stale || is_interrupted,
        })
    }

    /// Sends the wrench. Does not wait.
    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if !wrench.is_finite() {
            return Err(DeviceError::Refused(Cow::Borrowed("it is not finite")));
        }
        self.alive()?;
        // The brake's order: the number first, then the flag.
        let sequence = self.shared.session.next();
        // A wrench computed before the loop learned of the interruption would bring the old force
        // back at once.
        let is_interrupted = self.shared.interruptions.load(Ordering::Acquire) != self.interruptions;
        let wrench = if is_interrupted || self.brake.is_applied() { Wrench::ZERO } else { *wrench };
        self.idle = self.shared.counts.idle.load(Ordering::Relaxed);
        let Sensed { sequence: echo, state, .. } = self.known;
        let valid_for_us = self.shared.valid_for.as_micros() as u32;
        let command = Command { echo, time_ns: state.time_ns, wrench, valid_for_us };
        self.shared.send(sequence, command).map_err(|error| DeviceError::Lost(Cow::Owned(listener::gone(&error))))
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        let BridgeCounts { lost, ignored, unsent, .. } = self.counts();
        vec![
            ("states lost on the way", lost),
            ("frames ignored", ignored),
            ("commands that the driver had no room for", unsent),
        ]
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.clone())
    }

    /// The thread sends zero when the loop does not write. What the driver does when nothing comes
    /// is for [`conformance`] to test: it takes a force to see it.
    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        let has_bitten = self.shared.counts.idle.load(Ordering::Relaxed) > self.idle;
        Some(OwnWatchdog { after: self.shared.valid_for, has_bitten })
    }
}

impl Drop for BridgeDevice {
    /// Sends zero and closes the session.
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // It has nothing left to tell.
            let _ = thread.join();
        }
        self.shared.session.close("palpus ends the session");
    }
}

/// Sends zero, and has every later command be zero.
///
/// The loop may be between looking at the flag and sending. It takes its command's number before it
/// looks, and this takes one after it has set the flag; so a wrench that got past the flag has a
/// lower number than this zero, and the driver ignores it if it comes later.
struct BridgeBrake {
    flag: BrakeFlag,
    shared: Arc<Shared>,
}

impl Brake for BridgeBrake {
    fn apply(&self) {
        if !self.flag.is_applied() {
            self.flag.apply();
            // A driver that does not hear it takes the force away when it is not valid any more.
            let _ = self.shared.send(self.shared.session.next(), Command::default());
        }
    }

    fn release(&self) {
        self.flag.release();
    }

    fn is_applied(&self) -> bool {
        self.flag.is_applied()
    }
}

/// Drivers are not searched for: one says where they listen.
pub(crate) fn look() -> Vec<Finding> {
    vec![Finding::missing(
        "bridge:/tmp/palpus.sock",
        "a driver of your own",
        "nothing",
        "a bridge's address is yours to choose",
        "write a driver (docs/bridge.md), or start the example: python3 examples/bridge/driver.py /tmp/palpus.sock",
    )]
}
