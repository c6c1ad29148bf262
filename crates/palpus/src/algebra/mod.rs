//! Rigid placements, spatial vectors and matrices, planes, closest points, interfaces to the
//! caller's clock and workers, seeded random and evenly spread numbers, quantiles, tables of cached
//! values for pairs, and all tolerances.

mod clock;
mod closest;
mod directions;
mod pair_table;
mod plane;
mod pose;
mod quantile;
mod random;
mod rotation;
mod rounds;
mod sets;
mod spatial;
mod spatial_matrix;
mod spread;
mod symmetric;
pub mod tolerance;
mod work;
mod workers;

pub use clock::{Clock, NoClock, WallClock};
pub use closest::{
    SegmentSegment, closest_on_segment, closest_on_triangle, closest_on_triangles, closest_segment_segment,
};
pub(crate) use directions::{Directions, LANES};
pub(crate) use pair_table::PairTable;
pub use plane::Plane;
pub use pose::{Placement, Pose};
pub use quantile::{quantile, quantile_of_sorted};
pub use random::Random;
pub use rotation::{rotation_between, rotation_vector};
pub(crate) use rounds::{Job, Rounds};
pub(crate) use sets::representative;
pub use spatial::{Twist, Wrench};
pub use spatial_matrix::{SpatialInverse, SpatialMatrix};
pub(crate) use spread::spread;
pub use symmetric::eigen;
pub use work::{Quota, Work};
pub use workers::{Alone, Workers, both, map_in_order};
