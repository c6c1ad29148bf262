//! Finds which body lies completely in the other.

use glam::DVec3;

use crate::algebra::Pose;
use crate::body::{Body, Mesh};

/// States which body lies in the other. The value is meaningful only if the surfaces do not cross.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Containment {
    /// Neither body lies in the other.
    Neither,
    /// All of body a lies in b's solid.
    AInB,
    /// All of b lies in a's solid.
    BInA,
}

/// Returns which body lies inside the other after body a is moved by `t`. The surfaces must not
/// cross.
pub(super) fn containment(
    a: &Body,
    components_a: &[DVec3],
    b: &Body,
    components_b: &[DVec3],
    pose_ba: &Pose,
    t: DVec3,
) -> Containment {
    let holds_all = |body: &Body, points: &[DVec3], place: &dyn Fn(DVec3) -> DVec3| {
        body.mesh().is_closed() && points.iter().all(|&p| body.tree().inside(place(p)))
    };
    if holds_all(b, components_a, &|p| pose_ba.point(p) + t) {
        return Containment::AInB;
    }
    let back = pose_ba.inverse();
    if holds_all(a, components_b, &|p| back.point(p - t)) {
        return Containment::BInA;
    }
    Containment::Neither
}

/// Returns one vertex of each component.
pub(super) fn first_vertices(mesh: &Mesh) -> Vec<DVec3> {
    let mut first = vec![None; mesh.component_count()];
    for t in 0..mesh.triangles().len() as u32 {
        first[mesh.component(t) as usize].get_or_insert(mesh.triangle_points(t)[0]);
    }
    first.into_iter().flatten().collect()
}
