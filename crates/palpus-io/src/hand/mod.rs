//! Files that a hand follows.
//!
//! * Poses: columns `tx,ty,tz,qx,qy,qz,qw`, as for `palpus query`; half a second from one to the
//!   next; lengths in the scene's unit.
//! * A recorded hand, CSV with a header: a time (s), a position and a quaternion, by name; other
//!   columns are ignored. Lengths in m, or as the names say (`px_mm`).
//! * A recorded hand, as TUM's RGB-D benchmark writes it: `timestamp tx ty tz qx qy qz qw` (s, m),
//!   blanks between, no header, `#` before remarks.
//!
//! For a CSV file the header decides: one with a time is a recorded hand. Known names: time `t`,
//! `t_s`, `time`, `time_s`, `timestamp`, `t_ms`, `time_ns` and the like; position `tx`, `px`, `x`,
//! `pos_x`, `position_x`, each also with `_m`, `_cm` or `_mm` behind it; quaternion `qx`, `qy`,
//! `qz`, `qw`, in any order.
//!
//! 1. Times are counted from the first sample. They must not run backwards; of samples at the same
//!    time the first counts.
//! 2. Quaternions must be of unit length within 1e-3 and are normalised.
//! 3. Files of more than 256 MB or 4 million samples are refused, so that no file takes all memory.

mod columns;
mod read;

use palpus::algebra::Pose;

pub use read::{read_hand, read_hand_from};

/// Content of a hand's file.
#[derive(Clone, Debug, PartialEq)]
pub enum HandFile {
    /// Poses without times, in the scene's unit.
    Poses(Vec<Pose>),
    /// A pose of a hand, with its time.
    Recorded(RecordedHand),
}

/// A recorded hand: two samples or more.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedHand {
    /// Seconds since the first sample, strictly increasing from 0 on, and the pose then, m.
    pub samples: Vec<(f64, Pose)>,
    /// Samples that stood at the same time as the one before them, and were left out.
    pub repeated: usize,
}

impl RecordedHand {
    /// Seconds from the first sample to the last.
    pub fn duration(&self) -> f64 {
        self.samples.last().map_or(0.0, |(time, _)| *time)
    }

    /// The longest time between two samples, s.
    pub fn longest_gap(&self) -> f64 {
        self.samples.windows(2).map(|pair| pair[1].0 - pair[0].0).fold(0.0, f64::max)
    }

    /// The largest distance from where it began, m.
    pub fn reach(&self) -> f64 {
        let Some((_, first)) = self.samples.first() else { return 0.0 };
        self.samples.iter().map(|(_, pose)| pose.translation.distance(first.translation)).fold(0.0, f64::max)
    }
}
