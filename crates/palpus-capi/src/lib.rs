//! palpus as a C library.
//!
//! `include/palpus.h` is made of this crate (`tests/header.rs` compares the two), `docs/c.md` is
//! its page.
//!
//! * [`handle`] — C holds numbers, never addresses. A handle that is wrong, old or of another kind
//!   is found out. A handle that another thread is using gives an error at once.
//! * [`result`] — each function gives a code; the text beside it is the thread's last error. A
//!   panic ends in a code too.
//! * [`mod@pointer`] — what C's pointers point to is copied here, after the checks that can be
//!   made; the only file that reads or writes through them.
//!
//! # Safety
//!
//! For all functions: a pointer is null or points to as many values as the header says, and no
//! other thread writes them meanwhile. Handles and numbers may be anything.
#![allow(unsafe_code, reason = "C's names and pointers need it; through pointers goes `pointer` alone")]
#![allow(non_camel_case_types, reason = "they are the C library's names")]
#![allow(clippy::missing_safety_doc, reason = "it is the same for all functions: see above")]

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
