//! Axis-aligned boxes.

use glam::DVec3;

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
