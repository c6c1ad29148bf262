//! The poses of the bench: random poses, and coherent sequences of poses like those of a fast hand
//! motion at 1 kHz. A coherent sequence is called a stretch.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};
use palpus::collision::{Proximity, initial_features, march};

use crate::shapes::{SEED, ShapePair, rotation};

/// Number of stretches per case. Each stretch has different orientations.
const STRETCHES: usize = 8;
/// Number of poses of a stretch.
const POSES: usize = 101;
/// Angle (rad) by which body a moves around body b from pose to pose. For bodies of 10 cm at 1 kHz,
/// this is 0.15 m/s.
const TRAVEL: f64 = 1e-3;
/// Angle (rad) by which a rolling body rotates from pose to pose.
const TURN: f64 = 2e-3;
/// Depth of the overlap when the bodies slide or roll, relative to the sum of their radii.
const OVERLAP: f64 = 0.05;
/// Distance of the bodies in coherent motions without contact, relative to the sum of their radii.
const GAP: f64 = 0.05;

/// Kind of motion between the poses of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// Body a moves around body b at a constant overlap.
    Sliding,
    /// Body a moves around body b at a constant overlap and rotates.
    Rolling,
    /// Body a moves near the centre of body b and rotates.
    Deep,
    /// The bodies overlap, at independent random poses.
    Cold,
    /// Body a moves around body b at a constant distance and rotates.
    ApartCoherent,
    /// The bodies are apart, at independent random poses.
    ApartCold,
}

impl Motion {
    pub(crate) const ALL: [Self; 6] =
        [Self::Sliding, Self::Rolling, Self::Deep, Self::Cold, Self::ApartCoherent, Self::ApartCold];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Sliding => "sliding",
            Self::Rolling => "rolling",
            Self::Deep => "deep",
            Self::Cold => "cold",
            Self::ApartCoherent => "apart",
            Self::ApartCold => "apart cold",
        }
    }

    /// Returns true if each pose is near the previous one.
    pub(crate) fn is_coherent(self) -> bool {
        !matches!(self, Self::Cold | Self::ApartCold)
    }

    /// Returns true if the bodies overlap.
    pub(crate) fn overlaps(self) -> bool {
        !matches!(self, Self::ApartCoherent | Self::ApartCold)
    }
}

/// One shape pair in one motion.
pub(crate) struct Case {
    pub(crate) motion: Motion,
    /// Poses of body a in the frame of body b, one list per stretch.
    pub(crate) stretches: Vec<Vec<Pose>>,
}

impl Case {
    pub(crate) fn new(shape: &ShapePair, motion: Motion) -> Self {
        let mut random = Random::new(SEED ^ (motion as u64 + 1) << 32);
        let stretches = (0..STRETCHES).map(|_| stretch(shape, motion, &mut random)).collect();
        Self { motion, stretches }
    }
}

fn stretch(shape: &ShapePair, motion: Motion, random: &mut Random) -> Vec<Pose> {
    let size = shape.a.radius() + shape.b.radius();
    let rotation = rotation(random);
    let axis = random.direction();
    let toward = random.direction();
    let around = toward.any_orthonormal_vector();
    match motion {
        Motion::Cold => (0..POSES).map(|_| random_pose(shape, random, true)).collect(),
        Motion::ApartCold => (0..POSES).map(|_| random_pose(shape, random, false)).collect(),
        Motion::Deep => (0..POSES)
            .map(|k| {
                let angle = TRAVEL * k as f64;
                let away = DQuat::from_axis_angle(around, angle) * toward * (0.1 * size);
                placed(shape, DQuat::from_axis_angle(axis, TURN * k as f64) * rotation, away)
            })
            .filter(|pose| overlap(shape, pose))
            .collect(),
        _ => {
            let turn = if motion == Motion::Sliding { 0.0 } else { TURN };
            let gap = if motion.overlaps() { -OVERLAP } else { GAP } * size;
            (0..POSES)
                .map(|k| {
                    let toward = DQuat::from_axis_angle(around, TRAVEL * k as f64) * toward;
                    let rotation = DQuat::from_axis_angle(axis, turn * k as f64) * rotation;
                    placed(shape, rotation, toward * (touching(shape, rotation, toward, size) + gap).max(0.0))
                })
                .filter(|pose| overlap(shape, pose) == motion.overlaps())
                .collect()
        }
    }
}

/// Returns the pose of body a in b for which the centroid of a is at `away` from the centroid of b.
fn placed(shape: &ShapePair, rotation: DQuat, away: DVec3) -> Pose {
    Pose::new(rotation, shape.b.centroid() + away - rotation * shape.a.centroid())
}

fn overlap(shape: &ShapePair, pose: &Pose) -> bool {
    let place = pose.placement();
    let start = initial_features(&shape.a, &shape.b, &place);
    matches!(march(&shape.a, &shape.b, &place, start).proximity, Proximity::Overlapping(_))
}

/// Returns the largest distance of the centroids along `toward` at which the bodies overlap, by
/// bisection.
fn touching(shape: &ShapePair, rotation: DQuat, toward: DVec3, size: f64) -> f64 {
    let (mut near, mut far) = (0.0, size);
    for _ in 0..40 {
        let middle = 0.5 * (near + far);
        if overlap(shape, &placed(shape, rotation, toward * middle)) {
            near = middle;
        } else {
            far = middle;
        }
    }
    far
}

fn random_pose(shape: &ShapePair, random: &mut Random, overlapping: bool) -> Pose {
    let size = shape.a.radius() + shape.b.radius();
    loop {
        let away = if overlapping { random.between(0.0, 0.9) } else { random.between(0.1, 1.5) };
        let pose = placed(shape, rotation(random), random.direction() * (size * away));
        if overlap(shape, &pose) == overlapping {
            return pose;
        }
    }
}
