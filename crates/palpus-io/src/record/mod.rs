//! Recordings of runs: tables that other programs can open and from which palpus can replay a run
//! bit for bit.
//!
//! A recording contains a header ([`RecordingHeader`]: program, scene, settings), one row for each
//! tick ([`RecordRow`], [`column_names`]), and the changes of the engine's settings between ticks
//! ([`Recording::changes`]). Three file formats store these data without loss
//! ([`RecordingFormat`]):
//!
//! 1. CSV: the header as TOML, each line after `# `; a line with the names of the columns; one line
//!    for each tick. A change of settings is a line `# change = { tick = N, settings = { … } }`
//!    between the ticks. Numbers are written with the fewest digits that read back as the same
//!    double.
//! 2. Parquet: the columns, and a column `change`, which is empty except for ticks from which other
//!    settings apply. The header is the file's metadata `palpus`.
//! 3. MCAP: ROS 2 messages for robotics tools (pose, twist, wrench), whole rows on a second
//!    channel, and changes of settings on a third channel. The header is the metadata record
//!    `palpus`.
//!
//! | columns | meaning |
//! |---|---|
//! | `tick`, `time_ns`, `dt` | number; time since the first tick; duration of the step, s |
//! | `device_tx` … `device_qw` | pose of the grip in the world, m and quaternion (x, y, z, w) |
//! | `angular_x` … `linear_z` | twist of the grip, rad/s and m/s |
//! | `buttons` | buttons of the device, one bit each |
//! | `torque_x` … `force_z` | wrench sent to the device, about the grip, N·m and N |
//! | `contacts`, `clusters` | numbers of contacts and clusters |
//! | `separation` | smallest distance, or minus the largest depth, m; `inf` if nothing is near |
//! | `query_us`, `force_us`, `total_us` | duration of the stages, µs |
//! | `depth_us` | duration of the depth stage, µs; if empty, it is part of `query_us` |
//! | `saturated`, `faults` | 0 or 1; the safety chain's faults, one bit each |
//! | `tool_tx` … `tool_qw` | pose of the rendered probe's mesh in the world, m and quaternion |
//! | `utc_ns` … `raw_linear_z` | timing and phase of the loop: see [`ServoRecord`] |
//!
//! **Versions.** Version 2 ends with `tool_qw`. Version 1 ends with `faults`, and its device
//! pose is the pose of the origin of the probe's mesh instead of the grip
//! ([`RecordingHeader::has_grip_poses`]). palpus reads both versions, and writes a recording again
//! in the version in which it was read.
//!
//! A program that is killed loses the rows that [`RecordingWriter`] has not yet written: less than
//! a second. In every format, the file of an interrupted run is complete up to that point. A
//! piece that was being written at that moment is omitted, and the reader adds a notice.
//!
//! Recordings may be malicious. No reader panics, and the memory stays within a small multiple of
//! the file size. Compressed files are rejected, a length in a file is only trusted when its bytes
//! are present, no bytes are read twice, and nesting is bounded (in TOML by its parser, in Thrift
//! by our reader). The crates `parquet` and `mcap` panic or reserve gigabytes on damaged files;
//! docs/dependencies.md contains the comparison.

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

/// Bytes for one place in a file.
struct Piece {
    /// Offset in the file; the bytes overwrite the old bytes.
    at: u64,
    bytes: Vec<u8>,
}

/// One tick of a recording. The description of the module explains frames and units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordRow {
    /// Number of the tick.
    pub tick: u64,
    /// Time since the first tick, in ns.
    pub time_ns: u64,
    /// Duration of the step, exactly as passed to the engine, in seconds.
    pub dt: f64,
    /// Pose of the grip in the world, with the probe's axes, exactly as passed to the engine; a
    /// replay must not normalise it again. In format 1, the pose of the origin of the probe's mesh.
    pub pose: Pose,
    /// Twist of the grip along the world's axes (rad/s, m/s).
    pub twist: Twist,
    /// The device's buttons, one bit each.
    pub buttons: u32,
    /// Wrench sent to the device, about the grip (N·m, N).
    pub wrench: Wrench,
    /// Number of contacts within the tolerance.
    pub contacts: u32,
    /// Number of clusters of contacts.
    pub clusters: u32,
    /// Smallest distance, or minus the largest depth (m).
    pub separation: f64,
    /// Duration of the query, in µs.
    pub query_us: f64,
    /// Duration of the depth stage, in µs; `None` if it is part of `query_us`.
    pub depth_us: Option<f64>,
    /// Duration of the force stage, in µs.
    pub force_us: f64,
    /// Duration of the whole tick, in µs.
    pub total_us: f64,
    /// True if the wrench was limited to the device's limits.
    pub saturated: bool,
    /// Interventions of the safety chain: one bit each, in the order of the chain.
    pub faults: u32,
    /// Pose at which the engine rendered the probe's mesh, in the world; `None` in format 1.
    pub tool: Option<Pose>,
    /// Timing and phase of the loop; `None` before format 3.
    pub servo: Option<ServoRecord>,
}

/// Timing and phase of the loop in a tick, in addition to the engine's input and output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoRecord {
    /// Wall-clock time at which the tick was recorded: ns since 1970-01-01 UTC.
    pub utc_ns: u64,
    /// Time from the deadline of the tick to its start, in seconds.
    pub lateness_s: f64,
    /// Time since the start of the previous tick, in seconds, as used by the safety chain.
    pub elapsed_s: f64,
    /// Phase of the engagement after the tick: 0 idle, 1 waiting, 2 ramping, 3 engaged, 4 faulted,
    /// 5 stopped, 6 latched.
    pub phase: u32,
    /// True if the engine's step returned a result. False if the step panicked, and while the loop
    /// only damps the grip after a panic or a fault. In these ticks the engine's columns have no
    /// meaning, and the safety chain received a zero wrench.
    pub stepped: bool,
    /// Number of units of work of the engine's query.
    pub work: u64,
    /// Limit of the query's work, which affects the result; `None` if there is no limit.
    pub work_allowed: Option<NonZeroU64>,
    /// Time at which the device measured the state, by the device's clock, in seconds.
    pub device_time_s: f64,
    /// The state as read, if the safety chain's gate replaced it; otherwise `None`.
    pub raw: Option<RawState>,
}

/// A device state as read, whether or not it is valid: in the world, at the grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawState {
    /// Pose (m and quaternion).
    pub pose: Pose,
    /// Twist (rad/s and m/s).
    pub twist: Twist,
}

impl RecordRow {
    /// Returns true if the two wrenches are equal bit for bit, as a replay requires.
    pub fn same_wrench(&self, wrench: &Wrench) -> bool {
        let bits = |w: &Wrench| (w.torque.to_array().map(f64::to_bits), w.force.to_array().map(f64::to_bits));
        bits(&self.wrench) == bits(wrench)
    }
}
