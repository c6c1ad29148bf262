//! Containment: does a convex hull stay inside the solid that its patch bounds \[K02 §3.2, EL01\]?
//!
//! The hull H of a patch lies in the solid exactly when **no point of the surface lies in the
//! interior of H**. One test does the work of three (a virtual face crosses the surface; a virtual
//! face lies outside without crossing anything, as over the notch of an L; a hull swallows a whole
//! hollow): the interior of H is connected, so if the surface never enters it, it lies wholly
//! inside or wholly outside, and just under an original face it is inside. A notch covered by a
//! virtual face has walls that start in that face and go down into H.
//!
//! The rule needs no inside test, so it applies to every surface: for an open or self-intersecting
//! one it says that no sheet passes through a piece. It then has two limits. A piece may bulge over
//! the opening of an open surface, and where sheets overlap, each patch's own normals decide what
//! is inside.
//!
//! 1. The triangle tree gives the triangles of the surface near the volume that the hull gained.
//! 2. A triangle enters H when something of it is left after clipping by every face's plane, moved
//!    inward by [`ENTERED`](crate::algebra::tolerance::ENTERED): touching along shared corners and
//!    sides is not entering.

#[cfg(test)]
pub(in crate::body) mod oracle;

use glam::DVec3;

use crate::algebra::Plane;

/// A triangle that is clipped by one plane after another.
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

    /// Mean of the corners of what is left.
    pub(in crate::body) fn middle(&self) -> DVec3 {
        self.polygon.iter().sum::<DVec3>() / self.polygon.len().max(1) as f64
    }

    /// Keeps the part deeper than `depth` below a plane; false if nothing is left.
    pub(in crate::body) fn cut(&mut self, plane: Plane, depth: f64) -> bool {
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
    /// True when the triangle comes deeper than `depth` into the hull with these outward planes.
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
