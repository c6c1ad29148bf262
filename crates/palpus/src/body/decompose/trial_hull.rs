//! A convex hull that grows point by point and can take the last points back.
//!
//! The decomposition computes thousands of hulls that differ by one vertex and discards most of
//! them. It needs only their half-spaces, neither adjacency nor merged faces. Faces are triangles.
//! The exact sign of a determinant decides which faces a new point sees, so coplanar and collinear
//! points cause no errors: a point in the plane of a face does not see the face.
//!
//! 1. Start from four points that span a solid, chosen greedily to be far apart.
//! 2. Each further point removes the faces that it sees and is joined to the sides of the hole (the
//!    horizon).
//! 3. [`TrialHull::mark`] records a state; [`TrialHull::undo`] returns to it.

use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{NEEDLE_NORMAL, ORIENTATION_ROUNDING};
use crate::body::Aabb;

/// A triangle of a [`TrialHull`].
#[derive(Clone, Copy, Debug)]
pub(in crate::body) struct TrialFace {
    /// Indices of the points, counter-clockwise seen from outside.
    pub(in crate::body) corners: [u32; 3],
    /// Outward.
    pub(in crate::body) plane: Plane,
    /// Error of `plane` at a distance of the hull's size, metres; infinite for needles, whose
    /// normal is noise.
    pub(in crate::body) slack: f64,
    pub(in crate::body) alive: bool,
}

impl TrialFace {
    /// A face over three points; `reach` is the largest coordinate of the hull.
    #[inline]
    pub(in crate::body) fn new(corners: [u32; 3], [a, b, c]: [DVec3; 3], reach: f64) -> Self {
        let across = (b - a).cross(c - a);
        let (area, longest) =
            (across.length(), (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared()));
        let needle = area <= NEEDLE_NORMAL * longest;
        let normal = if needle { across.normalize_or_zero() } else { across / area };
        let slack = if needle { f64::INFINITY } else { ORIENTATION_ROUNDING * reach * longest / area };
        Self { corners, plane: Plane { normal, offset: normal.dot(a) }, slack, alive: true }
    }

    /// True when `p` is strictly above the plane of the face's `points`; exact.
    #[inline]
    pub(in crate::body) fn is_seen_from(&self, p: DVec3, points: [DVec3; 3]) -> bool {
        let height = self.plane.height(p);
        if height.abs() > self.slack {
            return height > 0.0;
        }
        let [a, b, c] = points.map(|p| p.to_array());
        robust::orient3d(coordinates(a), coordinates(b), coordinates(c), coordinates(p.to_array())) < 0.0
    }
}

/// A state that the hull can return to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark {
    points: usize,
    faces: usize,
    buried: usize,
}

/// An incremental hull; empty until [`TrialHull::start`] has succeeded.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrialHull {
    points: Vec<DVec3>,
    faces: Vec<TrialFace>,
    /// Faces killed, in order; undoing revives them.
    buried: Vec<u32>,
    /// Faces that are neither alive nor to be revived.
    dead: usize,
    horizon: Vec<(u32, u32)>,
    /// Largest coordinate among the points; rounding errors are relative to it.
    reach: f64,
}

impl TrialHull {
    /// Forgets all points.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.faces.clear();
        self.buried.clear();
        self.dead = 0;
    }

    /// True before a start has succeeded.
    pub(crate) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Hull of the given points; false, and empty, when they all lie within `thickness` of one
    /// plane.
    pub(crate) fn start(&mut self, points: &[DVec3], thickness: f64) -> bool {
        self.clear();
        self.reach = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let Some(simplex) = spanning_simplex(points, thickness) else { return false };
        self.points.extend(simplex.map(|k| points[k]));
        for corners in [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]] {
            self.push(corners);
        }
        for (k, p) in points.iter().enumerate() {
            if !simplex.contains(&k) {
                self.insert(*p);
            }
        }
        self.settle();
        true
    }

    /// Adds a point; returns true when it lay outside.
    pub(crate) fn insert(&mut self, p: DVec3) -> bool {
        self.reach = self.reach.max(p.abs().max_element());
        let first_buried = self.buried.len();
        for k in 0..self.faces.len() {
            if self.faces[k].alive && self.sees(p, &self.faces[k]) {
                self.faces[k].alive = false;
                self.buried.push(k as u32);
            }
        }
        if self.buried.len() == first_buried {
            return false;
        }
        let apex = self.points.len() as u32;
        self.points.push(p);
        self.find_horizon(first_buried);
        for k in 0..self.horizon.len() {
            let (tail, head) = self.horizon[k];
            self.push([tail, head, apex]);
        }
        true
    }

    /// Records the current state.
    pub(crate) fn mark(&self) -> Mark {
        Mark { points: self.points.len(), faces: self.faces.len(), buried: self.buried.len() }
    }

    /// Returns to a marked state. Valid only if [`TrialHull::settle`] has not been called since.
    pub(crate) fn undo(&mut self, mark: Mark) {
        for k in self.buried.drain(mark.buried..) {
            self.faces[k as usize].alive = true;
        }
        self.faces.truncate(mark.faces);
        self.points.truncate(mark.points);
    }

    /// Makes the current state final; earlier marks become invalid.
    pub(crate) fn settle(&mut self) {
        self.dead += self.buried.len();
        self.buried.clear();
        // Compacts only now and then, because doing so for each point would move all faces each
        // time.
        if 2 * self.dead > self.faces.len() {
            self.faces.retain(|face| face.alive);
            self.dead = 0;
        }
    }

    /// The outward planes, newest first; those of needles are left out, their normals being noise.
    pub(crate) fn planes(&self) -> impl Iterator<Item = Plane> + Clone {
        self.faces.iter().rev().filter(|face| face.alive && face.slack.is_finite()).map(|face| face.plane)
    }

    fn point(&self, k: u32) -> DVec3 {
        self.points[k as usize]
    }

    /// Bounds of the hull's growth since a mark: the removed faces and the new points; `None`
    /// without growth.
    pub(crate) fn gained_since(&self, mark: Mark) -> Option<Aabb> {
        if self.points.len() == mark.points {
            return None;
        }
        let old = self.buried[mark.buried..].iter().flat_map(|&k| self.faces[k as usize].corners);
        Some(Aabb::around(old.chain(mark.points as u32..self.points.len() as u32).map(|k| self.point(k))))
    }

    fn sees(&self, p: DVec3, face: &TrialFace) -> bool {
        face.is_seen_from(p, face.corners.map(|k| self.point(k)))
    }

    /// Sides of the faces buried from `first` on whose other side is still alive.
    fn find_horizon(&mut self, first: usize) {
        self.horizon.clear();
        for &k in &self.buried[first..] {
            let [a, b, c] = self.faces[k as usize].corners;
            for (tail, head) in [(a, b), (b, c), (c, a)] {
                if let Some(twin) = self.horizon.iter().position(|&side| side == (head, tail)) {
                    self.horizon.swap_remove(twin);
                } else {
                    self.horizon.push((tail, head));
                }
            }
        }
    }

    fn push(&mut self, corners: [u32; 3]) {
        self.faces.push(TrialFace::new(corners, corners.map(|k| self.point(k)), self.reach));
    }
}

fn coordinates([x, y, z]: [f64; 3]) -> robust::Coord3D<f64> {
    robust::Coord3D { x, y, z }
}

/// Four points that span a solid thicker than `thickness`, ordered so that the first three are
/// counter-clockwise seen from the side away from the fourth.
pub(in crate::body) fn spanning_simplex(points: &[DVec3], thickness: f64) -> Option<[usize; 4]> {
    let farthest = |score: &dyn Fn(DVec3) -> f64| {
        let mut best = (0, f64::NEG_INFINITY);
        for (k, p) in points.iter().enumerate() {
            let s = score(*p);
            if s > best.1 {
                best = (k, s);
            }
        }
        best
    };
    let origin = *points.first()?;
    let (a, _) = farthest(&|p| p.distance_squared(origin));
    let (b, length) = farthest(&|p| p.distance_squared(points[a]));
    if length <= 0.0 {
        return None;
    }
    let axis = (points[b] - points[a]).normalize_or_zero();
    let (c, width) = farthest(&|p| (p - points[a]).cross(axis).length_squared());
    let normal = (points[b] - points[a]).cross(points[c] - points[a]).normalize_or_zero();
    if width <= 0.0 || normal == DVec3::ZERO {
        return None;
    }
    let (d, height) = farthest(&|p| normal.dot(p - points[a]).abs());
    if height <= thickness {
        return None;
    }
    let above = normal.dot(points[d] - points[a]) > 0.0;
    Some(if above { [a, c, b, d] } else { [a, b, c, d] })
}
