//! The version of the library.

use std::ffi::c_char;

use crate::result::{Fault, entry, palpus_result};

/// ABI version of this header. The version increases whenever a structure or an existing function
/// changes. New functions do not increase the version.
pub const PALPUS_ABI_VERSION: u32 = 3;

/// Returns the library's version as text, such as "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn palpus_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Returns the library's PALPUS_ABI_VERSION.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_abi_version() -> u32 {
    PALPUS_ABI_VERSION
}

/// Fails with PALPUS_ERROR_ABI if the library has another ABI version than the header that your
/// program was compiled with. Call `palpus_check_abi(PALPUS_ABI_VERSION)` before any other
/// function.
#[unsafe(no_mangle)]
pub extern "C" fn palpus_check_abi(header_version: u32) -> palpus_result {
    entry(|| {
        if header_version == PALPUS_ABI_VERSION {
            return Ok(());
        }
        Err(Fault::new(
            palpus_result::PalpusErrorAbi,
            format!(
                "the program was compiled with a palpus.h of ABI {header_version}, but the library has ABI \
                 {PALPUS_ABI_VERSION}; compile the program with the library's own header"
            ),
        ))
    })
}
