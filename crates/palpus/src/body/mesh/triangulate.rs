//! Cuts polygons into triangles by ear clipping.
//!
//! 1. Project the polygon along the coordinate axis nearest to its area normal. The projection only
//!    drops a coordinate. Therefore all tests below are exact for the given coordinates, even if
//!    the polygon is not planar.
//! 2. Cut a quad along a diagonal that lies inside. If both diagonals lie inside, take the shorter
//!    one.
//! 3. Cut off the ears of a larger polygon, the ear with the shortest cut first. A corner is an ear
//!    if it turns strictly left and no other corner lies in its closed triangle. A straight corner
//!    is not an ear. Therefore a corner on a straight side becomes a corner of triangles with
//!    positive area, and the surface stays closed along that side.
//! 4. If there is no ear, the polygon crosses itself. In this case, cut off the corner with the
//!    sharpest left turn, and return [`Cut::SelfCrossing`].
//!
//! Reference for the ear theorem: G. Meisters, *Polygons have ears*, 1975.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};

use crate::body::mesh::triangle_pair::turn;

/// Result of cutting one polygon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// The polygon of `n` corners was cut into `n − 2` triangles with its orientation.
    Whole,
    /// The projected polygon crosses itself. The polygon was cut into triangles, but the triangles
    /// do not cover a well-defined region.
    SelfCrossing,
    /// The polygon has no area in any projection, or fewer than three corners. There are no
    /// triangles.
    Degenerate,
}

/// Cuts a polygon into triangles. `polygon` has the indices of its corners in `points`; consecutive
/// corners must differ. Appends the triangles to `triangles`, with the orientation of the polygon.
pub fn triangulate(points: &[DVec3], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) -> Cut {
    if polygon.len() < 3 {
        return Cut::Degenerate;
    }
    if let [a, b, c] = *polygon {
        triangles.push([a, b, c]);
        return Cut::Whole;
    }
    let Some(flat) = project(points, polygon) else { return Cut::Degenerate };
    if flat.len() == 4
        && let Some(diagonal) = quad_diagonal(&flat, points, polygon)
    {
        let (i, j, k, l) = (diagonal, diagonal + 1, diagonal + 2, (diagonal + 3) % 4);
        triangles.push([polygon[i], polygon[j], polygon[k]]);
        triangles.push([polygon[i], polygon[k], polygon[l]]);
        return Cut::Whole;
    }
    EarCutter::new(flat, polygon).cut(triangles)
}

/// Projects the corners by dropping the coordinate in which the polygon's area normal is largest.
/// Mirrors the result if necessary, so that the area is positive. Returns `None` if the polygon has
/// no area.
fn project(points: &[DVec3], polygon: &[u32]) -> Option<Vec<DVec2>> {
    let origin = points[polygon[0] as usize];
    let corner = |i: usize| points[polygon[i % polygon.len()] as usize];
    let area: DVec3 = (1..polygon.len()).map(|i| (corner(i) - origin).cross(corner(i + 1) - origin)).sum();
    let size = area.abs();
    if size.max_element() <= 0.0 {
        return None;
    }
    let flatten = |p: DVec3| {
        if size.x >= size.y && size.x >= size.z {
            if area.x > 0.0 { DVec2::new(p.y, p.z) } else { DVec2::new(p.z, p.y) }
        } else if size.y >= size.z {
            if area.y > 0.0 { DVec2::new(p.z, p.x) } else { DVec2::new(p.x, p.z) }
        } else if area.z > 0.0 {
            DVec2::new(p.x, p.y)
        } else {
            DVec2::new(p.y, p.x)
        }
    };
    Some((0..polygon.len()).map(|i| flatten(corner(i))).collect())
}

/// Returns 0 for the diagonal of a quad from corner 0 to 2, and 1 for the diagonal from corner 1 to
/// 3; `None` if neither diagonal lies inside.
fn quad_diagonal(flat: &[DVec2], points: &[DVec3], polygon: &[u32]) -> Option<usize> {
    let inside = |i: usize, j: usize, k: usize, l: usize| {
        turn(flat[i], flat[j], flat[k]) > 0.0 && turn(flat[i], flat[k], flat[l]) > 0.0
    };
    let length = |i: usize, k: usize| points[polygon[i] as usize].distance_squared(points[polygon[k] as usize]);
    match (inside(0, 1, 2, 3), inside(1, 2, 3, 0)) {
        (true, true) => Some(usize::from(length(1, 3) < length(0, 2))),
        (true, false) => Some(0),
        (false, true) => Some(1),
        (false, false) => None,
    }
}

/// The ring of corners that are not cut off yet.
struct EarCutter<'a> {
    flat: Vec<DVec2>,
    polygon: &'a [u32],
    next: Vec<usize>,
    previous: Vec<usize>,
    /// Corners that do not turn strictly left. Only these corners can lie in an ear. Some of them
    /// may already be cut off.
    blunt: Vec<usize>,
    alive: Vec<bool>,
    /// Ears as tuples of squared cut length, corner, and generation of the corner. The bits of the
    /// length are stored, because their integer order is the order of the lengths. Entries of an
    /// older generation are skipped.
    ears: BinaryHeap<Reverse<(u64, usize, u32)>>,
    generation: Vec<u32>,
}

impl<'a> EarCutter<'a> {
    fn new(flat: Vec<DVec2>, polygon: &'a [u32]) -> Self {
        let n = flat.len();
        let next = (0..n).map(|i| (i + 1) % n).collect();
        let previous = (0..n).map(|i| (i + n - 1) % n).collect();
        let (alive, generation) = (vec![true; n], vec![0; n]);
        let mut cutter =
            Self { flat, polygon, next, previous, blunt: Vec::new(), alive, ears: BinaryHeap::new(), generation };
        cutter.blunt = (0..n).filter(|&i| cutter.turn_at(i) <= 0.0).collect();
        for i in 0..n {
            cutter.offer(i);
        }
        cutter
    }

    fn cut(mut self, triangles: &mut Vec<[u32; 3]>) -> Cut {
        let mut answer = Cut::Whole;
        let mut current = 0;
        for _ in 3..self.flat.len() {
            let ear = self.best_ear().unwrap_or_else(|| {
                answer = Cut::SelfCrossing;
                self.sharpest(current)
            });
            let (before, after) = (self.previous[ear], self.next[ear]);
            triangles.push([self.polygon[before], self.polygon[ear], self.polygon[after]]);
            self.alive[ear] = false;
            (self.next[before], self.previous[after]) = (after, before);
            self.offer(before);
            self.offer(after);
            current = before;
        }
        let (before, after) = (self.previous[current], self.next[current]);
        if self.turn_at(current) <= 0.0 {
            answer = Cut::SelfCrossing;
        }
        triangles.push([self.polygon[before], self.polygon[current], self.polygon[after]]);
        answer
    }

    fn turn_at(&self, i: usize) -> f64 {
        turn(self.flat[self.previous[i]], self.flat[i], self.flat[self.next[i]])
    }

    /// Adds corner `i` to the ears if it is an ear now, and invalidates its earlier entries.
    fn offer(&mut self, i: usize) {
        self.generation[i] += 1;
        if self.is_ear(i) {
            let length = self.flat[self.previous[i]].distance_squared(self.flat[self.next[i]]);
            self.ears.push(Reverse((length.to_bits(), i, self.generation[i])));
        }
    }

    fn is_ear(&self, i: usize) -> bool {
        let corners = [self.previous[i], i, self.next[i]];
        let [a, b, c] = corners.map(|j| self.flat[j]);
        // In keyhole polygons, another corner can be at the same vertex as a corner of the
        // ear. That corner touches the ear only at this vertex.
        let apart = |j: usize| corners.iter().all(|&corner| self.polygon[corner] != self.polygon[j]);
        let covered = |p: DVec2| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
        turn(a, b, c) > 0.0 && !self.blunt.iter().any(|&j| self.alive[j] && apart(j) && covered(self.flat[j]))
    }

    /// Returns the ear with the shortest cut; `None` if there is no ear. The two corners next to a
    /// cut are tested again after each cut. A cut can also turn a distant corner into an ear. When
    /// the list of ears is empty, all corners are tested again. This test finds the new ears.
    fn best_ear(&mut self) -> Option<usize> {
        if let Some(ear) = self.pop_ear() {
            return Some(ear);
        }
        for i in 0..self.flat.len() {
            if self.alive[i] {
                self.offer(i);
            }
        }
        self.pop_ear()
    }

    fn pop_ear(&mut self) -> Option<usize> {
        while let Some(Reverse((_, ear, generation))) = self.ears.pop() {
            if self.alive[ear] && self.generation[ear] == generation {
                return Some(ear);
            }
        }
        None
    }

    /// Returns the remaining corner with the largest left turn relative to its sides.
    fn sharpest(&self, start: usize) -> usize {
        let sharpness = |i: usize| {
            let (a, b, c) = (self.flat[self.previous[i]], self.flat[i], self.flat[self.next[i]]);
            (b - a).normalize_or_zero().perp_dot((c - b).normalize_or_zero())
        };
        let (mut best, mut i) = (start, self.next[start]);
        while i != start {
            if sharpness(i) > sharpness(best) {
                best = i;
            }
            i = self.next[i];
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;

    fn area(points: &[DVec3], triangles: &[[u32; 3]]) -> DVec3 {
        let p = |i: u32| points[i as usize];
        triangles.iter().map(|&[a, b, c]| (p(b) - p(a)).cross(p(c) - p(a)) / 2.0).sum()
    }

    fn flat_polygon(corners: &[(f64, f64)]) -> (Vec<DVec3>, Vec<u32>) {
        (corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect(), (0..corners.len() as u32).collect())
    }

    #[test]
    fn a_concave_polygon_is_covered_once() {
        let (points, polygon) = flat_polygon(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (3.0, 4.0),
            (3.0, 1.0),
            (1.0, 1.0),
            (1.0, 4.0),
            (0.0, 4.0),
        ]);
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&points, &polygon, &mut triangles), Cut::Whole);
        assert_eq!(triangles.len(), 6);
        assert!((area(&points, &triangles).z - 10.0).abs() < 1e-15);
        assert!(triangles.iter().all(|t| area(&points, &[*t]).z > 0.0));
        let reversed: Vec<u32> = polygon.iter().rev().copied().collect();
        triangles.clear();
        assert_eq!(triangulate(&points, &reversed, &mut triangles), Cut::Whole);
        assert!(triangles.iter().all(|t| area(&points, &[*t]).z < 0.0));
    }

    #[test]
    fn straight_corners_give_no_empty_triangles() {
        let (points, polygon) = flat_polygon(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)]);
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&points, &polygon, &mut triangles), Cut::Whole);
        assert!(triangles.iter().all(|t| area(&points, &[*t]).z > 0.1));
        assert!((area(&points, &triangles).z - 6.0).abs() < 1e-15);
    }

    #[test]
    fn a_keyhole_polygon_is_covered_once() {
        // A square with a square hole. The edge 0–4 connects the outer and the inner boundary.
        let (points, _) = flat_polygon(&[
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
        ]);
        let polygon = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4];
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&points, &polygon, &mut triangles), Cut::Whole);
        assert_eq!(triangles.len(), 8);
        assert!((area(&points, &triangles).z - 12.0).abs() < 1e-15);
        assert!(triangles.iter().all(|t| area(&points, &[*t]).z > 0.0));
    }

    #[test]
    fn bow_tie_is_self_crossing_line_is_degenerate() {
        let (points, polygon) = flat_polygon(&[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 1.0)]);
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&points, &polygon, &mut triangles), Cut::SelfCrossing);
        assert_eq!(triangles.len(), 2);
        let (points, polygon) = flat_polygon(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.5, 0.0)]);
        assert_eq!(triangulate(&points, &polygon, &mut triangles), Cut::Degenerate);
    }

    #[test]
    fn bent_quad_is_cut_along_shorter_diagonal() {
        let points = [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.3), DVec3::new(3.0, 3.0, 0.0), DVec3::new(0.0, 1.0, 0.3)];
        let mut triangles = Vec::new();
        assert_eq!(triangulate(&points, &[0, 1, 2, 3], &mut triangles), Cut::Whole);
        assert_eq!(triangles, [[1, 2, 3], [1, 3, 0]]);
    }

    #[test]
    fn random_star_polygons_are_covered_once() {
        const SEED: u64 = 0x1d5f_33a1;
        let mut random = Random::new(SEED);
        for n in 5..60_u32 {
            let points: Vec<DVec3> = (0..n)
                .map(|i| {
                    let angle = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
                    let radius = 0.2 + random.unit();
                    DVec3::new(0.1 * random.unit(), radius * angle.cos(), radius * angle.sin())
                })
                .collect();
            let polygon: Vec<u32> = (0..n).collect();
            let mut triangles = Vec::new();
            assert_eq!(triangulate(&points, &polygon, &mut triangles), Cut::Whole, "seed {SEED}, {n} corners");
            assert_eq!(triangles.len(), n as usize - 2);
            let whole: f64 = (0..n as usize).map(|i| points[i].cross(points[(i + 1) % n as usize]).x / 2.0).sum();
            assert!((area(&points, &triangles).x - whole).abs() < 1e-12);
            assert!(triangles.iter().all(|t| area(&points, &[*t]).x > 0.0));
        }
    }
}
