//! Recordings as Parquet files: the columns of [`column_names`](crate::record::column_names) and an
//! additional column `change`.
//!
//! 1. Rows are collected into row groups. Each piece consists of a row group and a footer that
//!    lists all groups, and is appended to the file. If the program is killed, the file is readable
//!    up to its last piece. Older footers remain in the file as unused bytes.
//! 2. Many small groups would make every footer long. When the small groups contain
//!    [`writer::MERGED`] rows, one large group with the same rows is appended and replaces them.
//! 3. At the end, the groups in use are copied to a new file, which replaces the old file.
//!
//! Each column of a group is one plain, uncompressed page; `depth_us` and `change` are optional.
//! The metadata `palpus` of the file contains the header. `change` contains text in the first
//! row that was computed with other settings: a line of TOML for each change.
//!
//! The layout follows <https://parquet.apache.org/docs/file-format/>. [`read`] supports only the
//! output of [`Writer`]. The tests read this output with other programs.

mod meta;
mod reader;
mod thrift;
mod writer;

pub(super) use meta::MAGIC;
pub(super) use reader::read;
pub(super) use writer::{Writer, compact};
