//! Rigid placements, spatial vectors, planes, closest points, and the register of tolerances.

mod closest;
mod plane;
mod pose;
mod spatial;
pub mod tolerance;

pub use closest::{SegmentSegment, closest_on_segment, closest_on_triangle, closest_segment_segment};
pub use plane::Plane;
pub use pose::{Placement, Pose};
pub use spatial::{Twist, Wrench};
