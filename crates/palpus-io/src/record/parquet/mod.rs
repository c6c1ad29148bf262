//! Recordings as Parquet files: the columns of [`column_names`](crate::record::column_names) and
//! one more, `change`.
//!
//! 1. Rows are gathered into row groups; a row group and a footer over all groups so far are one
//!    piece, appended. If the program is killed, the file is readable up to its last piece. Older
//!    footers remain in the file as unused bytes.
//! 2. Many small groups would make every footer long: when they hold [`writer::MERGED`] rows, one
//!    large group is appended and stands for all of them.
//! 3. At the end the living groups are copied into a new file, which replaces the old one.
//!
//! One page a column and group, plain, not compressed; `depth_us` and `change` are optional. The
//! file's metadata `palpus` holds the header. `change` holds text for the first row that was
//! stepped with other settings: a line of TOML for each change.
//!
//! The layout is that of <https://parquet.apache.org/docs/file-format/>; [`read`] reads what
//! [`Writer`] writes and nothing more, whose tests are other programs' readers.

mod meta;
mod reader;
mod thrift;
mod writer;

pub(super) use meta::MAGIC;
pub(super) use reader::read;
pub(super) use writer::{Writer, compact};
