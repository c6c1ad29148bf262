//! The gap between two pieces along a direction.

use glam::DVec3;

use crate::algebra::Placement;
use crate::body::Polytope;

/// Returns the gap (model units) between the support planes of two pieces along `normal`, and the
/// support vertices of a and of b. `normal` is a unit vector from b into a, in b's frame. The gap
/// is negative if the pieces overlap along the normal. It never exceeds their distance.
///
/// The search for support vertices begins at the vertices `hub`. `pose_ba` places a's frame in b's.
#[inline]
pub(crate) fn support_gap(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    normal: DVec3,
    hub: [u32; 2],
) -> (f64, [u32; 2]) {
    let (vertex_a, point_a) = a.support_point_from(hub[0], -pose_ba.inverse_vector(normal));
    let (vertex_b, point_b) = b.support_point_from(hub[1], normal);
    (normal.dot(pose_ba.point(point_a) - point_b), [vertex_a, vertex_b])
}
