//! Sights: a cheap lower bound of the gap of a pair that is due, from one point and one direction.
//!
//! When a pair's gap along a normal is known, the pair keeps the normal n (b's frame), the middle c
//! and radius r of a's volume, and the gap less n·c. At a later pose the gap along n has changed by
//! n times the motion of c, except for the rotation: by an angle θ, it moves the other points of a
//! by at most rθ relative to c. So the gap is at least
//!
//! n·c + (gap − n·c at the earlier pose) − rθ,
//!
//! which needs no vertex. Parts that slide along each other keep this bound for many ticks.

use glam::{DVec3, Vec3};

use super::{Front, PlacedPair};
use crate::algebra::tolerance::SIGHT_ROUNDING;

/// The sight of the pair at a place, in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    normal: Vec3,
    middle: Vec3,
    /// Model units; minus infinity without a sight.
    base: f32,
    radius: f32,
    /// The sum of all turns when the gap was found, rad.
    turned: f64,
}

impl Sight {
    /// No bound.
    pub(super) const NONE: Self =
        Self { normal: Vec3::ZERO, middle: Vec3::ZERO, base: f32::NEG_INFINITY, radius: 0.0, turned: 0.0 };
}

impl Front {
    /// Keeps that the gap of the pair at `place` along `normal` (unit, b's frame) is `gap` (model
    /// units).
    pub(super) fn sight(&mut self, query: &PlacedPair<'_>, place: u32, normal: DVec3, gap: f64) {
        let sphere = &query.a.hierarchy.node(self.pairs[place as usize].a).sphere;
        let (normal, middle) = (normal.as_vec3(), sphere.center.as_vec3());
        let at = query.pose_ba.point(middle.as_dvec3());
        // The rounded normal and middle are exact from here on; the gap along that normal differs by
        // less than the rounding times the sizes.
        let size = at.length() + sphere.radius;
        let base = gap - normal.as_dvec3().dot(at) - SIGHT_ROUNDING * size;
        let radius = (sphere.radius + middle.as_dvec3().distance(sphere.center)) as f32 * (1.0 + f32::EPSILON);
        self.sights[place as usize] =
            Sight { normal, middle, base: base as f32, radius, turned: self.motion_bound.turned() };
    }

    /// The bound at the query's pose, model units; minus infinity without a sight.
    pub(super) fn sighted_gap(&self, query: &PlacedPair<'_>, place: u32) -> f64 {
        let Sight { normal, middle, base, radius, turned } = self.sights[place as usize];
        let along = normal.as_dvec3().dot(query.pose_ba.point(middle.as_dvec3()));
        along + f64::from(base) - f64::from(radius) * (self.motion_bound.turned() - turned)
    }
}
