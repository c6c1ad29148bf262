//! Haply Inverse3, Inverse3x and Minverse with a VerseGrip, through the Inverse Service.
//!
//! The Inverse Service is the maker's program on the user's machine. The service exchanges JSON
//! messages over a WebSocket. After a connection, the service lists its devices. Then it answers
//! every message with exactly one state, so the client sets the pace. palpus sends only
//! forces that are based on the newest states:
//!
//! 1. [`HaplyDevice::open`] connects (to loopback addresses only, by default), requests the
//!    service's version, selects arm and grip, and exchanges one message with zero force.
//! 2. Then a separate thread exchanges messages with the service (`exchange`). The loop's write
//!    wakes the thread, which sends the force, waits for the state and publishes it for the loop's
//!    next read. Neither side waits for the other, and the loop does not allocate.
//! 3. Each force is sent once. If there is no new force for 5 ms, zero is sent.
//! 4. After a late, lost or invalid answer, forces based on earlier states are not sent. Zero is
//!    sent until a force is based on a newer state.
//! 5. The state is [withheld](DeviceState::withheld) while the arm is not ready or has no power,
//!    while the grip is asleep or silent, and whenever zero is sent in place of a force. So the
//!    loop learns of each gap, and its force starts again from zero (`exchange`).
//! 6. The force that the service reports is compared with the commanded force (`echo`).
//! 7. The device is lost if no state arrives for a quarter of a second, if the connection closes,
//!    or if the arm or grip is missing. The error says why. palpus does not reconnect by itself,
//!    since the force would return unexpectedly.
//!
//! **Latency.** The service samples a state when it answers the force of the last tick, so the
//! state is one period old when the loop reads it. A client without a thread would read the same
//! state. The thread adds its wake-up time (tens of microseconds) to the delay of a force. The
//! delay between service and motors is not documented; [`DeviceSpec::delay`] assumes one
//! millisecond.
//!
//! **Frame.** +X points to the right, +Y forward, +Z up, in metres, about the service's origin. The
//! arm actuates three translational axes. The grip senses the rotation, with a sensor that may be
//! as slow as 50 Hz (`grip` describes the filter). Without a grip, rotation is not sensed.
//!
//! This client follows the documented protocol and was tested against scripted services. No device
//! was available.

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

/// Options of the connection to a Haply device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HaplyOptions {
    /// Address of the service: `ws://HOST:PORT`.
    pub address: String,
    /// Allows a service on another machine.
    pub beyond_loopback: bool,
    /// Id of the arm, such as `049D`; `None` for the first arm.
    pub arm: Option<String>,
    /// `SCHED_FIFO` priority of the exchange thread, if the thread may have a priority. It should
    /// be the loop's priority plus one. `None` requests no priority.
    pub priority: Option<u8>,
}

impl Default for HaplyOptions {
    /// Selects the first arm of the service on this machine. The exchange thread has ordinary
    /// priority.
    fn default() -> Self {
        Self { address: HAPLY_ADDRESS.to_owned(), beyond_loopback: false, arm: None, priority: None }
    }
}

/// The reason why there is no Haply device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HaplyError {
    /// The address is invalid.
    #[error("`{0}` is not the address of a service; write ws://localhost:10001")]
    Address(String),
    /// The service is on another machine, which the options do not allow.
    #[error(
        "{0} is not on this machine; forces over a network are late, so such a service is used only if you give its address"
    )]
    NotHere(String),
    /// No service answers.
    #[error("no service answers at {address} ({why})")]
    NoService {
        /// Address of the service.
        address: String,
        /// The reason.
        why: String,
    },
    /// The program at the address is not a supported Inverse Service.
    #[error("the program at {address} does not answer as the Inverse Service does: {why}")]
    NotUnderstood {
        /// Address of the service.
        address: String,
        /// The reason.
        why: String,
    },
    /// The service has no arm, or not the requested arm.
    #[error("the Inverse Service at {address} has {why}")]
    NoDevice {
        /// Address of the service.
        address: String,
        /// The reason.
        why: String,
    },
    /// The service has a device that cannot be used yet.
    #[error("{device} is {why}")]
    NotReady {
        /// Name of the device.
        device: String,
        /// The reason.
        why: String,
    },
}

/// A Haply arm behind the Inverse Service; the module describes the connection.
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
    /// Number of zero messages that the thread had sent at the last write.
    idle: u64,
    shared: Arc<Shared>,
    brake: Arc<BrakeFlag>,
    thread: Option<JoinHandle<()>>,
}

/// Data that the loop and the exchange thread share, besides states and commands.
#[derive(Default)]
struct Shared {
    /// True if the device is no longer needed.
    over: AtomicBool,
    /// The reason why no more states will arrive; unset while states arrive.
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

/// Counters of the connection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HaplyCounts {
    /// Number of valid states.
    pub states: u64,
    /// Number of answers that were late.
    pub late: u64,
    /// Number of invalid answers.
    pub bad: u64,
    /// Number of unrequested messages.
    pub extra: u64,
    /// Number of states that report another force than the commanded force.
    pub otherwise: u64,
    /// Number of forces that were not sent, because they were based on an old state or the device
    /// was not ready.
    pub withheld: u64,
    /// Number of zero messages that were sent because the loop had not written.
    pub idle: u64,
}

impl HaplyDevice {
    /// Connects, and sends zero until the grip has reported its orientation. Takes at most about
    /// five seconds.
    ///
    /// # Errors
    /// Fails if there is no service, no device, or no device that can be used. Each error says how
    /// to fix the problem, if a remedy is known.
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

    /// Returns facts about service and device for the recording, such as versions and filters.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Returns the counters of the connection so far.
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
            ("late answers", late),
            ("invalid answers", bad),
            ("unrequested messages", extra),
            ("forces that differ from the command", otherwise),
            ("forces withheld", withheld),
        ]
    }

    /// Returns the newest state. Until a newer state arrives, `read` returns the same state with
    /// the same time. Does not wait.
    fn read(&mut self) -> Result<DeviceState, DeviceError> {
        self.alive()?;
        let Sensed { mut state, index, gap } = *self.states.get();
        state.withheld |= gap != self.gap;
        (self.known, self.gap) = (index, gap);
        Ok(state)
    }

    /// Passes the force to the exchange thread, which sends it at once. Does not wait.
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

    /// The exchange thread sends zero when the loop does not write. If the thread stops, the
    /// service sets the arm's force to zero.
    fn own_watchdog(&mut self) -> Option<OwnWatchdog> {
        Some(OwnWatchdog { after: exchange::IDLE_TIME, has_bitten: self.counts().idle > self.idle })
    }
}

impl Drop for HaplyDevice {
    /// Sends zero and closes the connection.
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Release);
        self.wake();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread needs no reaction here.
            let _ = thread.join();
        }
    }
}
