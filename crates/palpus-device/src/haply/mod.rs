//! Haply Inverse3, Inverse3x and Minverse with a VerseGrip: a client of the Inverse Service.
//!
//! The service is its maker's program on the user's machine; it speaks JSON over a WebSocket. On
//! connecting it lists its devices; from then on it answers every message with exactly one state,
//! so the sender sets the pace. palpus sends it only forces that were computed for the newest
//! states:
//!
//! 1. [`HaplyDevice::open`] connects (loopback only by default), asks for the service's version,
//!    picks arm and grip, and goes once around with no force.
//! 2. From then on a thread of its own talks to the service (`exchange`). The loop's write wakes
//!    it; it sends that force, waits for the state and leaves it for the loop's next read. Neither
//!    side waits for the other, and the loop does not allocate.
//! 3. A force goes out once. Where there is no new one for 5 ms, nothing goes out but zero.
//! 4. After a state that was late, lost or not to be understood, forces that were computed from
//!    what came before it are withheld: zero goes out until one arrives that knows a newer state.
//! 5. While the arm is not ready or has no power, while its grip is asleep or silent, and wherever
//!    zero goes out in place of a force, the state is [withheld](DeviceState::withheld): the loop
//!    knows, and returns from zero (`exchange`).
//! 6. The force that the service reports is compared with the command (`echo`).
//! 7. The device is lost if no state comes for a quarter of a second, the connection closes, or the
//!    device is gone; the error says why. It does not connect again by itself: a force would come
//!    back unexpectedly.
//!
//! **Latency.** A state is sampled when the service answers the last tick's force, so it is one
//! period old when the loop reads it; a client without a thread would read the same one. The thread
//! adds the time in which the system wakes it (tens of microseconds) to the way of a force. What
//! lies between service and motors is not stated; [`DeviceSpec::delay`] is set to one millisecond
//! for it.
//!
//! **Frame.** +X to the right, +Y forward, +Z up, metres, about the service's origin. The arm
//! drives three axes; rotation is sensed by the grip, whose sensor may be as slow as 50 Hz (`grip`
//! says what is made of that). Without a grip, rotation is not sensed.
//!
//! Built against the protocol as documented and tested against scripted services; no device was at
//! hand.

mod address;
mod echo;
mod exchange;
mod grip;
mod http;
mod look;
pub mod message;
mod opening;
mod senses;
mod version;
mod wire;

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;

use palpus::algebra::Wrench;

use crate::device::{Brake, BrakeFlag, DeviceError, DeviceSpec, DeviceState, HapticDevice, OwnWatchdog};
use crate::latest::{Newest, Publisher, latest};
use exchange::{Command, Exchange, Sensed};

pub use address::HAPLY_ADDRESS;
pub(crate) use look::look;

/// How to find the device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HaplyOptions {
    /// Address of the service: `ws://HOST:PORT`.
    pub address: String,
    /// Allows a service on another machine.
    pub beyond_loopback: bool,
    /// The arm's id, such as `049D`; `None`: the only one, or the first.
    pub arm: Option<String>,
    /// `SCHED_FIFO` priority of the thread that talks to the service, where it is allowed; best one
    /// above the loop's. `None` does not ask.
    pub priority: Option<u8>,
}

impl Default for HaplyOptions {
    /// The first arm of the service on this machine, an ordinary thread.
    fn default() -> Self {
        Self { address: HAPLY_ADDRESS.to_owned(), beyond_loopback: false, arm: None, priority: None }
    }
}

/// Why there is no Haply device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HaplyError {
    /// The address is invalid.
    #[error("`{0}` is no address of a service; write ws://localhost:10001")]
    Address(String),
    /// Only this machine may be asked.
    #[error("{0} is not on this machine; forces over a network come late, so it has to be asked for by its address")]
    NotHere(String),
    /// No service answers.
    #[error("nothing answers at {address} ({why})")]
    NoService {
        /// Where.
        address: String,
        /// The reason.
        why: String,
    },
    /// Somebody answers, but not as the service does.
    #[error("{address} answers, but not as the Inverse Service does: {why}")]
    NotUnderstood {
        /// Where.
        address: String,
        /// The reason.
        why: String,
    },
    /// The service has no arm, or not the one that was asked for.
    #[error("the Inverse Service at {address} has {why}")]
    NoDevice {
        /// Where.
        address: String,
        /// The reason.
        why: String,
    },
    /// It has one that cannot be used yet.
    #[error("{device} is {why}")]
    NotReady {
        /// Which.
        device: String,
        /// The reason.
        why: String,
    },
}

/// A Haply arm, behind the service; see the module's outline.
pub struct HaplyDevice {
    spec: DeviceSpec,
    notes: Vec<String>,
    states: Newest<Sensed>,
    commands: Publisher<Command>,
    /// Number of the last state that was read.
    known: u64,
    /// Number of the last interruption of the commanded force.
    gap: u64,
    /// Number of the last command.
    serial: u64,
    /// Messages of no force that had been sent for want of a command at the last one.
    idle: u64,
    shared: Arc<Shared>,
    brake: Arc<BrakeFlag>,
    thread: Option<JoinHandle<()>>,
}

/// State shared by the loop and the thread besides device states and commands.
#[derive(Default)]
struct Shared {
    /// The device is not needed any more.
    over: AtomicBool,
    /// Why there are no more states.
    lost: OnceLock<Cow<'static, str>>,
    counts: Counts,
}

#[derive(Default)]
struct Counts {
    states: AtomicU64,
    late: AtomicU64,
    bad: AtomicU64,
    extra: AtomicU64,
    otherwise: AtomicU64,
    withheld: AtomicU64,
    idle: AtomicU64,
}

/// Counters of the connection so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HaplyCounts {
    /// States that were understood.
    pub states: u64,
    /// Answers that did not come in time.
    pub late: u64,
    /// Answers that were not understood.
    pub bad: u64,
    /// Unrequested states.
    pub extra: u64,
    /// States that report another force than the command.
    pub otherwise: u64,
    /// Forces that were not sent because they were computed from too old a state, or because the
    /// device was not ready.
    pub withheld: u64,
    /// Messages of no force that were sent because the loop had not written.
    pub idle: u64,
}

impl HaplyDevice {
    /// Connects, and goes around without a force until it is known how the grip is held. Takes at
    /// most about five seconds.
    ///
    /// # Errors
    /// When there is no service, no device, or none that can be used; each says what mends it as
    /// far as it is known.
    pub fn open(options: &HaplyOptions) -> Result<Self, HaplyError> {
        let opened = opening::open(options)?;
        let (states_in, states) = latest(Sensed::first(opened.first));
        let (commands, commands_out) = latest(Command::default());
        let shared = Arc::new(Shared::default());
        let brake = Arc::new(BrakeFlag::default());
        let spec = opened.spec.clone();
        let notes = opened.notes.clone();
        let address = options.address.clone();
        let exchange = Exchange::new(opened, states_in, commands_out, Arc::clone(&shared), Arc::clone(&brake));
        let priority = options.priority;
        let thread = std::thread::Builder::new().name("haply".to_owned()).spawn(move || exchange.run(priority));
        let thread = thread.map_err(|error| HaplyError::NoService { address, why: error.to_string() })?;
        Ok(Self {
            spec,
            notes,
            states,
            commands,
            known: 0,
            gap: 0,
            serial: 0,
            idle: 0,
            shared,
            brake,
            thread: Some(thread),
        })
    }

    /// Facts about service and device for the recording: versions, filters and others.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Counters of the connection so far.
    pub fn counts(&self) -> HaplyCounts {
        let Counts { states, late, bad, extra, otherwise, withheld, idle } = &self.shared.counts;
        let read = |count: &AtomicU64| count.load(Ordering::Relaxed);
        HaplyCounts {
            states: read(states),
            late: read(late),
            bad: read(bad),
            extra: read(extra),
            otherwise: read(otherwise),
            withheld: read(withheld),
            idle: read(idle),
        }
    }

    fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }

    fn alive(&self) -> Result<(), DeviceError> {
        self.shared.lost.get().map_or(Ok(()), |why| Err(DeviceError::Lost(why.clone())))
    }
}

impl HapticDevice for HaplyDevice {
    fn spec(&self) -> &DeviceSpec {
        &self.spec
    }

    fn counts(&self) -> Vec<(&'static str, u64)> {
        let HaplyCounts { late, bad, extra, otherwise, withheld, .. } = self.counts();
        vec![
            ("answers too late", late),
            ("answers not understood", bad),
            ("states not asked for", extra),
            ("forces other than the command", otherwise),
            ("forces withheld", withheld),
        ]
    }

    /// The newest state; the same one again, with its time, while there is no newer one. Does not
    /// wait.
    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.alive()?;
        let Sensed { mut state, index, gap } = *self.states.get();
        state.withheld |= gap != self.gap;
        (self.known, self.gap) = (index, gap);
        Ok(state)
    }

    /// Hands the force to the thread, which sends it at once. Does not wait.
    fn write(&mut self, wrench: &Wrench) -> Result<(), DeviceError> {
        if !wrench.is_finite() {
            return Err(DeviceError::Refused(Cow::Borrowed("it is not finite")));
        }
        self.alive()?;
        self.serial += 1;
        self.idle = self.counts().idle;
        let Self { serial, known, gap, .. } = *self;
        self.commands.publish(Command { serial, force: wrench.force, knows: known, gap });
        self.wake();
        Ok(())
    }

    fn brake(&self) -> Option<Arc<dyn Brake>> {
        Some(self.brake.clone())
    }

    /// The thread sends zero when the loop does not write. If the thread stops, the service lets
    /// the arm idle.
    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        Some(OwnWatchdog { after: exchange::IDLE_TIME, has_bitten: self.counts().idle > self.idle })
    }
}

impl Drop for HaplyDevice {
    /// Sends zero, says goodbye and closes.
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Release);
        self.wake();
        if let Some(thread) = self.thread.take() {
            // It has nothing left to tell.
            let _ = thread.join();
        }
    }
}
