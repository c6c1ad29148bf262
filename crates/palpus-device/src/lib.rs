//! Hands and clocks: devices, the simulated hand, the servo loop.
//!
//! * [`HapticDevice`] — the seam to hardware: read a state, write a wrench. [`SimulatedDevice`] (a device in a simulated
//!   hand) and [`ReplayDevice`] (a recorded hand) stand behind it as peers of hardware.
//! * [`Servo`] — the loop: read, step, write, once a tick, in real time or as fast as it goes; whatever ends it, the
//!   last wrench written is zero.
//! * [`record`] — rows leave the servo thread through a bounded queue; a full queue drops and counts, it never waits.
//!
//! The loop is generic over what computes the wrench, so nothing here knows geometry.

mod device;
mod recorder;
mod replay;
mod rotation;
mod servo;
mod simulated;

pub use device::{Axes, DeviceError, DeviceSpec, DeviceState, HapticDevice, known_devices};
pub use recorder::{Recorder, Recording, RecordingSummary, record};
pub use replay::ReplayDevice;
pub use servo::{
    Energy, Faults, Percentiles, RunEnd, RunStatistics, Servo, ServoError, ServoOptions, ServoTick, StepOutcome,
    TickObserver, Timing,
};
pub use simulated::{
    Apparatus, Encoder, HAND_PRESETS, HandImpedance, Intent, Jitter, SimulatedDevice, SimulationError,
    SimulationSettings, hand_preset,
};
