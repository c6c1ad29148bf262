//! Haptic devices whose makers provide a C library.
//!
//! * [`ForceDimension`] — omega, delta, sigma, lambda and Falcon, through the maker's `libdhd`.
//! * [`OpenHaptics`] — Touch, Touch X and Phantom, through the maker's HDAPI (`libHD`).
//! * [`look`] — the devices that are connected, and for the others what is missing.
//!
//! The libraries are loaded at run time. Nothing is linked, and this repository contains no
//! files of the makers. If a library is missing, the error ([`DriverError`]) states the library's
//! name, the searched folders, and how to install the library. The folder `ffi` is the only one
//! with `unsafe`. Its hand-written declarations cover only the functions that are called.
//!
//! The makers' frames are converted to palpus's frame (`axes`): x to the user's right, y away from
//! the user, z up.
//!
//! Neither driver was tested on hardware, because no device was available. The tests build a
//! stand-in for each library, which exports the same names.

mod axes;
mod error;
#[allow(unsafe_code, reason = "calls of the makers' libraries need it; no other folder has it")]
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
