//! The poses of the bench: random ones, and coherent stretches as a brisk hand makes them at 1 kHz.

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};
use palpus::collision::{Proximity, initial_features, march};

use crate::shapes::{SEED, ShapePair, rotation};

/// Stretches per case, each of its own pair of orientations.
const STRETCHES: usize = 8;
/// Poses of a stretch.
const POSES: usize = 101;
/// Radians that a body travels around the other per pose: 0.15 m/s for bodies of 10 cm at 1 kHz.
const TRAVEL: f64 = 1e-3;
/// Radians that a rolling body turns per pose.
const TURN: f64 = 2e-3;
/// Relative to the sum of radii: how far the bodies overlap when they slide or roll, and how far
/// they are apart.
const OVERLAP: f64 = 0.05;
const GAP: f64 = 0.05;

/// How the poses of a case follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    /// Around the body at a constant overlap.
    Sliding,
    /// The same, and turning.
    Rolling,
    /// Near the other's centre, turning.
    Deep,
    /// Overlapping, each pose for itself.
    Cold,
    /// Apart: around the body at a constant gap, turning.
    ApartCoherent,
    /// Apart: each pose for itself.
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

    /// True if a pose is near the one before.
    pub(crate) fn is_coherent(self) -> bool {
        !matches!(self, Self::Cold | Self::ApartCold)
    }

    /// True if the bodies overlap.
    pub(crate) fn overlaps(self) -> bool {
        !matches!(self, Self::ApartCoherent | Self::ApartCold)
    }
}

/// One shape pair in one motion.
pub(crate) struct Case {
    pub(crate) motion: Motion,
    /// Poses of a in b.
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

/// a's centroid `away` from b's.
fn placed(shape: &ShapePair, rotation: DQuat, away: DVec3) -> Pose {
    Pose::new(rotation, shape.b.centroid() + away - rotation * shape.a.centroid())
}

fn overlap(shape: &ShapePair, pose: &Pose) -> bool {
    let place = pose.placement();
    let start = initial_features(&shape.a, &shape.b, &place);
    matches!(march(&shape.a, &shape.b, &place, start).proximity, Proximity::Overlapping(_))
}

/// The distance of the centroids along `toward` at which the bodies begin to touch.
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
