//! Reads files with the motion of a hand.
//!
//! * Poses: columns `tx,ty,tz,qx,qy,qz,qw`, as for `palpus query`. Consecutive poses are half a
//!   second apart; lengths are in the scene's unit.
//! * A recorded hand motion as CSV with a header. The columns of the time (s), the position and the
//!   quaternion are found by name; other columns are ignored. Lengths are in metres unless the
//!   column names contain another unit (`px_mm`).
//! * A recorded hand motion in the format of TUM's RGB-D benchmark: `timestamp tx ty tz qx qy qz
//!   qw` (s, m), separated by blanks, without a header. Comments start with `#`.
//!
//! A CSV file whose header names a time is a recorded hand motion. Known names are: time `t`,
//! `t_s`, `time`, `time_s`, `timestamp`, `t_ms`, `time_ns` and similar; position `tx`, `px`, `x`,
//! `pos_x`, `position_x`, each also with the suffix `_m`, `_cm` or `_mm`; quaternion `qx`, `qy`,
//! `qz`, `qw`. The columns may have any order.
//!
//! 1. Times are relative to the first sample. Times must not decrease. If several samples have the
//!    same time, the first sample is used.
//! 2. Quaternions must be of unit length within 1e-3 and are normalised.
//! 3. Files of more than 256 MB or 4 million samples are rejected, so that no file uses up the
//!    memory.

mod columns;
mod read;

use palpus::algebra::Pose;

pub use read::{read_hand, read_hand_from};

/// Content of a file with the motion of a hand.
#[derive(Clone, Debug, PartialEq)]
pub enum HandFile {
    /// Poses without times, in the scene's unit.
    Poses(Vec<Pose>),
    /// Poses with times.
    Recorded(RecordedHand),
}

/// A recorded hand motion of at least two samples.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedHand {
    /// Time since the first sample (s; starts at 0, strictly increasing) and the pose at that time
    /// (m).
    pub samples: Vec<(f64, Pose)>,
    /// Number of samples that were omitted because the previous sample has the same time.
    pub repeated: usize,
}

impl RecordedHand {
    /// Returns the time from the first sample to the last, in seconds.
    pub fn duration(&self) -> f64 {
        self.samples.last().map_or(0.0, |(time, _)| *time)
    }

    /// Returns the longest time between two consecutive samples, in seconds.
    pub fn longest_gap(&self) -> f64 {
        self.samples.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max)
    }

    /// Returns the largest distance from the first position, in metres.
    pub fn reach(&self) -> f64 {
        let Some((_, first)) = self.samples.first() else { return 0.0 };
        self.samples.iter().map(|(_, pose)| pose.translation.distance(first.translation)).fold(0.0, f64::max)
    }
}
