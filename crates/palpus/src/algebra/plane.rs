//! Oriented planes.

use glam::DVec3;

/// The plane `normal · p = offset`; the side that `normal` points to is outside (positive).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: DVec3,
    /// Signed distance of the plane from the origin along `normal`.
    pub offset: f64,
}

impl Plane {
    /// Returns the signed distance of `p` from the plane, positive outside.
    #[inline]
    pub fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
}
