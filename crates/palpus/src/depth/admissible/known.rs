//! Supports that the search has found, to reject facets without a new support.

use glam::DVec3;

use crate::algebra::Plane;

/// Number of stored points. The two sides of a thin piece have different supports, so one point is
/// not enough.
const POINTS: usize = 3;

/// The last points of a body that supported a normal, the newest first, in the frame of the planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownPoints([DVec3; POINTS]);

impl KnownPoints {
    pub(super) fn new(point: DVec3) -> Self {
        Self([point; POINTS])
    }

    /// Returns the newest point.
    #[inline]
    pub(super) fn newest(&self) -> DVec3 {
        self.0[0]
    }

    /// Adds a point in place of the oldest one.
    #[inline]
    pub(super) fn add(&mut self, point: DVec3) {
        let [newest, older, _] = self.0;
        self.0 = [point, newest, older];
    }

    /// Returns true if a point lies at least `bar` below the plane. Then h along its normal is at
    /// least `bar`.
    #[inline]
    pub(super) fn reject(&self, plane: Plane, bar: f64) -> bool {
        self.0.iter().any(|&point| -plane.height(point) >= bar)
    }

    /// Returns true if one point lies at least `bar` below both planes at the ends of an arc. Then
    /// h is at least `bar` everywhere on the arc.
    #[inline]
    pub(super) fn reject_arc(&self, [left, right]: [Plane; 2], bar: f64) -> bool {
        self.0.iter().any(|&point| -left.height(point) >= bar && -right.height(point) >= bar)
    }
}
