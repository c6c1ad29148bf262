//! Axis-aligned boxes.

use glam::DVec3;

use crate::algebra::Pose;

/// An axis-aligned box that includes its boundary. Coordinates are in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The empty box: it overlaps no box, and its union with a box is that box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Returns the smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// Returns the smallest box around both boxes.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns the smallest axis-aligned box around this box at `pose`. This box must not be empty.
    pub fn placed(&self, pose: &Pose) -> Self {
        debug_assert!(self.min.cmple(self.max).all(), "an empty box has no place");
        let ends = [self.min, self.max];
        let corners = ends.map(|x| ends.map(|y| ends.map(|z| pose.point(DVec3::new(x.x, y.y, z.z)))));
        Self::around(corners.into_iter().flatten().flatten())
    }

    /// Returns the box whose faces are farther out by `margin`.
    #[inline]
    pub fn grown(&self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// Returns the length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        self.min.distance(self.max)
    }

    /// Returns true if the boxes have a common point.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Returns true if `p` is in the box.
    #[inline]
    pub fn holds(&self, p: DVec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// Returns the square of the distance of `p` from the box; 0 if `p` is inside.
    #[inline]
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        (p.max(self.min).min(self.max) - p).length_squared()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_4;

    use glam::DQuat;

    use super::*;

    #[test]
    fn placed_box_is_around_all_corners() {
        let flat = Aabb { min: DVec3::new(-1.0, -2.0, -3.0), max: DVec3::new(1.0, 2.0, 5.0) };
        let placed = flat.placed(&Pose::new(DQuat::from_rotation_z(FRAC_PI_4), DVec3::new(10.0, 0.0, 0.0)));
        let side = 3.0 * 0.5f64.sqrt();
        let expected = Aabb { min: DVec3::new(10.0 - side, -side, -3.0), max: DVec3::new(10.0 + side, side, 5.0) };
        assert!((placed.min - expected.min).length() < 1e-12 && (placed.max - expected.max).length() < 1e-12);
        assert_eq!(flat.grown(0.5), Aabb { min: flat.min - 0.5, max: flat.max + 0.5 });
    }
}
