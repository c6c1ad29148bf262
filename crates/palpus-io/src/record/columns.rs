//! The columns of a recording. [`visit`] lists the columns with their names and kinds and the
//! corresponding field of a row, in the same order for all formats. A new column needs one line
//! there and a new version of the format.

use std::convert::Infallible;
use std::num::NonZeroU64;
use std::sync::LazyLock;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist, Wrench};

use super::{FORMAT, RawState, RecordRow, ServoRecord};

/// Visits the columns of recordings of version `format`, in their order.
fn visit<V: Visit>(format: u32, row: &mut RecordRow, to: &mut V) -> Result<(), V::Error> {
    to.long("tick", &mut row.tick)?;
    to.long("time_ns", &mut row.time_ns)?;
    to.double("dt", &mut row.dt)?;
    to.vector(["device_tx", "device_ty", "device_tz"], &mut row.pose.translation)?;
    to.rotation(["device_qx", "device_qy", "device_qz", "device_qw"], &mut row.pose.rotation)?;
    to.vector(["angular_x", "angular_y", "angular_z"], &mut row.twist.angular)?;
    to.vector(["linear_x", "linear_y", "linear_z"], &mut row.twist.linear)?;
    to.whole("buttons", &mut row.buttons)?;
    to.vector(["torque_x", "torque_y", "torque_z"], &mut row.wrench.torque)?;
    to.vector(["force_x", "force_y", "force_z"], &mut row.wrench.force)?;
    to.whole("contacts", &mut row.contacts)?;
    to.whole("clusters", &mut row.clusters)?;
    to.double("separation", &mut row.separation)?;
    to.double("query_us", &mut row.query_us)?;
    to.optional("depth_us", &mut row.depth_us)?;
    to.double("force_us", &mut row.force_us)?;
    to.double("total_us", &mut row.total_us)?;
    to.flag("saturated", &mut row.saturated)?;
    to.whole("faults", &mut row.faults)?;
    if format >= 2 {
        let tool = row.tool.get_or_insert(NO_POSE);
        to.vector(["tool_tx", "tool_ty", "tool_tz"], &mut tool.translation)?;
        to.rotation(["tool_qx", "tool_qy", "tool_qz", "tool_qw"], &mut tool.rotation)?;
    }
    if format >= 3 {
        visit_servo(row.servo.get_or_insert_default(), to)?;
    }
    Ok(())
}

/// Visits the columns with the values that the loop adds to a tick.
fn visit_servo<V: Visit>(servo: &mut ServoRecord, to: &mut V) -> Result<(), V::Error> {
    to.long("utc_ns", &mut servo.utc_ns)?;
    to.double("lateness_s", &mut servo.lateness_s)?;
    to.double("elapsed_s", &mut servo.elapsed_s)?;
    to.whole("phase", &mut servo.phase)?;
    to.flag("stepped", &mut servo.stepped)?;
    to.long("work", &mut servo.work)?;
    let mut allowed = servo.work_allowed.map_or(0, NonZeroU64::get);
    to.long("work_allowed", &mut allowed)?;
    servo.work_allowed = NonZeroU64::new(allowed);
    to.double("device_time_s", &mut servo.device_time_s)?;
    let mut raw = servo.raw.map_or([None; RAW.len()], |raw| raw.to_array().map(Some));
    for (name, value) in RAW.into_iter().zip(&mut raw) {
        to.optional(name, value)?;
    }
    servo.raw = RawState::of_columns(&raw);
    Ok(())
}

/// The columns of a device state that the safety chain's gate replaced.
const RAW: [&str; 13] = [
    "raw_tx",
    "raw_ty",
    "raw_tz",
    "raw_qx",
    "raw_qy",
    "raw_qz",
    "raw_qw",
    "raw_angular_x",
    "raw_angular_y",
    "raw_angular_z",
    "raw_linear_x",
    "raw_linear_y",
    "raw_linear_z",
];

impl RawState {
    fn to_array(self) -> [f64; RAW.len()] {
        let Self { pose, twist } = self;
        let mut all = [0.0; RAW.len()];
        all[..3].copy_from_slice(&pose.translation.to_array());
        all[3..7].copy_from_slice(&pose.rotation.to_array());
        all[7..10].copy_from_slice(&twist.angular.to_array());
        all[10..].copy_from_slice(&twist.linear.to_array());
        all
    }

    /// Returns the state; `None` if no column has a value.
    fn of_columns(values: &[Option<f64>; RAW.len()]) -> Option<Self> {
        values.iter().any(Option::is_some).then(|| {
            let [tx, ty, tz, qx, qy, qz, qw, ax, ay, az, lx, ly, lz] = values.map(|value| value.unwrap_or(f64::NAN));
            let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
            let twist = Twist { angular: DVec3::new(ax, ay, az), linear: DVec3::new(lx, ly, lz) };
            Self { pose: Pose { rotation, translation: DVec3::new(tx, ty, tz) }, twist }
        })
    }
}

/// Visits the columns in order. Each method receives the name of a column and its value, which it
/// may replace.
trait Visit {
    type Error;

    fn long(&mut self, name: &'static str, value: &mut u64) -> Result<(), Self::Error>;
    fn whole(&mut self, name: &'static str, value: &mut u32) -> Result<(), Self::Error>;
    fn double(&mut self, name: &'static str, value: &mut f64) -> Result<(), Self::Error>;
    fn optional(&mut self, name: &'static str, value: &mut Option<f64>) -> Result<(), Self::Error>;
    fn flag(&mut self, name: &'static str, value: &mut bool) -> Result<(), Self::Error>;

    fn vector(&mut self, names: [&'static str; 3], value: &mut DVec3) -> Result<(), Self::Error> {
        names.into_iter().zip(value.as_mut()).try_for_each(|(name, value)| self.double(name, value))
    }

    /// The quaternion is not normalised, because that could change bits.
    fn rotation(&mut self, names: [&'static str; 4], value: &mut DQuat) -> Result<(), Self::Error> {
        let mut numbers = value.to_array();
        names.into_iter().zip(&mut numbers).try_for_each(|(name, value)| self.double(name, value))?;
        *value = DQuat::from_array(numbers);
        Ok(())
    }
}

/// Receives the values of a row, in the order of the columns.
pub(super) trait Put {
    /// Receives the tick or a time.
    fn long(&mut self, value: u64);
    /// Receives a count or a bit field.
    fn whole(&mut self, value: u32);
    /// Receives a double; all 64 bits must be kept.
    fn double(&mut self, value: f64);
    /// Receives a double that may be missing.
    fn optional(&mut self, value: Option<f64>);
    /// Receives a boolean.
    fn flag(&mut self, value: bool);
}

/// Returns the values of a row, in the order of the columns.
pub(super) trait Take {
    /// Why a value cannot be read.
    type Error;
    /// Counterpart of [`Put::long`].
    fn long(&mut self) -> Result<u64, Self::Error>;
    /// Counterpart of [`Put::whole`].
    fn whole(&mut self) -> Result<u32, Self::Error>;
    /// Counterpart of [`Put::double`].
    fn double(&mut self) -> Result<f64, Self::Error>;
    /// Counterpart of [`Put::optional`].
    fn optional(&mut self) -> Result<Option<f64>, Self::Error>;
    /// Counterpart of [`Put::flag`].
    fn flag(&mut self) -> Result<bool, Self::Error>;
}

/// Passes the values of a row to `out`, in the order of the columns of version `format`.
pub(super) fn put(row: &RecordRow, format: u32, out: &mut impl Put) {
    let Ok(()) = visit(format, &mut { *row }, &mut Putting(out));
}

struct Putting<'a, P>(&'a mut P);

impl<P: Put> Visit for Putting<'_, P> {
    type Error = Infallible;

    fn long(&mut self, _: &'static str, value: &mut u64) -> Result<(), Infallible> {
        self.0.long(*value);
        Ok(())
    }

    fn whole(&mut self, _: &'static str, value: &mut u32) -> Result<(), Infallible> {
        self.0.whole(*value);
        Ok(())
    }

    fn double(&mut self, _: &'static str, value: &mut f64) -> Result<(), Infallible> {
        self.0.double(*value);
        Ok(())
    }

    fn optional(&mut self, _: &'static str, value: &mut Option<f64>) -> Result<(), Infallible> {
        self.0.optional(*value);
        Ok(())
    }

    fn flag(&mut self, _: &'static str, value: &mut bool) -> Result<(), Infallible> {
        self.0.flag(*value);
        Ok(())
    }
}

/// Builds a row from its values; the counterpart of [`put`].
pub(super) fn take<T: Take>(format: u32, from: &mut T) -> Result<RecordRow, T::Error> {
    let mut row = NO_ROW;
    visit(format, &mut row, &mut Taking(from))?;
    Ok(row)
}

struct Taking<'a, T>(&'a mut T);

impl<T: Take> Visit for Taking<'_, T> {
    type Error = T::Error;

    fn long(&mut self, _: &'static str, value: &mut u64) -> Result<(), T::Error> {
        self.0.long().map(|taken| *value = taken)
    }

    fn whole(&mut self, _: &'static str, value: &mut u32) -> Result<(), T::Error> {
        self.0.whole().map(|taken| *value = taken)
    }

    fn double(&mut self, _: &'static str, value: &mut f64) -> Result<(), T::Error> {
        self.0.double().map(|taken| *value = taken)
    }

    fn optional(&mut self, _: &'static str, value: &mut Option<f64>) -> Result<(), T::Error> {
        self.0.optional().map(|taken| *value = taken)
    }

    fn flag(&mut self, _: &'static str, value: &mut bool) -> Result<(), T::Error> {
        self.0.flag().map(|taken| *value = taken)
    }
}

/// Placeholder for an unknown pose.
const NO_POSE: Pose =
    Pose { rotation: DQuat::from_xyzw(f64::NAN, f64::NAN, f64::NAN, f64::NAN), translation: DVec3::NAN };

/// A row of placeholder values, which are then replaced.
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
    servo: None,
};

/// Kind of a column's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Unsigned integer of 64 bits.
    Long,
    /// Unsigned integer of 32 bits.
    Whole,
    /// A double.
    Double,
    /// A double that may be missing.
    Optional,
    /// A boolean.
    Flag,
}

/// Name and kind of a column.
pub(super) type Column = (&'static str, Kind);

/// Returns the columns of recordings of version `format`, in their order.
pub(super) fn columns_of(format: u32) -> &'static [Column] {
    static COLUMNS: LazyLock<Vec<Vec<Column>>> = LazyLock::new(|| (1..=FORMAT).map(list).collect());
    &COLUMNS[(format.clamp(1, FORMAT) - 1) as usize]
}

/// Returns the names of the columns of new recordings, in their order.
pub fn column_names() -> Vec<&'static str> {
    names_of(FORMAT)
}

/// Returns the names of the columns of recordings of version `format`, in their order.
pub(super) fn names_of(format: u32) -> Vec<&'static str> {
    columns_of(format).iter().map(|(name, _)| *name).collect()
}

fn list(format: u32) -> Vec<Column> {
    let mut listing = Listing(Vec::new());
    let Ok(()) = visit(format, &mut { NO_ROW }, &mut listing);
    listing.0
}

struct Listing(Vec<Column>);

impl Listing {
    fn add(&mut self, name: &'static str, kind: Kind) -> Result<(), Infallible> {
        self.0.push((name, kind));
        Ok(())
    }
}

impl Visit for Listing {
    type Error = Infallible;

    fn long(&mut self, name: &'static str, _: &mut u64) -> Result<(), Infallible> {
        self.add(name, Kind::Long)
    }

    fn whole(&mut self, name: &'static str, _: &mut u32) -> Result<(), Infallible> {
        self.add(name, Kind::Whole)
    }

    fn double(&mut self, name: &'static str, _: &mut f64) -> Result<(), Infallible> {
        self.add(name, Kind::Double)
    }

    fn optional(&mut self, name: &'static str, _: &mut Option<f64>) -> Result<(), Infallible> {
        self.add(name, Kind::Optional)
    }

    fn flag(&mut self, name: &'static str, _: &mut bool) -> Result<(), Infallible> {
        self.add(name, Kind::Flag)
    }
}
