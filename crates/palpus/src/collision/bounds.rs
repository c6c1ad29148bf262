//! Cheap lower bounds of distances, tested before hulls.
//!
//! Each function returns a *lower bound* of the distance between two node volumes. A bound may be
//! negative or loose, but it never exceeds the true distance. The bounds only save work: a
//! pair that they cannot exclude is tested by its hulls.

use glam::{DMat3, DVec3};

use crate::algebra::Placement;
use crate::body::{OrientedBox, Sphere};

/// Returns a lower bound of the distance between two spheres; `pose_ba` places a's frame in b's.
#[inline]
pub(crate) fn sphere_gap(a: &Sphere, b: &Sphere, pose_ba: &Placement) -> f64 {
    pose_ba.point(a.center).distance(b.center) - a.radius - b.radius
}

/// A gap between two boxes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxGap {
    /// A lower bound of the distance, model units.
    pub(crate) gap: f64,
    /// The direction from b to a in which the gap is found, in b's frame; not unit.
    pub(crate) axis: DVec3,
}

/// Returns a lower bound of the distance between two oriented boxes: the widest gap along the
/// fifteen separating axes.
///
/// Ends early when a gap exceeds `enough`. After Gottschalk, Lin, Manocha, *OBB-Tree*, 1996, with
/// gaps instead of signs.
pub(crate) fn box_gap(a: &OrientedBox, b: &OrientedBox, pose_ba: &Placement, enough: f64) -> BoxGap {
    // All vectors are in the frame of b's box. The columns of `r` are a's axes.
    let to_box = b.axes.transpose();
    let r = to_box * (pose_ba.rotation * a.axes);
    let t = to_box * (pose_ba.point(a.center) - b.center);
    let absolute = DMat3::from_cols(r.x_axis.abs(), r.y_axis.abs(), r.z_axis.abs());
    let found = |gap: f64, axis: DVec3| BoxGap { gap, axis: b.axes * (axis * axis.dot(t).signum()) };

    // Separating axes: the three face normals of b's box.
    let gaps = t.abs() - b.half - absolute * a.half;
    let k = gaps.max_position();
    let (mut widest, mut axis) = (gaps[k], DVec3::AXES[k]);
    if widest > enough {
        return found(widest, axis);
    }
    // Separating axes: the three face normals of a's box.
    let along_a = DVec3::new(r.x_axis.dot(t), r.y_axis.dot(t), r.z_axis.dot(t)).abs();
    let reach_b = DVec3::new(absolute.x_axis.dot(b.half), absolute.y_axis.dot(b.half), absolute.z_axis.dot(b.half));
    let gaps = along_a - a.half - reach_b;
    let k = gaps.max_position();
    if gaps[k] > widest {
        (widest, axis) = (gaps[k], r.col(k));
    }
    if widest > enough {
        return found(widest, axis);
    }
    // Separating axes: the cross products of the nine pairs of edges. They are not unit, so the gap
    // is divided by the axis's length.
    for (k, (axis_a, absolute_a)) in
        [(r.x_axis, absolute.x_axis), (r.y_axis, absolute.y_axis), (r.z_axis, absolute.z_axis)].into_iter().enumerate()
    {
        let (a1, a2) = ((k + 1) % 3, (k + 2) % 3);
        for j in 0..3 {
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            // The axis e_j × axis_a has the components 0 (along j), −axis_a[j2] (along j1) and
            // axis_a[j1] (along j2).
            let length_squared = axis_a[j1] * axis_a[j1] + axis_a[j2] * axis_a[j2];
            if length_squared < crate::algebra::tolerance::PARALLEL_AXES {
                continue;
            }
            let separation = (t[j2] * axis_a[j1] - t[j1] * axis_a[j2]).abs();
            let reach_b = b.half[j1] * absolute_a[j2] + b.half[j2] * absolute_a[j1];
            let reach_a = a.half[a1] * absolute.col(a2)[j] + a.half[a2] * absolute.col(a1)[j];
            let gap = (separation - reach_a - reach_b) / length_squared.sqrt();
            if gap > widest {
                (widest, axis) = (gap, DVec3::AXES[j].cross(axis_a));
            }
        }
        if widest > enough {
            return found(widest, axis);
        }
    }
    found(widest, axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::{Pose, Random};
    use glam::DQuat;

    const SEED: u64 = 0x0b0d_5eed;

    fn corners(b: &OrientedBox) -> impl Iterator<Item = DVec3> + '_ {
        (0..8).map(|k| {
            let sign = |bit: u32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            b.center + b.axes * (b.half * DVec3::new(sign(0), sign(1), sign(2)))
        })
    }

    #[test]
    fn gap_is_a_lower_bound_of_the_distance() {
        let mut random = Random::new(SEED);
        for case in 0..2000 {
            let mut vector = || random.vector();
            let rotation = |v: DVec3| DQuat::from_scaled_axis(v * 3.0);
            let mut any =
                || OrientedBox { center: vector(), axes: DMat3::from_quat(rotation(vector())), half: vector().abs() };
            let (a, b) = (any(), any());
            let pose = Pose::new(rotation(vector()), vector() * 3.0).placement();
            let BoxGap { gap, axis } = box_gap(&a, &b, &pose, f64::INFINITY);
            let axis = axis.normalize();
            for p in corners(&a) {
                for q in corners(&b) {
                    let d = pose.point(p).distance(q);
                    assert!(gap <= d + 1e-12, "seed {SEED:#x}, case {case}: gap {gap} over distance {d}");
                    let along = axis.dot(pose.point(p) - q);
                    assert!(gap <= along + 1e-12, "seed {SEED:#x}, case {case}: gap {gap} over {along} along the axis");
                }
            }
            let far = Placement { translation: pose.translation + DVec3::X * 50.0, ..pose };
            assert!(box_gap(&a, &b, &far, f64::INFINITY).gap > 30.0, "seed {SEED:#x}, case {case}");
        }
    }
}
