//! Haptic devices whose makers ship a C library.
//!
//! * [`ForceDimension`] — omega, delta, sigma, lambda and Falcon, through the maker's `libdhd`.
//! * [`OpenHaptics`] — Touch, Touch X and Phantom, through the maker's HDAPI (`libHD`).
//! * [`look`] — which of them are there, and what it takes to find the rest.
//!
//! The libraries are opened while the program runs: nothing is linked, nothing of theirs is in this
//! repository. A missing library is an answer ([`DriverError`]) with the name, the searched places,
//! and the line that mends it. Only the functions that are called are declared, by hand, in `ffi`,
//! the one folder with `unsafe` in it.
//!
//! Both makers' frames are turned into one (`axes`): x to the right of the person at the device, y
//! away from them, z up.
//!
//! Neither was tried on hardware: none was at hand. The tests build stand-ins for both libraries,
//! which export the same names.

mod axes;
mod error;
#[allow(unsafe_code, reason = "the way into libraries of others, and the only one")]
mod ffi;
mod force_dimension;
mod found;
mod library;
mod open_haptics;

pub use error::DriverError;
pub use force_dimension::{ForceDimension, ForceDimensionOptions};
pub use found::look;
pub use library::Place;
pub use open_haptics::{ForceErrors, OpenHaptics, OpenHapticsOptions};
