//! One tick: from the probe's state to the wrench in the hand \[K02 §4.3, §5\].

mod renderer;
mod saturate;
mod scratch;
mod settings;
mod tick;

pub use saturate::{Limits, Saturated, Saturation, saturate};
pub use settings::{Settings, SettingsError};
