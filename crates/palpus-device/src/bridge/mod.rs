//! The bridge: connects a haptic device whose driver is a separate process. `docs/bridge.md`
//! specifies the protocol.
//!
//! The *driver* listens on a Unix socket or on a UDP port of this machine, and palpus connects
//! to it.
//!
//! 1. [`BridgeDevice::open`] sends a hello with a new nonce. The driver's welcome repeats this
//!    nonce and adds the session's nonce and the device's description. A command without a wrench
//!    begins the session.
//! 2. The driver sends states at its own rate. A thread (`listener`) receives the states and keeps
//!    the newest state for the loop's next read. Frames with another nonce, an old sequence number,
//!    a wrong CRC or a number out of range are counted and ignored.
//! 3. The loop's write sends the wrench directly, without waiting. This send is the only system
//!    call on the loop's path. Each command names the state on which it is based. The command also
//!    says how long after that state, by the device's clock, its wrench stays valid. After this
//!    time the driver goes to zero by itself, whatever has happened to palpus. The driver stays at
//!    zero until a command is based on a later state.
//! 4. A state is `withheld` if the driver says so, or if no newer state has arrived for 5 ms. It is
//!    also withheld if the thread has ended a wrench because the loop did not write.
//! 5. The device is lost if no state arrives for a quarter of a second, if the connection or the
//!    session is closed, or if the driver applies a force although zero was commanded. palpus does
//!    not reconnect by itself, since the force would return unexpectedly.
//!
//! **Why a thread?** A session must stay open before the loop starts and while it stalls. Without
//! the thread, states would also pile up in the socket in that time, and the loop would read an old
//! state first. Writes do not go through the thread, since each write would have to wake it.

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

/// Lowest rate of a driver, Hz. At lower rates every state would be too old.
const SLOWEST: f64 = 500.0;
/// Usual rate of the loop, Hz. The hello tells this rate to the driver, and the thresholds are
/// computed from the rate.
const USUAL_RATE: f64 = 1000.0;
/// A state older than this is withheld, unless [`STALE_PERIODS`] periods of the driver are longer.
const STALE_TIME: Duration = Duration::from_millis(5);
const STALE_PERIODS: f64 = 3.0;

/// After this time without a read, the next read waits for a new state, at most this long.
const PAUSE: Duration = Duration::from_millis(100);

/// Options of the bridge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BridgeOptions {
    /// Address at which the driver listens.
    pub address: BridgeAddress,
    /// `SCHED_FIFO` priority of the listener thread, if the thread may have a priority. It should
    /// be the loop's priority plus one. `None` requests no priority.
    pub priority: Option<u8>,
}

/// The reason why the bridge has no device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BridgeError {
    /// The text is not a valid address.
    #[error("`{0}` is not the address of a driver; write the path of its socket, or udp:127.0.0.1:PORT")]
    Address(String),
    /// The address is on another machine.
    #[error("{0} is not on this machine; a bridge accepts loopback addresses only, such as 127.0.0.1 or [::1]")]
    NotHere(String),
    /// This system has no Unix sockets of type `SOCK_SEQPACKET`.
    #[error("`{0}` is the path of a Unix socket, which this system does not support; use udp:127.0.0.1:PORT")]
    UdpOnly(String),
    /// No driver listens at the address.
    #[error("no driver listens at {address} ({why}); start the driver first")]
    NoDriver {
        /// Address of the driver.
        address: String,
        /// The reason.
        why: String,
    },
    /// The program at the address does not follow the protocol.
    #[error("the driver at {address} does not follow the bridge protocol: {why}")]
    NotUnderstood {
        /// Address of the driver.
        address: String,
        /// The reason.
        why: String,
    },
    /// The driver's device cannot be used.
    #[error("the driver at {address} cannot be used: {why}")]
    Unusable {
        /// Address of the driver.
        address: String,
        /// The reason.
        why: String,
    },
}

/// Counters of the connection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BridgeCounts {
    /// Number of received states.
    pub states: u64,
    /// Number of states that did not arrive, from gaps in the sequence numbers.
    pub lost: u64,
    /// Number of ignored frames: damaged, old, or of another session.
    pub ignored: u64,
    /// Number of commands that were not sent, since the driver does not read its queue.
    pub unsent: u64,
    /// Number of zero commands that were sent because the loop had not written.
    pub idle: u64,
}

/// A device behind the bridge; the module describes the connection.
pub struct BridgeDevice {
    spec: DeviceSpec,
    notes: Vec<String>,
    states: Newest<Sensed>,
    /// The state that was read last.
    known: Sensed,
    /// Time of the last read.
    read: Option<Instant>,
    /// Number of wrenches that the listener had replaced with zero at the last read.
    interruptions: u64,
    /// Number of zero commands that the listener had sent at the last write.
    idle: u64,
    /// Age from which a state is withheld.
    stale: Duration,
    shared: Arc<Shared>,
    brake: Arc<BridgeBrake>,
    thread: Option<JoinHandle<()>>,
}

impl BridgeDevice {
    /// Connects to the driver and begins a session. Takes at most about two seconds.
    ///
    /// # Errors
    /// Fails if there is no driver, or if its device cannot be used. Each error says how to fix the
    /// problem.
    pub fn open(options: &BridgeOptions) -> Result<Self, BridgeError> {
        let address = &options.address;
        let (session, welcome) = Session::open(address, USUAL_RATE)?;
        if welcome.rate_hz < SLOWEST {
            let why = format!("it sends {} states a second, but at least {SLOWEST} are needed", welcome.rate_hz);
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

    /// Returns facts about the driver for the recording.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns the counters of the connection so far.
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

    /// Waits for a new state. While a loop starts, the system locks the program's memory, which
    /// delays the listener thread. If the loop began with an old state, the next state would look
    /// like a jump of the device's clock.
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

/// Returns the time for which a wrench is valid: the time that the watchdog allows.
fn valid_for(spec: &DeviceSpec) -> Duration {
    let stall = SafetyLimits::of(spec, USUAL_RATE).stall;
    Duration::from_secs_f64(stall.min(1e-6 * f64::from(MOST_VALID_FOR_US)))
}

impl HapticDevice for BridgeDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    /// Returns the newest state. Until a newer state arrives, `read` returns the same state with
    /// the same time. Does not wait, except for a new state when a loop starts.
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
        // The write takes the number before it checks the brake's flag; `BridgeBrake` relies on
        // this order.
        let sequence = self.shared.session.next();
        // A wrench that was computed before the loop saw the interruption must not bring the old
        // force back.
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
            ("states lost in transit", lost),
            ("frames ignored", ignored),
            ("commands not sent, since the driver did not read", unsent),
        ]
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.clone())
    }

    /// The listener thread sends zero when the loop does not write. Only [`conformance`] tests what
    /// the driver does without commands, since that test needs a force.
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
            // A panic of the thread needs no reaction here.
            let _ = thread.join();
        }
        self.shared.session.close("palpus ends the session");
    }
}

/// Brake of a bridge device: sends zero, and makes every later command zero.
///
/// The loop may be between the check of the flag and the send. The loop takes the number of its
/// command before it checks the flag, and the brake takes a number after it has set the flag. So a
/// wrench that passed the check has a lower number than this zero command, and the driver
/// ignores it if it arrives later.
struct BridgeBrake {
    flag: BrakeFlag,
    shared: Arc<Shared>,
}

impl Brake for BridgeBrake {
    fn apply(&self) {
        if !self.flag.is_applied() {
            self.flag.apply();
            // If the zero does not reach the driver, the force ends when the last wrench expires.
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

/// Returns no device: the search does not look for drivers, since the user chooses their addresses.
pub(crate) fn look() -> Vec<Finding> {
    vec![Finding::missing(
        "bridge:/tmp/palpus.sock",
        "a driver that you write",
        "nothing",
        "drivers are not searched for, since you choose their address",
        "write a driver (docs/bridge.md), or start the example: python3 examples/bridge/driver.py /tmp/palpus.sock",
    )]
}
