//! palpus as a C library.
//!
//! `include/palpus.h` is generated from this crate. `tests/header.rs` compares the header with the
//! crate, and `docs/c.md` describes the library.
//!
//! * [`handle`] — C code gets numbers, never addresses. A handle that is wrong, old or of another
//!   kind is detected. Using a handle that another thread is using gives an error at once.
//! * [`result`] — each function returns a code. The text of the thread's last error is stored
//!   separately. A panic also becomes a code.
//! * [`mod@pointer`] — checks the pointers from C as far as possible, then copies the values. No
//!   other file reads or writes through pointers.
//!
//! # Safety
//!
//! For all functions: a pointer is null, or it points to as many values as the header says and no
//! other thread writes them during the call. Handles and numbers may have any value.
#![allow(unsafe_code, reason = "exported names and pointers need it; only `pointer` reads or writes through pointers")]
#![allow(non_camel_case_types, reason = "these are the names of the C library")]
#![allow(clippy::missing_safety_doc, reason = "the requirements are the same for all functions: see above")]

pub mod body;
pub mod depth;
pub mod handle;
pub mod pointer;
pub mod query;
pub mod result;
pub mod settings;
pub mod value;
pub mod version;
pub mod world;
pub mod world_functions;
