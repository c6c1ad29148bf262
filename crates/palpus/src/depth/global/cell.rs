//! A convex cell inside a solid, grown around a seed point.
//!
//! 1. Visit the triangles of the surface in the triangle tree, in ascending order of their distance
//!    from the seed.
//! 2. Skip each triangle, and each box of triangles, that lies beyond a plane found so far.
//! 3. Every other triangle adds a plane that excludes the triangle. If the cell then stays large
//!    and contains the wanted point, the plane is the triangle's own plane. Otherwise it is the
//!    plane through the triangle's point nearest to the seed, perpendicular to the line to the
//!    seed.
//! 4. The cell is the set of points below all planes. No point of the surface lies in its interior,
//!    and the seed lies in the solid. So the whole cell lies in the solid.
//!
//! The common polytope of the planes is computed as the hull of their dual points. Its corners are
//! scaled toward the seed until each corner lies below every plane. So rounding never puts a
//! part of a cell outside its solid.
//!
//! The method follows R. Deits and R. Tedrake, *Computing Large Convex Regions of Obstacle-Free
//! Space through Semidefinite Programming*, 2014. This implementation makes only one round of
//! planes, and uses a ball in place of the paper's ellipsoids.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::algebra::tolerance::{CELL_BEYOND, CELL_DUAL, CELL_OWN_PLANE, CELL_PLANES};
use crate::algebra::{Plane, closest_on_triangle};
use crate::body::{Aabb, TriangleTree, convex_hull};

/// A convex polytope inside a solid, in the body's frame.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// Corners of the cell.
    pub(super) corners: Vec<DVec3>,
    /// A point inside the cell.
    pub(super) center: DVec3,
    /// Radius of a ball around `center` that lies in the cell.
    pub(super) inner: f64,
    /// Radius of a ball around `center` that contains the cell.
    pub(super) outer: f64,
    /// Planes of the cell, with outward normals.
    planes: Vec<Plane>,
}

impl Cell {
    /// Returns true if `p` lies in the cell.
    pub(super) fn holds(&self, p: DVec3) -> bool {
        p.distance_squared(self.center) <= self.outer * self.outer && self.planes.iter().all(|q| q.height(p) <= 0.0)
    }

    /// Returns a cell that is a single triangle and has no inside.
    pub(super) fn flat(corners: [DVec3; 3]) -> Self {
        let center = corners.iter().sum::<DVec3>() / 3.0;
        let outer = corners.iter().map(|p| p.distance(center)).fold(0.0, f64::max);
        Self { corners: corners.to_vec(), center, inner: 0.0, outer, planes: Vec::new() }
    }

    /// Grows a cell around `seed`, a point inside a solid of diagonal `size`. The cell contains the
    /// point `keep` if possible.
    ///
    /// `None` if the surface is too near to the seed, or if the cell needs too many planes.
    pub(super) fn grow(tree: &TriangleTree, seed: DVec3, keep: DVec3, size: f64) -> Option<Self> {
        let planes = planes_about(tree, seed, keep, size)?;
        let inner = planes.iter().map(|plane| -plane.height(seed)).fold(f64::INFINITY, f64::min);
        if inner <= CELL_BEYOND * size || planes.len() < 4 {
            return None;
        }
        let dual: Vec<DVec3> = planes.iter().map(|plane| plane.normal * (inner / -plane.height(seed))).collect();
        let (hull, _) = convex_hull(&dual, CELL_DUAL).ok()?.into_polytope()?;
        let mut corners = Vec::with_capacity(hull.face_count());
        for face in hull.planes() {
            // The seed must lie below all planes, and the cell must be bounded.
            if face.offset <= 0.0 {
                return None;
            }
            corners.push(face.normal * (inner / face.offset));
        }
        let over = |corner: &DVec3| {
            planes.iter().map(|plane| plane.normal.dot(*corner) / -plane.height(seed)).fold(1.0, f64::max)
        };
        let shrink = 1.0 / corners.iter().map(over).fold(1.0, f64::max);
        let outer = corners.iter().map(|p| p.length()).fold(0.0, f64::max);
        if !outer.is_finite() || outer > size {
            return None;
        }
        for corner in &mut corners {
            *corner = seed + *corner * shrink;
        }
        Some(Self { corners, center: seed, inner: inner * shrink, outer, planes })
    }
}

/// A node or a triangle of the tree to visit, ordered by its distance from the seed.
struct Visit {
    squared: f64,
    what: What,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    Node(u32),
    Triangle(usize),
}

impl PartialEq for Visit {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Visit {}

impl PartialOrd for Visit {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Visit {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.squared.total_cmp(&other.squared).then(self.what.cmp(&other.what))
    }
}

/// Returns the planes of a cell. `None` if the cell needs too many planes.
fn planes_about(tree: &TriangleTree, seed: DVec3, keep: DVec3, size: f64) -> Option<Vec<Plane>> {
    let slack = CELL_BEYOND * size;
    let mut planes: Vec<Plane> = Vec::new();
    let mut visits = BinaryHeap::new();
    let nodes = &tree.nodes;
    visits.push(Reverse(Visit { squared: 0.0, what: What::Node(0) }));
    while let Some(Reverse(visit)) = visits.pop() {
        match visit.what {
            What::Node(index) => {
                let node = nodes.get(index as usize)?;
                if planes.iter().any(|plane| lies_beyond(&node.bounds, plane, slack)) {
                    continue;
                }
                if node.is_leaf() {
                    for slot in node.slots() {
                        let [a, b, c] = tree.corners[slot];
                        let squared = closest_on_triangle(seed, a, b, c).distance_squared(seed);
                        visits.push(Reverse(Visit { squared, what: What::Triangle(slot) }));
                    }
                } else {
                    for child in [index + 1, node.second] {
                        let squared = nodes[child as usize].bounds.distance_squared(seed);
                        visits.push(Reverse(Visit { squared, what: What::Node(child) }));
                    }
                }
            }
            What::Triangle(slot) => {
                let corners = tree.corners[slot];
                if planes.iter().any(|plane| corners.iter().all(|&p| plane.height(p) >= -slack)) {
                    continue;
                }
                if planes.len() == CELL_PLANES {
                    return None;
                }
                planes.push(plane_before(&corners, seed, keep)?);
            }
        }
    }
    Some(planes)
}

fn lies_beyond(bounds: &Aabb, plane: &Plane, slack: f64) -> bool {
    let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
    plane.height(middle) - plane.normal.abs().dot(half) >= -slack
}

/// Returns a plane with the triangle above it and `seed` below it. `None` if `seed` lies on the
/// triangle.
fn plane_before(corners: &[DVec3; 3], seed: DVec3, keep: DVec3) -> Option<Plane> {
    let [a, b, c] = *corners;
    let nearest = closest_on_triangle(seed, a, b, c);
    let distance = nearest.distance(seed);
    if distance == 0.0 {
        return None;
    }
    let normal = (b - a).cross(c - a).normalize_or_zero();
    // Rounding must not leave a corner of the triangle below this plane.
    let offset = corners.iter().map(|p| normal.dot(*p)).fold(f64::INFINITY, f64::min);
    let own = Plane { normal, offset };
    if own.height(seed) <= -CELL_OWN_PLANE * distance && own.height(keep) <= 0.0 {
        return Some(own);
    }
    let normal = (nearest - seed) / distance;
    let offset = corners.iter().map(|p| normal.dot(*p)).fold(f64::INFINITY, f64::min);
    Some(Plane { normal, offset })
}
