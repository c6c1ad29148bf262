//! Recordings of runs: a CSV file that any program opens, and from which a run can be repeated bit for bit.
//!
//! 1. A header in TOML, each line behind `# `: what was run, on what, how ([`RecordingHeader`]).
//! 2. A line with the names of the columns ([`COLUMNS`]).
//! 3. One line a tick ([`RecordRow`]):
//!
//! | columns | meaning |
//! |---|---|
//! | `tick`, `time_ns`, `dt` | number of the tick; time since the first one; the step's length as the engine got it, s |
//! | `device_tx` … `device_qw` | pose of the device in the world as the engine got it, m and quaternion (x, y, z, w) |
//! | `angular_x` … `linear_z` | its twist, rad/s and m/s |
//! | `buttons` | its buttons, one bit each |
//! | `torque_x` … `force_z` | the wrench sent to it, N·m and N |
//! | `contacts`, `clusters` | how many |
//! | `separation` | least distance, or minus the greatest depth, m; `inf` when nothing is near |
//! | `query_us`, `depth_us`, `force_us`, `total_us` | time of the stages, µs; `depth_us` may be empty (part of `query_us`) |
//! | `saturated`, `faults` | 0 or 1; the safety chain's faults, one bit each |
//!
//! Between the ticks, a line `# change = { tick = N, settings = { … } }` ([`RecordingWriter::change`]) says that the engine's settings were others from
//! tick N on.
//!
//! Numbers are written with the fewest digits that read back as the same double; the signs of zero and NaN are kept.
//! Each line is handed over whole and ends in a line break: what a crash leaves behind is readable up to its last whole
//! line, and [`read_recording`] says so in a notice.

mod change;
mod header;
mod reader;
mod writer;

use palpus::algebra::{Pose, Twist, Wrench};

pub use header::{RecordedBody, RecordedScene, RecordingHeader, SceneSource};
pub use reader::{Recording, read_recording, read_recording_from};
pub use writer::RecordingWriter;

/// Version of the format, the header's first entry.
pub const FORMAT: i64 = 1;

/// The columns, in their order.
pub const COLUMNS: [&str; 32] = [
    "tick",
    "time_ns",
    "dt",
    "device_tx",
    "device_ty",
    "device_tz",
    "device_qx",
    "device_qy",
    "device_qz",
    "device_qw",
    "angular_x",
    "angular_y",
    "angular_z",
    "linear_x",
    "linear_y",
    "linear_z",
    "buttons",
    "torque_x",
    "torque_y",
    "torque_z",
    "force_x",
    "force_y",
    "force_z",
    "contacts",
    "clusters",
    "separation",
    "query_us",
    "depth_us",
    "force_us",
    "total_us",
    "saturated",
    "faults",
];

/// One tick of a recording; see the module's description for frames and units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordRow {
    /// Number of the tick.
    pub tick: u64,
    /// ns since the first tick.
    pub time_ns: u64,
    /// Length of the step, exactly as the engine got it, s.
    pub dt: f64,
    /// The device in the world, exactly as the engine got it (a replay must not normalise it again).
    pub pose: Pose,
    /// The device's twist.
    pub twist: Twist,
    /// The device's buttons, one bit each.
    pub buttons: u32,
    /// What was sent to the device.
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
    /// Of the whole tick, µs.
    pub total_us: f64,
    /// True when the wrench was cut to the device's limits.
    pub saturated: bool,
    /// What the safety chain cut, one bit each, in the order of the chain.
    pub faults: u32,
}

impl RecordRow {
    /// True when the two wrenches are the same bit for bit: what a replay must reach.
    pub fn same_wrench(&self, wrench: &Wrench) -> bool {
        let bits = |w: &Wrench| (w.torque.to_array().map(f64::to_bits), w.force.to_array().map(f64::to_bits));
        bits(&self.wrench) == bits(wrench)
    }
}
