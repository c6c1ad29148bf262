//! Recordings as CSV: the header and changes of settings are comments; each tick is a line.

mod reader;
mod writer;

pub(super) use reader::read;
pub(super) use writer::Writer;
