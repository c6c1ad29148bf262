//! The simplex of corners of GJK, and its point nearest to the origin.

use glam::DVec3;

use crate::algebra::Placement;
use crate::algebra::tolerance::MARCH_NOISE;
use crate::body::Polytope;

/// A point of the CSO: the difference of two vertices, in b's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) a: u32,
    pub(super) b: u32,
    pub(super) point_b: DVec3,
    pub(super) difference: DVec3,
}

impl Corner {
    pub(super) fn new(a: &Polytope, b: &Polytope, pose_ba: &Placement, va: u32, vb: u32) -> Self {
        let (point_a, point_b) = (pose_ba.point(a.vertex(va)), b.vertex(vb));
        Self { a: va, b: vb, point_b, difference: point_a - point_b }
    }
}

/// Result of adding a corner.
pub(super) enum Reduction {
    /// The simplex was reduced to the corners with a positive weight in its nearest point.
    Nearest,
    /// Four corners enclose the origin. The value is the outward normal of the nearest of the four
    /// triangles.
    Encloses(DVec3),
}

/// Up to four corners, and their weights in the point of their hull nearest to the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Simplex {
    pub(super) corners: [Corner; 4],
    weights: [f64; 4],
    pub(super) count: usize,
    noise: f64,
}

impl Simplex {
    pub(super) fn new(corner: Corner, noise: f64) -> Self {
        Self { corners: [corner; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1, noise }
    }

    pub(super) fn nearest(&self) -> DVec3 {
        self.weighted(|c| c.difference)
    }

    /// Returns the unit vector from the origin to the nearest point.
    ///
    /// For a triangle, it is computed from the plane, and for a segment it is made perpendicular to
    /// the segment. So it does not depend on the rounding of a nearest point close to the origin.
    pub(super) fn normal(&self) -> DVec3 {
        let nearest = self.nearest();
        let p = self.corners[0].difference;
        let d = self.corners[1].difference - p;
        if self.count == 3 {
            let e = self.corners[2].difference - p;
            let cross = d.cross(e);
            // The relative error of a cross product is an ulp over the sine of its angle. The
            // error of the nearest point is a few ulps of the coordinates.
            let sine_reach = cross.length() * self.noise / MARCH_NOISE;
            if sine_reach * sine_reach > nearest.length_squared() * (d.length_squared() * e.length_squared()) {
                return cross.normalize() * cross.dot(nearest).signum();
            }
        }
        if self.count == 2 {
            let unit = nearest.normalize();
            return (unit - d * (unit.dot(d) / d.length_squared())).normalize_or(unit);
        }
        nearest.normalize()
    }

    pub(super) fn weighted(&self, of: impl Fn(&Corner) -> DVec3) -> DVec3 {
        self.corners[..self.count].iter().zip(&self.weights).fold(DVec3::ZERO, |sum, (c, w)| sum + of(c) * *w)
    }

    pub(super) fn newest(&self) -> Corner {
        self.corners[self.count - 1]
    }

    pub(super) fn contains(&self, corner: &Corner) -> bool {
        self.corners[..self.count].iter().any(|c| c.a == corner.a && c.b == corner.b)
    }

    /// Adds `corner` and finds the nearest point again.
    ///
    /// The nearest point of the old corners is known, so only sub-simplices with the new corner can
    /// be better.
    pub(super) fn add(&mut self, corner: Corner) -> Reduction {
        let n = self.count;
        self.corners[n] = corner;
        if n == 3
            && let Some(outward) = self.enclosing()
        {
            self.count = 4;
            self.weights = [0.25; 4];
            return Reduction::Encloses(outward);
        }
        let w = corner.difference;
        let mut best = Candidate { distance_squared: w.length_squared(), weights: [0.0; 4] };
        best.weights[n] = 1.0;
        for i in 0..n {
            best.consider(self, self.on_segment(n, i));
            for j in i + 1..n {
                best.consider(self, self.in_triangle(n, i, j));
            }
        }
        let mut kept = 0;
        for k in 0..=n {
            if best.weights[k] > 0.0 {
                self.corners[kept] = self.corners[k];
                self.weights[kept] = best.weights[k];
                kept += 1;
            }
        }
        self.count = kept;
        Reduction::Nearest
    }

    fn on_segment(&self, i: usize, j: usize) -> Option<[f64; 4]> {
        let (p, q) = (self.corners[i].difference, self.corners[j].difference);
        let d = q - p;
        let length_squared = d.length_squared();
        let t = -p.dot(d) / length_squared;
        // The ends are separate candidates.
        (t > 0.0 && t < 1.0).then(|| {
            let mut weights = [0.0; 4];
            (weights[i], weights[j]) = (1.0 - t, t);
            weights
        })
    }

    /// Returns the weights of the origin's projection onto the plane of three corners, if it lies
    /// in their triangle.
    ///
    /// The system is solved by orthogonalising one side against the other, and once more for the
    /// remainder. The Gram determinant of a sliver would lose all digits.
    fn in_triangle(&self, i: usize, j: usize, k: usize) -> Option<[f64; 4]> {
        let p = self.corners[i].difference;
        let (d, e) = (self.corners[j].difference - p, self.corners[k].difference - p);
        let (d, e, swapped) = if d.length_squared() > e.length_squared() { (e, d, true) } else { (d, e, false) };
        let ee = e.length_squared();
        let ratio = d.dot(e) / ee;
        let across = d - e * ratio;
        let height_squared = across.length_squared();
        if height_squared <= self.noise * self.noise {
            return None;
        }
        let (mut s, mut t) = (0.0, 0.0);
        for _ in 0..2 {
            let rest = -(p + d * s + e * t);
            let ds = rest.dot(across) / height_squared;
            s += ds;
            t += rest.dot(e) / ee - ds * ratio;
        }
        (s > 0.0 && t > 0.0 && s + t < 1.0).then(|| {
            let mut weights = [0.0; 4];
            weights[i] = 1.0 - s - t;
            (weights[j], weights[k]) = if swapped { (t, s) } else { (s, t) };
            weights
        })
    }

    /// If four corners enclose the origin, returns the outward normal (not unit) of the triangle
    /// nearest to the origin.
    fn enclosing(&self) -> Option<DVec3> {
        let mut nearest = f64::INFINITY;
        let mut outward = DVec3::ZERO;
        for [i, j, k, apex] in [[0, 1, 2, 3], [0, 3, 1, 2], [1, 3, 2, 0], [2, 3, 0, 1]] {
            let p = self.corners[i].difference;
            let (d, e) = (self.corners[j].difference - p, self.corners[k].difference - p);
            let normal = d.cross(e);
            let length = normal.length();
            let apex_height = normal.dot(self.corners[apex].difference - p);
            let height = -normal.dot(p) * apex_height.signum();
            // A tetrahedron flatter than the rounding of its normals has no interior; then only its
            // triangles are used.
            let rounding = self.noise * (d.length_squared() * e.length_squared()).sqrt();
            if apex_height.abs() <= rounding || height < rounding {
                return None;
            }
            let depth = height / length;
            if depth < nearest {
                nearest = depth;
                outward = if apex_height > 0.0 { -normal } else { normal };
            }
        }
        Some(outward)
    }
}

/// The best sub-simplex so far.
struct Candidate {
    distance_squared: f64,
    weights: [f64; 4],
}

impl Candidate {
    fn consider(&mut self, simplex: &Simplex, weights: Option<[f64; 4]>) {
        let Some(weights) = weights else { return };
        let point = simplex.corners.iter().zip(&weights).fold(DVec3::ZERO, |sum, (c, w)| sum + c.difference * *w);
        let distance_squared = point.length_squared();
        if distance_squared < self.distance_squared {
            *self = Self { distance_squared, weights };
        }
    }
}
