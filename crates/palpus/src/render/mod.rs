//! One tick: from the probe's state to the device's wrench \[K02 §4.3, §5\].

mod anchor;
#[cfg(test)]
mod changed_tests;
mod contact_rows;
#[cfg(test)]
mod contact_rows_tests;
mod coupling;
mod fit;
mod force_stage;
#[cfg(test)]
mod force_stage_tests;
mod pacer;
mod reach;
mod renderer;
#[cfg(test)]
mod renderer_tests;
mod saturate;
mod scratch;
mod settings;
mod surfaces;
mod tick;
mod tool;
#[cfg(test)]
mod tool_tests;
mod transient;
#[cfg(test)]
mod two_tools_tests;
mod world;

pub use coupling::VirtualCoupling;
pub use fit::{contact_tolerance, tolerance_by_play, tolerance_by_size};
pub use force_stage::{Forces, Motion, force};
pub use pacer::WorkLimit;
pub use renderer::Renderer;
pub use saturate::{Limits, Saturated, Saturation, saturate};
pub use scratch::Scratch;
pub use settings::{Clustering, Settings, SettingsError};
pub use tick::{Counters, ProbeState, StageTimes, Tick, TickSummary, ToolCounters};
pub use transient::Material;
pub use world::{BodyId, Object, ToolId, World, WorldCounters};
