//! Tests whether the hull of a patch stays inside the solid \[K02 §3.2, EL01\].
//!
//! The hull H of a patch lies in the solid if and only if **no point of the surface lies in the
//! interior of H**. The interior of H is connected. If the surface never enters the interior, the
//! interior is wholly inside or wholly outside the solid. Just below an original face, the interior
//! is inside the solid, so the whole interior is inside.
//!
//! This single test detects three kinds of faults: a virtual face that crosses the surface, a
//! virtual face that covers a notch, and a hull that contains a whole cavity. A notch is detected
//! because its walls go from the virtual face down into H.
//!
//! The test does not have to decide which points are inside the solid, so it also applies to open
//! and self-intersecting surfaces. For these surfaces, the test ensures that no part of the surface
//! passes through a piece. On these surfaces the test has two limits. A piece may extend across the
//! opening of an open surface. Where parts of the surface overlap, the normals of each patch define
//! its inside.
//!
//! 1. Search the triangle tree for the triangles near the volume that the hull gained.
//! 2. Clip each triangle by the planes of all faces of H. The planes are moved inward by a small
//!    distance (see [`ENTERED`](crate::algebra::tolerance::ENTERED)), so that shared corners and
//!    sides do not count. The triangle enters H if a part of it remains.

#[cfg(test)]
pub(in crate::body) mod oracle;

use glam::DVec3;

use crate::algebra::Plane;

/// A polygon that starts as a triangle and is clipped by one plane after another.
#[derive(Clone, Debug, Default)]
pub(in crate::body) struct Cuts {
    polygon: Vec<DVec3>,
    clipped: Vec<DVec3>,
}

impl Cuts {
    /// Starts with the whole triangle.
    pub(in crate::body) fn begin(&mut self, triangle: [DVec3; 3]) {
        self.polygon.clear();
        self.polygon.extend(triangle);
    }

    /// Returns the mean of the corners of the remaining polygon.
    pub(in crate::body) fn middle(&self) -> DVec3 {
        self.polygon.iter().sum::<DVec3>() / self.polygon.len().max(1) as f64
    }

    /// Keeps the part that is deeper than `depth` (m) below `plane`. Returns false if nothing
    /// remains.
    pub(in crate::body) fn cut(&mut self, plane: Plane, depth: f64) -> bool {
        // Most planes cut nothing off.
        if self.polygon.iter().all(|p| plane.height(*p) + depth < 0.0) {
            return !self.polygon.is_empty();
        }
        self.clipped.clear();
        let n = self.polygon.len();
        for k in 0..n {
            let (p, q) = (self.polygon[k], self.polygon[(k + 1) % n]);
            let (hp, hq) = (plane.height(p) + depth, plane.height(q) + depth);
            if hp < 0.0 {
                self.clipped.push(p);
            }
            if (hp < 0.0) != (hq < 0.0) {
                self.clipped.push(p + (q - p) * (hp / (hp - hq)));
            }
        }
        std::mem::swap(&mut self.polygon, &mut self.clipped);
        !self.polygon.is_empty()
    }
}

/// Working memory of [`Clipper::enters`].
#[derive(Debug, Default)]
pub(crate) struct Clipper {
    cuts: Cuts,
}

impl Clipper {
    /// Returns true if a part of the triangle is deeper than `depth` (m) below all `planes`, which
    /// are the outward planes of the hull.
    pub(crate) fn enters(
        &mut self,
        triangle: [DVec3; 3],
        planes: impl Iterator<Item = Plane> + Clone,
        depth: f64,
    ) -> bool {
        if planes.clone().any(|plane| triangle.iter().all(|p| plane.height(*p) >= -depth)) {
            return false;
        }
        self.cuts.begin(triangle);
        planes.into_iter().all(|plane| self.cuts.cut(plane, depth))
    }
}
