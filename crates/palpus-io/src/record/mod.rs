//! Recordings of runs: tables that other programs open, and from which a run can be repeated bit
//! for bit.
//!
//! Content of a recording in any format: a header ([`RecordingHeader`]: program, scene, settings),
//! one row a tick ([`RecordRow`], [`column_names`]), and the changes of the engine's settings
//! between ticks ([`Recording::changes`]). Three formats hold it, to the bit ([`RecordingFormat`]):
//!
//! 1. CSV: the header in TOML, each line behind `# `; a line with the names of the columns; one
//!    line a tick. A change of settings is a line `# change = { tick = N, settings = { … } }`
//!    between the ticks. Numbers have the fewest digits that read back as the same double.
//! 2. Parquet: the columns, and a column `change` that is empty but for the ticks from which other
//!    settings hold; the header is the file's metadata `palpus`.
//! 3. MCAP: ROS 2 messages for robotics tools (pose, twist, wrench), the whole rows on a channel of
//!    their own, changes of settings on another; the header is the metadata record `palpus`.
//!
//! | columns | meaning |
//! |---|---|
//! | `tick`, `time_ns`, `dt` | number; time since the first tick; length of the engine's step, s |
//! | `device_tx` … `device_qw` | pose of the grip in the world, m and quaternion (x, y, z, w) |
//! | `angular_x` … `linear_z` | its twist, rad/s and m/s |
//! | `buttons` | its buttons, one bit each |
//! | `torque_x` … `force_z` | the wrench sent to it, about the grip, N·m and N |
//! | `contacts`, `clusters` | how many |
//! | `separation` | least distance, or minus the greatest depth, m; `inf` when nothing is near |
//! | `query_us`, `force_us`, `total_us` | time of the stages, µs |
//! | `depth_us` | the same; may be empty (then part of `query_us`) |
//! | `saturated`, `faults` | 0 or 1; the safety chain's faults, one bit each |
//! | `tool_tx` … `tool_qw` | pose of the rendered probe's mesh in the world, m and quaternion |
//! | `utc_ns` … `raw_linear_z` | what the loop knew of the tick: see [`ServoRecord`] |
//!
//! **Formats.** Format 2 ends with `tool_qw`. Format 1 ends with `faults`, and its device pose
//! is that of the origin of the probe's mesh instead of the grip
//! ([`RecordingHeader::has_grip_poses`]). Both are read, and written again in their own format.
//!
//! A program that is killed loses what [`RecordingWriter`] has not handed over: less than a second.
//! The file of an interrupted run is whole up to there in every format; a piece that was being
//! written at that very moment is left out, with a notice.
//!
//! Recordings may come from strangers. No reader panics, and memory stays within a small
//! multiple of the file's size: nothing is compressed (a file that is, is refused), no length in a
//! file is trusted before its bytes are there, no bytes are read twice, and nesting is bounded
//! (TOML's by its parser, Thrift's by ours). The crates `parquet` and `mcap` panic or reserve
//! gigabytes on damaged files: docs/dependencies.md has the comparison.

mod change;
mod columns;
mod csv;
mod header;
mod mcap;
mod parquet;
mod reader;
mod writer;

use std::num::NonZeroU64;

use palpus::algebra::{Pose, Twist, Wrench};

pub use columns::column_names;
pub use header::{MOST_SCENE_TEXT, RecordedBody, RecordedScene, RecordingHeader, SceneSource};
pub use reader::{Recording, read_recording, read_recording_from};
pub use writer::{RecordingFormat, RecordingWriter};

/// Version of the format of new recordings; see [`RecordingHeader::format`].
pub const FORMAT: u32 = 3;

/// Bytes for a place in a file.
struct Piece {
    /// Place of the bytes in the file; they overwrite the old ones.
    at: u64,
    bytes: Vec<u8>,
}

/// One tick of a recording; see the module's description for frames and units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordRow {
    /// Number of the tick.
    pub tick: u64,
    /// ns since the first tick.
    pub time_ns: u64,
    /// Length of the step, exactly as the engine got it, s.
    pub dt: f64,
    /// The device's pose in the world, which is that of the grip with the probe's axes, exactly as
    /// the engine got it (a replay must not normalise it again). In format 1 that of the origin of
    /// the probe's mesh.
    pub pose: Pose,
    /// The device's twist, along the world's axes; the linear part is that of the grip.
    pub twist: Twist,
    /// The device's buttons, one bit each.
    pub buttons: u32,
    /// Wrench sent to the device.
    pub wrench: Wrench,
    /// Contacts within the tolerance.
    pub contacts: u32,
    /// Clusters of them.
    pub clusters: u32,
    /// Least distance, or minus the greatest depth, m.
    pub separation: f64,
    /// µs.
    pub query_us: f64,
    /// µs, when it is measured apart from the query.
    pub depth_us: Option<f64>,
    /// µs.
    pub force_us: f64,
    /// Duration of the whole tick, µs.
    pub total_us: f64,
    /// True when the wrench was cut to the device's limits.
    pub saturated: bool,
    /// Interventions of the safety chain, one bit each, in the order of the chain.
    pub faults: u32,
    /// The pose of the probe's mesh in the world, where the engine rendered it; `None` in format 1.
    pub tool: Option<Pose>,
    /// Timing and phase of the loop; `None` before format 3.
    pub servo: Option<ServoRecord>,
}

/// Timing and phase of the loop in a tick, beside input and output of the engine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoRecord {
    /// When the tick was recorded by the clock on the wall: ns since 1970-01-01 UTC.
    pub utc_ns: u64,
    /// How long after its deadline the tick began, s.
    pub lateness_s: f64,
    /// Time since the last tick began, s: what the safety chain reckons with.
    pub elapsed_s: f64,
    /// Phase of the engagement after the tick: 0 idle, 1 waiting, 2 ramping, 3 engaged, 4 faulted,
    /// 5 stopped.
    pub phase: u32,
    /// True if the engine's step gave its answer. False if it panicked, and while the loop only
    /// damps the grip after that or after a last fault: the engine's columns are then empty of
    /// meaning, and the chain was given a wrench of zero.
    pub stepped: bool,
    /// Units of work done by the engine's query.
    pub work: u64,
    /// The query's limit of work, which affects the answer; `None` for no limit.
    pub work_allowed: Option<NonZeroU64>,
    /// When the device took the state that was read, by its own clock, s.
    pub device_time_s: f64,
    /// The state as it was read, if the safety chain's gate put another one in its place.
    pub raw: Option<RawState>,
}

/// A device's state as read, valid or not: in the world, at the grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawState {
    /// m and quaternion.
    pub pose: Pose,
    /// rad/s and m/s.
    pub twist: Twist,
}

impl RecordRow {
    /// True when the two wrenches are the same bit for bit: what a replay must reach.
    pub fn same_wrench(&self, wrench: &Wrench) -> bool {
        let bits = |w: &Wrench| (w.torque.to_array().map(f64::to_bits), w.force.to_array().map(f64::to_bits));
        bits(&self.wrench) == bits(wrench)
    }
}
