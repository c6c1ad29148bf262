//! An incremental convex hull that can undo the latest insertions.
//!
//! The decomposition computes thousands of hulls that differ by one vertex, and discards most of
//! them. The decomposition needs only the half-spaces of these hulls, without adjacency and without
//! merged faces. All faces are triangles. A point *sees* a face if it is strictly above the face's
//! plane. The exact sign of a determinant decides this test, so coplanar and collinear points cause
//! no errors.
//!
//! 1. Start from four points that span a solid, chosen greedily to be far apart.
//! 2. For each further point, remove the faces that it sees, and add faces from the point to the
//!    sides of the hole (the horizon).
//! 3. [`TrialHull::mark`] records a state, and [`TrialHull::undo`] returns to it.

use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{NEEDLE_NORMAL, ORIENTATION_ROUNDING};
use crate::body::Aabb;

/// A triangle of a [`TrialHull`].
#[derive(Clone, Copy, Debug)]
pub(in crate::body) struct TrialFace {
    /// Indices of the points, counter-clockwise as seen from outside.
    pub(in crate::body) corners: [u32; 3],
    /// Outward plane of the face.
    pub(in crate::body) plane: Plane,
    /// Bound of the rounding error of heights above `plane` (m), for points of the hull. The bound
    /// is infinite for needles, because their normals consist of rounding errors.
    pub(in crate::body) slack: f64,
    pub(in crate::body) alive: bool,
}

impl TrialFace {
    /// Creates a face over three points. `reach` is the largest coordinate of the hull (m).
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

    /// Returns true if `p` is strictly above the plane of the face, whose corners are indices into
    /// `points`. The test is exact.
    #[inline]
    pub(in crate::body) fn is_seen_from(&self, p: DVec3, points: &[DVec3]) -> bool {
        let height = self.plane.height(p);
        if height.abs() > self.slack {
            return height > 0.0;
        }
        let [a, b, c] = self.corners.map(|k| points[k as usize].to_array());
        robust::orient3d(coordinates(a), coordinates(b), coordinates(c), coordinates(p.to_array())) < 0.0
    }
}

/// A recorded state of a hull, for [`TrialHull::undo`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark {
    points: usize,
    faces: usize,
    buried: usize,
}

/// An incremental hull. The hull is empty until [`TrialHull::start`] succeeds.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrialHull {
    points: Vec<DVec3>,
    faces: Vec<TrialFace>,
    /// Indices of removed faces, in order. [`TrialHull::undo`] restores them.
    buried: Vec<u32>,
    /// Number of removed faces that cannot be restored.
    dead: usize,
    horizon: Vec<(u32, u32)>,
    /// Largest coordinate of the points (m). Rounding errors are proportional to this value.
    reach: f64,
}

impl TrialHull {
    /// Removes all points.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.faces.clear();
        self.buried.clear();
        self.dead = 0;
    }

    /// Returns true if the hull has no faces.
    pub(crate) fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// Builds the hull of the given points. If all points lie within `thickness` (m) of one plane,
    /// returns false and leaves the hull empty.
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
                // Removed faces would slow down the next insertion.
                self.settle();
            }
        }
        true
    }

    /// Adds the point `p`. Returns true if `p` was outside the hull.
    pub(crate) fn insert(&mut self, p: DVec3) -> bool {
        self.reach = self.reach.max(p.abs().max_element());
        let first_buried = self.buried.len();
        for k in 0..self.faces.len() {
            if self.faces[k].alive && self.faces[k].is_seen_from(p, &self.points) {
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

    /// Returns to a marked state. [`TrialHull::settle`] must not have been called since the mark.
    pub(crate) fn undo(&mut self, mark: Mark) {
        for k in self.buried.drain(mark.buried..) {
            self.faces[k as usize].alive = true;
        }
        self.faces.truncate(mark.faces);
        self.points.truncate(mark.points);
    }

    /// Makes the current state final. Earlier marks become invalid.
    pub(crate) fn settle(&mut self) {
        self.dead += self.buried.len();
        self.buried.clear();
        // Removes dead faces only if they are the majority, because the removal moves all faces.
        if 2 * self.dead > self.faces.len() {
            self.faces.retain(|face| face.alive);
            self.dead = 0;
        }
    }

    /// Returns the outward planes, newest first. Leaves out needles, because their normals
    /// consist of rounding errors.
    pub(crate) fn planes(&self) -> impl Iterator<Item = Plane> + Clone {
        self.faces.iter().rev().filter(|face| face.alive && face.slack.is_finite()).map(|face| face.plane)
    }

    fn point(&self, k: u32) -> DVec3 {
        self.points[k as usize]
    }

    /// Returns a box around the volume that the hull gained since a mark; `None` if the hull did
    /// not grow. The box contains the removed faces and the new points.
    pub(crate) fn gained_since(&self, mark: Mark) -> Option<Aabb> {
        if self.points.len() == mark.points {
            return None;
        }
        let old = self.buried[mark.buried..].iter().flat_map(|&k| self.faces[k as usize].corners);
        Some(Aabb::around(old.chain(mark.points as u32..self.points.len() as u32).map(|k| self.point(k))))
    }

    /// Finds the horizon: the sides between faces removed since index `first` and remaining faces.
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

/// Finds four points that span a tetrahedron thicker than `thickness` (m); `None` if the points are
/// thinner. The first three are counter-clockwise as seen from the side opposite to the fourth.
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
