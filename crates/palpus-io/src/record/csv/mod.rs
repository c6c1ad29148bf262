//! Recordings as tables of text: header and changes of settings in comments, a line for each tick.

mod reader;
mod writer;

pub(super) use reader::read;
pub(super) use writer::Writer;
