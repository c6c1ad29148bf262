//! Recordings as MCAP files: ROS 2 messages in chunks.
//!
//! | topic | message | per |
//! |---|---|---|
//! | `/palpus/device/pose` | `geometry_msgs/msg/PoseStamped` | tick |
//! | `/palpus/device/twist` | `geometry_msgs/msg/TwistStamped` | tick |
//! | `/palpus/device/wrench` | `geometry_msgs/msg/WrenchStamped` | tick |
//! | `/palpus/tick` | `palpus_msgs/msg/Tick`: every column; used for a replay | tick |
//! | `/palpus/settings` | `palpus_msgs/msg/Settings`: a line of TOML | change of settings |
//!
//! All messages are encoded as little-endian CDR, which keeps the bits of doubles. The log time and
//! the publish time are nanoseconds since the first tick; the frame is `world`. Chunks are not
//! compressed. The writer appends one piece after another. After each piece the file is complete,
//! with index and footer, which the next piece overwrites. After a crash, every tool can open the
//! file, except if the crash interrupted a piece. Then only tools that read from the beginning can
//! open it, as [`read`] does.
//!
//! The file layout follows <https://mcap.dev/spec>; the messages follow ROS 2 and OMG's CDR
//! (XCDR1).

mod cdr;
mod reader;
mod records;
mod writer;

pub(super) use reader::read;
pub(super) use records::MAGIC;
pub(super) use writer::Writer;
