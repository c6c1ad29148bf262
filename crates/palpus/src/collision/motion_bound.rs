//! Upper bound of the relative motion of two bodies: a sum that only grows.
//!
//! 1. From one tick to the next, no point of a body moves farther than the corners of a box around
//!    the body. The reason: the displacement field of a rigid motion is affine, and the norm of an
//!    affine field is convex.
//! 2. So distances between the bodies change by at most the largest motion of a corner. This bound
//!    is computed for a's motion in b's frame and for b's motion in a's frame. The smaller value is
//!    added to the sum S.
//! 3. A pair at distance `D` when the sum is S₀ is not nearer than `t` until the sum exceeds S₀ +
//!    (D − t).
//!
//! A second sum adds up the angles of rotation (rad).
//!
//! S is a whole number of *quanta*. A quantum is a fixed small fraction of the bodies' size. A
//! motion is rounded up to whole quanta, and one quantum is added. A clearance is rounded down. So
//! the sum stays exact for any run time. The added quantum covers the rounding of transformed
//! points, which is a thousand times smaller.

use glam::{DMat3, DVec3};

use crate::algebra::Placement;
use crate::algebra::tolerance::{MOTION_NOISE, MOTION_QUANTUM};
use crate::body::OrientedBox;

/// The running sum of displacements, in quanta.
#[derive(Clone, Debug)]
pub(super) struct MotionBound {
    box_a: OrientedBox,
    box_b: OrientedBox,
    /// Size of a quantum, model units.
    quantum: f64,
    size: f64,
    last: Option<Placement>,
    /// The pose before `last`, and the motion from there to `last`.
    before: Option<(Placement, f64)>,
    /// The last pose of [`Self::motion_to`], and the motion to this pose.
    ahead: Option<(Placement, f64)>,
    sum: u64,
    /// Sum of all rotations, rad.
    turned: f64,
}

impl MotionBound {
    /// Returns a motion bound for two bodies inside these boxes. Each box is in its body's frame.
    pub(super) fn new(box_a: OrientedBox, box_b: OrientedBox) -> Self {
        let size = box_a.half.length() + box_b.half.length();
        let quantum = (MOTION_QUANTUM * size).max(f64::MIN_POSITIVE);
        Self { box_a, box_b, quantum, size, last: None, before: None, ahead: None, sum: BEGIN, turned: 0.0 }
    }

    /// Returns the sum, in quanta.
    #[inline]
    pub(super) fn sum(&self) -> u64 {
        self.sum
    }

    /// Returns the size of both bodies, model units.
    pub(super) fn size(&self) -> f64 {
        self.size
    }

    /// Resets the sums.
    pub(super) fn clear(&mut self) {
        (self.last, self.before, self.ahead) = (None, None, None);
        self.sum = BEGIN;
    }

    /// Adds the motion since the last call and returns it in model units. `None` before the first
    /// call, or if the sum has reached its limit; then stored distances are invalid.
    pub(super) fn advance(&mut self, pose_ba: &Placement) -> Option<f64> {
        let moved = self.motion_to(pose_ba);
        if let Some(last) = &self.last {
            self.turned += angle_between(&last.rotation, &pose_ba.rotation) + MOTION_NOISE;
        }
        self.before = self.last.zip(moved);
        (self.last, self.ahead) = (Some(*pose_ba), None);
        let moved = moved?;
        self.spend(moved + MOTION_NOISE * (self.size + pose_ba.translation.length())).then_some(moved)
    }

    /// Returns the sum of all relative rotations so far, rad. The difference of two values bounds
    /// the rotation in between.
    #[inline]
    pub(super) fn turned(&self) -> f64 {
        self.turned
    }

    /// Returns the motion of the last call of [`Self::advance`], model units; 0 if none is known.
    pub(super) fn last_motion(&self) -> f64 {
        self.before.as_ref().map_or(0.0, |(_, moved)| *moved)
    }

    /// Returns the motion since the last call of [`Self::advance`], model units; `None` before the
    /// first call.
    pub(super) fn motion_to(&mut self, pose_ba: &Placement) -> Option<f64> {
        if let Some((pose, moved)) = &self.ahead
            && pose == pose_ba
        {
            return Some(*moved);
        }
        let last = self.last.as_ref()?;
        let moved = displacement(&self.box_a, last, pose_ba);
        // The motion of b in a's frame is q ↦ R'ᵀ(q − t') − Rᵀ(q − t). Its norm is invariant under
        // R'.
        let moved = moved.min(displacement(&self.box_b, &last.inverse(), &pose_ba.inverse()));
        self.ahead = Some((*pose_ba, moved));
        Some(moved)
    }

    /// Returns the pose (a in b's frame) after `count` more motions like the last one, and an upper
    /// bound of the motion to there, model units. `None` without a motion.
    pub(super) fn expected(&self, count: u32) -> Option<(Placement, f64)> {
        let ((before, moved), last) = (self.before.as_ref()?, self.last.as_ref()?);
        if *moved == 0.0 {
            return None;
        }
        let turn = last.rotation * before.rotation.transpose();
        let shift = last.translation - turn * before.translation;
        let pose = (0..count).fold(*last, |Placement { rotation, translation }, _| Placement {
            rotation: turn * rotation,
            translation: turn * translation + shift,
        });
        let motion = displacement(&self.box_a, last, &pose);
        let motion = motion.min(displacement(&self.box_b, &last.inverse(), &pose.inverse()));
        Some((pose, motion + MOTION_NOISE * (self.size + pose.translation.length())))
    }

    /// Returns an upper bound of the last motion of a part of a against `normal` (in b's frame), as
    /// a share of the whole motion: 1 if the part moved straight against the normal, as far as any
    /// point, and 1 if no motion is known. The part lies within `radius` (model units) of `center`
    /// (in a's frame).
    pub(super) fn approach(&self, center: DVec3, radius: f64, normal: DVec3) -> f64 {
        match (&self.before, &self.last) {
            (Some((before, moved)), Some(last)) if *moved > 0.0 => {
                let turned = before.inverse_vector(normal).distance(last.inverse_vector(normal));
                (normal.dot(before.point(center) - last.point(center)) + radius * turned) / moved
            }
            _ => 1.0,
        }
    }

    /// Adds `length` (model units) to the sum, which shortens all clearances. Returns false if the
    /// sum has reached its limit.
    pub(super) fn spend(&mut self, length: f64) -> bool {
        let quanta = (length / self.quantum).ceil() + 1.0;
        if quanta.is_nan() || quanta >= EXHAUSTED as f64 || self.sum >= EXHAUSTED {
            self.clear();
            return false;
        }
        self.sum += quanta as u64;
        true
    }

    /// Returns the sum at which a pair with this `clearance` (not negative, model units) must be
    /// measured again.
    #[inline]
    pub(super) fn due(&self, clearance: f64) -> u64 {
        // A cast saturates. The limit `EXHAUSTED` keeps the sum of two values from overflowing.
        self.sum + ((clearance / self.quantum) as u64).min(EXHAUSTED)
    }

    /// Returns the sum at which a pair was due that is now nearer than the tolerance by `missing`
    /// (not negative, model units); 0 if the sum has never been so low.
    #[inline]
    pub(super) fn due_since(&self, missing: f64) -> u64 {
        self.sum.saturating_sub(((missing / self.quantum).ceil() as u64).saturating_add(1))
    }

    /// Returns the motion since the sum `from`, model units; negative if `from` is not reached yet.
    pub(super) fn since(&self, from: u64) -> f64 {
        (self.sum as f64 - from as f64) * self.quantum
    }
}

/// The sum before any motion: a motion of the bodies' size. A pair that is found near can be due
/// since a lower sum.
const BEGIN: u64 = (1.0 / MOTION_QUANTUM) as u64;

/// Limit of the sum: far above any real motion, and far below the largest integer.
const EXHAUSTED: u64 = 1 << 61;

/// Returns the angle between two rotations, rad.
fn angle_between(from: &DMat3, to: &DMat3) -> f64 {
    let change = *to - *from;
    let squares = change.x_axis.length_squared() + change.y_axis.length_squared() + change.z_axis.length_squared();
    // The Frobenius norm of the difference is √8 sin(θ / 2).
    2.0 * (squares / 8.0).sqrt().min(1.0).asin()
}

/// An affine image of a box, or the difference of two images: the middle of the box, and the
/// middles of three sides relative to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoxImage([DVec3; 4]);

impl BoxImage {
    /// The difference of two equal images.
    pub(super) const ZERO: Self = Self([DVec3::ZERO; 4]);

    /// The image of a box under the map p ↦ linear · p + shift.
    pub(super) fn of(held: &OrientedBox, linear: DMat3, shift: DVec3) -> Self {
        let (sides, half) = (linear * held.axes, held.half);
        Self([linear * held.center + shift, sides.x_axis * half.x, sides.y_axis * half.y, sides.z_axis * half.z])
    }

    /// Returns this image minus `factor` times another one.
    #[inline]
    pub(super) fn minus(&self, factor: f64, other: &Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k] - other.0[k] * factor))
    }

    /// Returns the mean dot product of the corners of two images.
    #[inline]
    pub(super) fn dot(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(one, other)| one.dot(*other)).sum()
    }

    /// Returns the distance of the corner that is farthest from the origin.
    #[inline]
    pub(super) fn farthest(&self) -> f64 {
        let [middle, x, y, z] = self.0;
        // |m + c|² = |m|² + |c|² + 2 m·c: of two opposite corners, the
        // corner along m is farther, so four corners are enough.
        let farthest =
            |corner: DVec3| middle.length_squared() + corner.length_squared() + 2.0 * middle.dot(corner).abs();
        let corners = [x + y + z, x + y - z, x - y + z, x - y - z];
        corners.into_iter().map(farthest).fold(0.0, f64::max).sqrt()
    }
}

/// Returns the largest motion of a point of the box from one placement to another.
fn displacement(held: &OrientedBox, from: &Placement, to: &Placement) -> f64 {
    BoxImage::of(held, to.rotation - from.rotation, to.translation - from.translation).farthest()
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::super::oracle::Random;
    use super::*;
    use crate::algebra::Pose;

    const SEED: u64 = 0x0D0;

    fn some_box(random: &mut Random) -> OrientedBox {
        let axes = DMat3::from_quat(random.rotation());
        OrientedBox { center: random.vector(), axes, half: random.vector().abs() }
    }

    #[test]
    fn sum_bounds_motion_and_change_of_distance() {
        let mut random = Random::new(SEED);
        for case in 0..200 {
            let (box_a, box_b) = (some_box(&mut random), some_box(&mut random));
            let point =
                |random: &mut Random, held: &OrientedBox| held.center + held.axes * (held.half * random.vector());
            let mut motion_bound = MotionBound::new(box_a, box_b);
            let mut pose = Pose::new(random.rotation(), random.vector() * 3.0);
            assert_eq!(motion_bound.advance(&pose.placement()), None);
            let (first, begin) = (pose.placement(), motion_bound.sum());
            for _ in 0..20 {
                let before = pose.placement();
                let turn = DQuat::from_scaled_axis(random.vector() * 0.1);
                pose = Pose::new(turn * pose.rotation, pose.translation + random.vector() * 0.1);
                let moved = motion_bound.advance(&pose.placement()).unwrap();
                let place = pose.placement();
                assert!(moved <= displacement(&box_a, &before, &place));
                for _ in 0..20 {
                    let (p, q) = (point(&mut random, &box_a), point(&mut random, &box_b));
                    let distance = |pose: &Placement| pose.point(p).distance(q);
                    assert!(
                        (distance(&place) - distance(&before)).abs() <= moved + 1e-12,
                        "seed {SEED:#x}, case {case}"
                    );
                    let spent = motion_bound.since(begin);
                    assert!((distance(&place) - distance(&first)).abs() <= spent, "seed {SEED:#x}, case {case}");
                }
            }
        }
    }

    #[test]
    fn exhausted_sum_is_reported_and_clearance_rounds_down() {
        let mut random = Random::new(SEED);
        let mut motion_bound = MotionBound::new(some_box(&mut random), some_box(&mut random));
        for clearance in [0.0, 1e-9, 0.3, 1e9, f64::INFINITY] {
            assert!(-motion_bound.since(motion_bound.due(clearance)) <= clearance);
        }
        assert!(motion_bound.spend(1.0));
        assert!(!motion_bound.spend(f64::NAN) && motion_bound.sum() == BEGIN);
        assert!(!motion_bound.spend(f64::INFINITY));
        assert!(motion_bound.spend(0.0) && motion_bound.sum() > 0);
    }

    #[test]
    fn expected_pose_repeats_the_last_motion() {
        let mut random = Random::new(SEED);
        for case in 0..100 {
            let (box_a, box_b) = (some_box(&mut random), some_box(&mut random));
            let mut motion_bound = MotionBound::new(box_a, box_b);
            let first = Pose::new(random.rotation(), random.vector() * 3.0);
            let step = Pose::new(DQuat::from_scaled_axis(random.vector() * 0.1), random.vector() * 0.1);
            motion_bound.advance(&first.placement());
            assert!(motion_bound.expected(1).is_none(), "seed {SEED:#x}, case {case}");
            let last = step * first;
            motion_bound.advance(&last.placement());
            let (pose, motion) = motion_bound.expected(3).unwrap();
            let repeated = (step * step * step * last).placement();
            let off = displacement(&box_a, &pose, &repeated);
            assert!(off < 1e-12, "seed {SEED:#x}, case {case}: {off}");
            assert_eq!(
                motion_bound.advance(&pose).map(|moved| moved <= motion),
                Some(true),
                "seed {SEED:#x}, case {case}"
            );
            motion_bound.advance(&pose);
            assert!(motion_bound.expected(1).is_none(), "seed {SEED:#x}, case {case}: no motion");
        }
    }
}
