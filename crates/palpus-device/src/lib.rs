//! Haptic devices, the simulated operator, the servo loop and its safety chain.
//!
//! * [`HapticDevice`] is the interface to a device: read a state, write a wrench.
//!   [`SimulatedDevice`] (a device that a simulated operator holds) and [`ReplayDevice`] (a
//!   recorded motion) implement it, as real devices do.
//! * [`BridgeDevice`] connects a device whose driver is another process, by the protocol in
//!   [`bridge_frames`]. [`conformance`] tests such a driver.
//! * [`HaplyDevice`] connects Haply's arms through their service. [`SpaceMouse`] is an input device
//!   without force. [`PlacedDevice`] moves the workspace of a device to the start of a scene.
//! * [`look`] lists the devices found on this machine, and what is missing to use others.
//! * [`Servo`] is the loop: read, step and write in each tick, in real time or as fast as possible.
//!   However the loop ends, the last wrench that it writes is zero.
//! * [`SafetyChain`] limits each wrench before it reaches the hand. The [`Gate`] checks each device
//!   state before the step, and the [`Watch`] checks the loop from another thread. [`FaultyDevice`]
//!   injects faults for tests of the chain, the gate and the watch.
//! * [`self_test`] tests a device before it gives force to a person.
//! * [`claim`] requests from the operating system what a real-time loop needs: priority, locked
//!   memory and a core of its own. [`leave_core`] moves the other threads off that core.
//! * [`latest`] gives slower readers, such as a window, the newest value of the loop.
//! * [`record`] passes rows from the servo thread to a writer through a bounded queue. If the
//!   queue is full, the servo thread drops and counts rows, and never waits.
//!
//! The loop is generic over the step that computes the wrench. Nothing here depends on geometry.

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
pub use realtime::{Claimed, HelperThread, RealTimeClaims, RealTimeOptions, claim, leave_core};
pub use recorder::{Recorder, Recording, RecordingSummary, Sink, record};
pub use replay::ReplayDevice;
pub use safety::{
    Admitted, AfterFault, AfterPanic, ContactAccount, Cut, Cuts, DEVICE_BUTTONS, EnableMode, EnergyAccount, Gate,
    HOLD_KEY, LimitLine, Phase, REARM_KEY, Rearm, SafetyChain, SafetyCounters, SafetyLimits, SafetyOptions, Shaped,
    Watch,
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
