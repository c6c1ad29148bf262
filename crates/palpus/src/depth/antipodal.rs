//! From a corner of the overlay to a facet of the CSO, and on to its hubs \[K02 §3.3.3, step 4\].
//!
//! The facet of the CSO along n is the planar sum of the features of b and −a that lie in the supporting plane: a
//! vertex and a face give a copy of the face, two crossing edges a parallelogram, and flush features (a box on a table)
//! whatever polygon their sum is. Its corners are hub pairs, those that the walk may move to.
//!
//! The facet also shows where to go: if the origin, projected onto its plane, lies beyond one of its sides, then h falls
//! in that side's direction, and the two hubs at the ends of the side know a lower facet. If it lies within, the
//! facet is a local minimum of h.
//!
//! 1. Find the features of a and b that are flush with the supporting plane.
//! 2. Run around the sum of the two polygons, merging their sides by direction, and report each side.

use glam::DVec3;

use super::cso::Cso;
use super::overlay::Corner;
use super::{Antipodal, HubPair};
use crate::algebra::tolerance::FLUSH;
use crate::body::{Feature, Polytope};

/// The vertices of a feature that lies in a supporting plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flush<'p> {
    face: &'p [u32],
    own: [u32; 2],
    pub(super) count: usize,
}

impl<'p> Flush<'p> {
    fn new(polytope: &'p Polytope, feature: Feature) -> Self {
        match feature {
            Feature::Vertex(v) => Self { face: &[], own: [v, v], count: 1 },
            Feature::Edge(e) => {
                let edge = polytope.edge(e);
                Self { face: &[], own: [edge.tail, edge.head], count: 2 }
            }
            Feature::Face(f) => {
                let face = polytope.face_vertices(f);
                Self { face, own: [0; 2], count: face.len() }
            }
        }
    }

    /// Corner `k`, counter-clockwise seen from outside its polytope; `k` wraps around.
    #[inline]
    pub(super) fn corner(&self, k: usize) -> u32 {
        let k = k % self.count;
        if self.face.is_empty() { self.own[k] } else { self.face[k] }
    }
}

/// The features of both bodies in the supporting plane of a facet of the CSO.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet<'p> {
    pub(super) normal: DVec3,
    pub(super) a: Flush<'p>,
    pub(super) b: Flush<'p>,
}

impl<'p> Facet<'p> {
    /// The facet at a corner of an overlap.
    pub(super) fn at(cso: &Cso<'p>, corner: &Corner) -> Self {
        let toward_b = cso.toward_b(corner.normal);
        let (feature_a, feature_b) = match corner.antipodal {
            Antipodal::VertexFace { a, b } => (flush_at_vertex(cso.a, a, toward_b), Feature::Face(b)),
            Antipodal::FaceVertex { a, b } => (Feature::Face(a), flush_at_vertex(cso.b, b, corner.normal)),
            Antipodal::EdgeEdge { a, b } => (flush_at_edge(cso.a, a, toward_b), flush_at_edge(cso.b, b, corner.normal)),
        };
        Self { normal: corner.normal, a: Flush::new(cso.a, feature_a), b: Flush::new(cso.b, feature_b) }
    }

    /// An upper bound of the number of its corners.
    pub(super) fn corner_bound(&self) -> usize {
        match (self.a.count, self.b.count) {
            (1, k) | (k, 1) => k,
            (i, j) => i + j,
        }
    }

    /// Calls `side(from, to, beyond)` for each side of the facet in turn: the hub pairs at its ends, and how far the
    /// origin's projection lies beyond it (negative: within).
    pub(super) fn for_each_side(&self, cso: &Cso<'_>, mut side: impl FnMut(HubPair, HubPair, f64)) {
        let point_a = |k: usize| cso.point_a(self.a.corner(k));
        let point_b = |k: usize| cso.b.vertex(self.b.corner(k));
        let sides = |flush: &Flush<'_>| if flush.count == 1 { 0 } else { flush.count };
        let (sides_a, sides_b) = (sides(&self.a), sides(&self.b));
        let along = self.normal.any_orthonormal_vector();
        // Counter-clockwise about the normal: b's loop as it is; so is a's, which runs clockwise about the normal since
        // its outward normal is the opposite one, once it is reflected and read backwards.
        let back = |k: usize| 2 * self.a.count - k % self.a.count;
        let start_a = (0..self.a.count).max_by(|&i, &j| height(along, point_a(i), point_a(j))).unwrap_or(0);
        let start_b = (0..self.b.count).min_by(|&i, &j| height(along, point_b(i), point_b(j))).unwrap_or(0);
        let index_a = |i: usize| start_a + back(i);
        let edge_a = |i: usize| point_a(index_a(i)) - point_a(index_a(i + 1));
        let edge_b = |j: usize| point_b(start_b + j + 1) - point_b(start_b + j);
        let hub = |i: usize, j: usize| HubPair { a: self.a.corner(index_a(i)), b: self.b.corner(start_b + j) };
        let (mut i, mut j) = (0, 0);
        while i < sides_a || j < sides_b {
            let from = hub(i, j);
            let edge = if i == sides_a {
                j += 1;
                edge_b(j - 1)
            } else if j == sides_b || self.normal.dot(edge_a(i).cross(edge_b(j))) > 0.0 {
                i += 1;
                edge_a(i - 1)
            } else {
                j += 1;
                edge_b(j - 1)
            };
            let outward = edge.cross(self.normal).normalize_or_zero();
            side(from, hub(i, j), -outward.dot(cso.vertex(from)));
        }
    }
}

fn height(along: DVec3, p: DVec3, q: DVec3) -> std::cmp::Ordering {
    along.dot(p).total_cmp(&along.dot(q))
}

/// The largest feature around vertex `v` that is flush with the plane that `direction` (unit, local) supports there.
pub(super) fn flush_at_vertex(polytope: &Polytope, v: u32, direction: DVec3) -> Feature {
    let at = polytope.vertex(v);
    let mut feature = Feature::Vertex(v);
    for spoke in polytope.ring(v) {
        if is_flush(polytope, spoke.left, direction) {
            return Feature::Face(spoke.left);
        }
        let edge = polytope.vertex(spoke.neighbour) - at;
        let rise = direction.dot(edge);
        if rise * rise <= FLUSH * FLUSH * edge.length_squared() {
            feature = Feature::Edge(spoke.edge);
        }
    }
    feature
}

/// The face beside edge `e` that is flush with the plane that `direction` (unit, local) supports, or the edge.
fn flush_at_edge(polytope: &Polytope, e: u32, direction: DVec3) -> Feature {
    let edge = polytope.edge(e);
    [edge.left, edge.right]
        .into_iter()
        .find(|&face| is_flush(polytope, face, direction))
        .map_or(Feature::Edge(e), Feature::Face)
}

#[inline]
fn is_flush(polytope: &Polytope, face: u32, direction: DVec3) -> bool {
    polytope.plane(face).normal.distance_squared(direction) <= FLUSH * FLUSH
}
