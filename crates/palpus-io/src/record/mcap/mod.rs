//! Recordings as MCAP files: ROS 2 messages in chunks.
//!
//! | topic | message | per |
//! |---|---|---|
//! | `/palpus/device/pose` | `geometry_msgs/msg/PoseStamped` | tick |
//! | `/palpus/device/twist` | `geometry_msgs/msg/TwistStamped` | tick |
//! | `/palpus/device/wrench` | `geometry_msgs/msg/WrenchStamped` | tick |
//! | `/palpus/tick` | `palpus_msgs/msg/Tick`: every column, a replay's source | tick |
//! | `/palpus/settings` | `palpus_msgs/msg/Settings`: a line of TOML | change of settings |
//!
//! All are encoded as CDR, little-endian: doubles keep their bits. Log and publish time are
//! nanoseconds since the first tick, the frame is `world`. Chunks are not compressed. After each
//! piece the file is whole, with index and footer; the next piece is written over those. So what a
//! crash leaves behind opens in every tool, but for one in the middle of a piece: then only in
//! tools that read from the beginning, as [`read`] does.
//!
//! The layout is that of <https://mcap.dev/spec>, of the messages that of ROS 2 and of OMG's CDR
//! (XCDR1).

mod cdr;
mod reader;
mod records;
mod writer;

pub(super) use reader::read;
pub(super) use records::MAGIC;
pub(super) use writer::Writer;
