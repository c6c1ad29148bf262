//! Hands and clocks: devices, the simulated hand, the servo loop.
//!
//! * [`HapticDevice`] — the seam to hardware: read a state, write a wrench. [`SimulatedDevice`] (a
//!   device in a simulated hand) and [`ReplayDevice`] (a recorded hand) stand behind it as peers of
//!   hardware.
//! * [`BridgeDevice`] — a process of one's own is a device, by the protocol in [`bridge_frames`];
//!   [`conformance`] tests such a process.
//! * [`HaplyDevice`] — Haply's arms through their service; [`SpaceMouse`] — input without force;
//!   [`PlacedDevice`] sets a device down where a scene begins. [`look`] tells what is there, and of
//!   the rest what it would take.
//! * [`Servo`] — the loop: read, step, write, once a tick, in real time or as fast as it goes;
//!   whatever ends it, the last wrench written is zero.
//! * [`SafetyChain`] — what stands between a computed wrench and the hand, in every tick; with the
//!   [`Gate`] before the step and the [`Watch`] beside the loop. [`FaultyDevice`] is how all that
//!   is tried.
//! * [`self_test`] — of a device, before anybody is given a force by it.
//! * [`claim`] — what an operating system has for a loop that must not be late: priority, locked
//!   memory, a core of its own, which [`leave_core`] has others leave.
//! * [`latest`] — whatever is slower than the loop (a window, a live line) sees the newest value.
//! * [`record`] — rows leave the servo thread through a bounded queue; a full queue drops and
//!   counts, it never waits.
//!
//! The loop is generic over what computes the wrench, so nothing here knows geometry.

mod acting;
mod bridge;
mod device;
mod faulty;
mod found;
mod haply;
mod latest;
mod placed;
mod realtime;
mod recorder;
mod replay;
mod safety;
mod self_test;
mod sensed_work;
mod servo;
mod simulated;
mod spacemouse;

pub use bridge::frame as bridge_frames;
pub use bridge::{BridgeAddress, BridgeCounts, BridgeDevice, BridgeError, BridgeOptions, Check, conformance};
pub use device::{
    Axes, Brake, BrakeFlag, DeviceError, DeviceSpec, DeviceState, HapticDevice, OwnWatchdog, known_devices,
};
pub use faulty::{Fault, FaultyDevice, Script, StepFaults};
pub use found::{Finding, FindingState, known_device, look};
pub use haply::message as haply_messages;
pub use haply::{HAPLY_ADDRESS, HaplyCounts, HaplyDevice, HaplyError, HaplyOptions};
pub use latest::{Newest, Publisher, latest, latest_of};
pub use placed::PlacedDevice;
pub use realtime::{Claimed, RealTimeClaims, RealTimeOptions, claim, leave_core};
pub use recorder::{Recorder, Recording, RecordingSummary, Sink, record};
pub use replay::ReplayDevice;
pub use safety::{
    Admitted, AfterFault, AfterPanic, ContactAccount, Cut, Cuts, DEVICE_BUTTONS, EnergyAccount, Engagement, Gate,
    HOLD_KEY, LimitLine, Passivity, Phase, REARM_KEY, Rearm, SafetyChain, SafetyCounters, SafetyLimits, SafetyOptions,
    Shaped, Watch,
};
pub use self_test::{SelfTest, SelfTestError, self_test};
pub use servo::{
    Energy, LATE, LoopTime, Percentiles, RunControl, RunEnd, RunStatistics, Servo, ServoError, ServoOptions, ServoTick,
    StepOutcome, TickObserver, Timing, VirtualTime, WallTime,
};
pub use simulated::{
    Apparatus, Encoder, Guide, Guided, HAND_PRESETS, HandImpedance, Intent, Jitter, SimulatedDevice, SimulationError,
    SimulationSettings, hand_preset,
};
pub use spacemouse::{SpaceMouse, SpaceMouseError};
