//! The columns of a recording: their names, their kinds and what of a row stands in each, in one order for all formats.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use super::{FORMAT, RecordRow};

/// The columns, in their order.
pub const COLUMNS: [&str; 39] = [
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
    "tool_tx",
    "tool_ty",
    "tool_tz",
    "tool_qx",
    "tool_qy",
    "tool_qz",
    "tool_qw",
];

/// Returns the columns of recordings of this format: those of format 1 end before the tool's pose.
pub(super) fn columns_of(format: u32) -> &'static [&'static str] {
    if has_tool(format) { &COLUMNS } else { &COLUMNS[..COLUMNS.len() - TOOL_COLUMNS] }
}

/// Columns of the tool's pose.
const TOOL_COLUMNS: usize = 7;

/// True if recordings of this format have the tool's pose.
fn has_tool(format: u32) -> bool {
    format >= 2
}

/// Takes the values of a row, in the order of the columns.
pub(super) trait Put {
    /// Of tick and time.
    fn long(&mut self, value: u64);
    /// Of counts and bits.
    fn whole(&mut self, value: u32);
    /// Keeps all 64 bits.
    fn double(&mut self, value: f64);
    /// A double that may be missing.
    fn optional(&mut self, value: Option<f64>);
    /// Yes or no.
    fn flag(&mut self, value: bool);
}

/// Gives the values of a row, in the order of the columns.
pub(super) trait Take {
    /// Why a value is not to be had.
    type Error;
    /// See [`Put::long`].
    fn long(&mut self) -> Result<u64, Self::Error>;
    /// See [`Put::whole`].
    fn whole(&mut self) -> Result<u32, Self::Error>;
    /// See [`Put::double`].
    fn double(&mut self) -> Result<f64, Self::Error>;
    /// See [`Put::optional`].
    fn optional(&mut self) -> Result<Option<f64>, Self::Error>;
    /// See [`Put::flag`].
    fn flag(&mut self) -> Result<bool, Self::Error>;

    /// Three doubles.
    fn vector(&mut self) -> Result<DVec3, Self::Error> {
        Ok(DVec3::new(self.double()?, self.double()?, self.double()?))
    }

    /// Seven doubles: translation and quaternion.
    fn pose(&mut self) -> Result<Pose, Self::Error> {
        let translation = self.vector()?;
        // Not normalised: that could change bits.
        let rotation = [self.double()?, self.double()?, self.double()?, self.double()?];
        Ok(Pose { rotation: DQuat::from_array(rotation), translation })
    }
}

/// Passes the values of a row to `out`, in the order of the columns of `format`.
pub(super) fn put(row: &RecordRow, format: u32, out: &mut impl Put) {
    let pose = |pose: &Pose, out: &mut dyn FnMut(f64)| {
        pose.translation.to_array().into_iter().for_each(&mut *out);
        pose.rotation.to_array().into_iter().for_each(out);
    };
    out.long(row.tick);
    out.long(row.time_ns);
    out.double(row.dt);
    pose(&row.pose, &mut |x| out.double(x));
    for vector in [row.twist.angular, row.twist.linear] {
        vector.to_array().into_iter().for_each(|x| out.double(x));
    }
    out.whole(row.buttons);
    for vector in [row.wrench.torque, row.wrench.force] {
        vector.to_array().into_iter().for_each(|x| out.double(x));
    }
    out.whole(row.contacts);
    out.whole(row.clusters);
    out.double(row.separation);
    out.double(row.query_us);
    out.optional(row.depth_us);
    out.double(row.force_us);
    out.double(row.total_us);
    out.flag(row.saturated);
    out.whole(row.faults);
    if has_tool(format) {
        pose(&row.tool.unwrap_or(NO_POSE), &mut |x| out.double(x));
    }
}

/// Stands for a pose that is not known.
const NO_POSE: Pose =
    Pose { rotation: DQuat::from_xyzw(f64::NAN, f64::NAN, f64::NAN, f64::NAN), translation: DVec3::NAN };

/// Makes a row of its values; see [`put`].
pub(super) fn take<T: Take>(format: u32, from: &mut T) -> Result<RecordRow, T::Error> {
    Ok(RecordRow {
        tick: from.long()?,
        time_ns: from.long()?,
        dt: from.double()?,
        pose: from.pose()?,
        twist: Twist { angular: from.vector()?, linear: from.vector()? },
        buttons: from.whole()?,
        wrench: Wrench { torque: from.vector()?, force: from.vector()? },
        contacts: from.whole()?,
        clusters: from.whole()?,
        separation: from.double()?,
        query_us: from.double()?,
        depth_us: from.optional()?,
        force_us: from.double()?,
        total_us: from.double()?,
        saturated: from.flag()?,
        faults: from.whole()?,
        tool: if has_tool(format) { Some(from.pose()?) } else { None },
    })
}

/// A row of nothing, to ask the columns for their kinds.
const NO_ROW: RecordRow = RecordRow {
    tick: 0,
    time_ns: 0,
    dt: 0.0,
    pose: Pose::IDENTITY,
    twist: Twist { angular: DVec3::ZERO, linear: DVec3::ZERO },
    buttons: 0,
    wrench: Wrench { torque: DVec3::ZERO, force: DVec3::ZERO },
    contacts: 0,
    clusters: 0,
    separation: 0.0,
    query_us: 0.0,
    depth_us: None,
    force_us: 0.0,
    total_us: 0.0,
    saturated: false,
    faults: 0,
    tool: None,
};

/// What stands in a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// 64 bits, no sign.
    Long,
    /// 32 bits, no sign.
    Whole,
    /// A double.
    Double,
    /// A double or nothing.
    Optional,
    /// Yes or no.
    Flag,
}

/// The columns' kinds, in their order.
pub(super) fn kinds() -> [Kind; COLUMNS.len()] {
    struct Kinds([Kind; COLUMNS.len()], usize);
    impl Kinds {
        fn next(&mut self, kind: Kind) {
            self.0[self.1] = kind;
            self.1 += 1;
        }
    }
    impl Put for Kinds {
        fn long(&mut self, _: u64) {
            self.next(Kind::Long);
        }
        fn whole(&mut self, _: u32) {
            self.next(Kind::Whole);
        }
        fn double(&mut self, _: f64) {
            self.next(Kind::Double);
        }
        fn optional(&mut self, _: Option<f64>) {
            self.next(Kind::Optional);
        }
        fn flag(&mut self, _: bool) {
            self.next(Kind::Flag);
        }
    }
    let mut kinds = Kinds([Kind::Double; COLUMNS.len()], 0);
    put(&NO_ROW, FORMAT, &mut kinds);
    kinds.0
}
