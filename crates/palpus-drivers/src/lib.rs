//! Haptic devices whose makers ship a C library.
//!
//! * [`ForceDimension`] — omega, delta, sigma, lambda and Falcon, through the maker's `libdhd`.
//! * [`OpenHaptics`] — Touch, Touch X and Phantom, through the maker's HDAPI (`libHD`).
//! * [`look`] — which of them are there, and what it takes to find the rest.
//!
//! The libraries are opened while the program runs: nothing is linked, nothing of theirs is in this
//! repository. If a library is missing, the error ([`DriverError`]) has its name, the searched
//! places, and the command that helps. The folder `ffi`, the only one with `unsafe`, declares by
//! hand just the functions that are called.
//!
//! Both makers' frames are converted to ours (`axes`): x to the user's right, y away from the user,
//! z up.
//!
//! Neither driver was tested on hardware, since none was available. The tests build stand-ins for
//! both libraries, which export the same names.

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
