//! Facets of the CSO, and the features of both bodies that span them \[K02 §3.3.3, step 4\].
//!
//! The facet of the CSO along n is the planar sum of the features of b and −a that lie in the
//! supporting plane. The sum of a vertex and a face is a copy of the face. The sum of two crossing
//! edges is a parallelogram. The sum of flush features (a box on a table) is a larger polygon.
//!
//! The facet also shows the direction of descent. Project the origin onto the facet's plane. If the
//! projection lies beyond a side, h decreases in that side's direction, and the facet across that
//! side is lower. If the projection lies within the facet, the facet is a local minimum of h.
//!
//! 1. Find the features of bodies a and b that are flush with the supporting plane.
//! 2. Merge the sides of the two polygons by direction. In this order, the sides run around the
//!    sum of the polygons. Report how far the origin lies beyond each side.

use glam::DVec3;

use super::cso::Cso;
use super::{Antipodal, HubPair};
use crate::body::{Feature, Loop, Polytope};

/// A facet of the CSO, given by a pair of features that spans it. On the overlay of both Gauss
/// maps, the facet is a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Unit vector from body b into body a.
    pub(super) normal: DVec3,
    /// h along the normal, up to rounding.
    pub(super) offset: f64,
    pub(super) antipodal: Antipodal,
    /// A hub pair of the facet.
    pub(super) hub: HubPair,
}

impl Antipodal {
    /// Returns the pair of features that spans the facet of the CSO with these three corners. If
    /// features are flush, returns one pair in the facet's plane. `None` if rounding prevents an
    /// answer.
    pub(super) fn spanned(a: &Polytope, b: &Polytope, hubs: [HubPair; 3]) -> Option<Self> {
        Self::among(hubs[0], spanned(a, hubs.map(|hub| hub.a))?, spanned(b, hubs.map(|hub| hub.b))?)
    }

    /// Returns a pair that spans a facet, from two flush features at a hub pair.
    fn among(hub: HubPair, feature_a: Feature, feature_b: Feature) -> Option<Self> {
        match (feature_a, feature_b) {
            (_, Feature::Face(b)) => Some(Self::VertexFace { a: hub.a, b }),
            (Feature::Face(a), _) => Some(Self::FaceVertex { a, b: hub.b }),
            (Feature::Edge(a), Feature::Edge(b)) => Some(Self::EdgeEdge { a, b }),
            _ => None,
        }
    }

    /// Returns a facet from which to walk downhill. Of the faces around the two vertices of a hub
    /// pair, takes the face along whose normal the pair has the least offset.
    pub(super) fn beside(cso: &Cso<'_>, hub: HubPair) -> Self {
        let point_b = cso.b.vertex(hub.b);
        let point_a = cso.point_a(hub.a);
        let of_b = cso.b.ring(hub.b).iter().map(|spoke| {
            let offset = -cso.b.plane(spoke.left).height(point_a);
            (offset, Self::VertexFace { a: hub.a, b: spoke.left })
        });
        let of_a = cso.a.ring(hub.a).iter().map(|spoke| {
            let offset = -cso.a.plane(spoke.left).height(cso.pose_ba.inverse_point(point_b));
            (offset, Self::FaceVertex { a: spoke.left, b: hub.b })
        });
        let first = (f64::INFINITY, Self::VertexFace { a: hub.a, b: 0 });
        of_b.chain(of_a).fold(first, |least, next| if next.0 < least.0 { next } else { least }).1
    }
}

/// Returns the feature with these vertices. Some of the vertices may be equal.
fn spanned(polytope: &Polytope, [u, v, w]: [u32; 3]) -> Option<Feature> {
    let (v, w) = if v == u { (w, v) } else { (v, w) };
    if v == u {
        return Some(Feature::Vertex(u));
    }
    let mut ring = polytope.ring(u).iter();
    if w == u || w == v {
        return ring.find(|spoke| spoke.neighbour == v).map(|spoke| Feature::Edge(spoke.edge));
    }
    let holds = |face: Loop<'_>| face.contains(v) && face.contains(w);
    ring.find(|spoke| holds(polytope.face_vertices(spoke.left))).map(|spoke| Feature::Face(spoke.left))
}

/// The vertices of a feature that lies in a supporting plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flush<'p> {
    face: Option<Loop<'p>>,
    own: [u32; 2],
    pub(super) count: usize,
}

impl<'p> Flush<'p> {
    fn new(polytope: &'p Polytope, feature: Feature) -> Self {
        match feature {
            Feature::Vertex(v) => Self { face: None, own: [v, v], count: 1 },
            Feature::Edge(e) => {
                let edge = polytope.edge(e);
                Self { face: None, own: [edge.tail, edge.head], count: 2 }
            }
            Feature::Face(f) => {
                let face = polytope.face_vertices(f);
                Self { face: Some(face), own: [0; 2], count: face.len() }
            }
        }
    }

    /// Returns corner `k`, counter-clockwise as seen from outside the polytope. `k` wraps around.
    #[inline]
    pub(super) fn corner(&self, k: usize) -> u32 {
        let k = k % self.count;
        self.face.map_or_else(|| self.own[k], |face| face.at(k))
    }

    /// Returns the index of the corner that lies farthest along `direction` (in the polytope's
    /// frame).
    fn highest(&self, polytope: &Polytope, direction: DVec3) -> usize {
        let height = |k: usize| direction.dot(polytope.vertex(self.corner(k)));
        (0..self.count).max_by(|&i, &j| height(i).total_cmp(&height(j))).unwrap_or(0)
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
    /// Returns the facet at a corner of an overlap. The facet contains the features that lie in its
    /// plane within the angle `within` (radians).
    pub(super) fn at(cso: &Cso<'p>, corner: &Corner, within: f64) -> Self {
        let toward_b = cso.toward_b(corner.normal);
        let (feature_a, feature_b) = match corner.antipodal {
            Antipodal::VertexFace { a, b } => (flush_at_vertex(cso.a, a, toward_b, within), Feature::Face(b)),
            Antipodal::FaceVertex { a, b } => (Feature::Face(a), flush_at_vertex(cso.b, b, corner.normal, within)),
            Antipodal::EdgeEdge { a, b } => {
                (flush_at_edge(cso.a, a, toward_b, within), flush_at_edge(cso.b, b, corner.normal, within))
            }
        };
        Self { normal: corner.normal, a: Flush::new(cso.a, feature_a), b: Flush::new(cso.b, feature_b) }
    }

    /// Returns the facet in the plane that a hub pair supports along `normal`, with the
    /// features that lie in the plane within the angle `within` (radians). Also returns a pair of
    /// features that spans the facet. The pair is `None` if no facet has this normal.
    pub(super) fn supported(cso: &Cso<'p>, hub: HubPair, normal: DVec3, within: f64) -> (Self, Option<Antipodal>) {
        let feature_a = flush_at_vertex(cso.a, hub.a, cso.toward_b(normal), within);
        let feature_b = flush_at_vertex(cso.b, hub.b, normal, within);
        let facet = Self { normal, a: Flush::new(cso.a, feature_a), b: Flush::new(cso.b, feature_b) };
        (facet, Antipodal::among(hub, feature_a, feature_b))
    }

    /// Returns the facet at a corner. The caller must know that only the corner's antipodal
    /// features lie in the facet's plane.
    pub(super) fn spanned(cso: &Cso<'p>, corner: &Corner) -> Self {
        let features = corner.antipodal.features();
        Self { normal: corner.normal, a: Flush::new(cso.a, features.a), b: Flush::new(cso.b, features.b) }
    }

    /// Returns the square of the distance by which the origin's projection lies beyond the farthest
    /// side. The result is negative if the projection lies within the facet.
    pub(super) fn beyond(&self, cso: &Cso<'_>) -> f64 {
        let mut farthest = f64::NEG_INFINITY;
        self.for_each_side(cso, |beyond| farthest = farthest.max(beyond));
        farthest
    }

    /// Calls `visit` for each side of the facet, with the square of the distance by which the
    /// origin's projection lies beyond the side. The value is negative if the projection lies on
    /// the inner side.
    fn for_each_side(&self, cso: &Cso<'_>, mut visit: impl FnMut(f64)) {
        // The sides run counter-clockwise about the normal. The loop of b already has this
        // direction. The loop of body a is read backwards: a's outward normal is opposite, so the
        // loop runs clockwise about the normal.
        let (mut start_a, mut start_b) = (0, 0);
        if self.a.count > 1 && self.b.count > 1 {
            let along = self.normal.any_orthonormal_vector();
            start_a = self.a.highest(cso.a, cso.pose_ba.inverse_vector(along));
            start_b = self.b.highest(cso.b, -along);
        }
        let mut a = CornerWalk::new(&self.a, start_a, -1, |v| cso.point_a(v));
        let mut b = CornerWalk::new(&self.b, start_b, 1, |v| cso.b.vertex(v));
        while a.left > 0 || b.left > 0 {
            let c = b.point - a.point;
            let turn_by_a = b.left == 0 || a.left > 0 && self.normal.dot(a.edge().cross(b.edge())) < 0.0;
            let edge = if turn_by_a { -a.advance() } else { b.advance() };
            let outward = edge.cross(self.normal);
            let height = outward.dot(c);
            visit(-height * height.abs() / outward.length_squared().max(f64::MIN_POSITIVE));
        }
    }
}

/// A walk once around the corners of a flush feature.
struct CornerWalk<'l, 'p, P> {
    flush: &'l Flush<'p>,
    place: P,
    /// Index of the next corner, and the increment to the corner after it (forwards or backwards).
    index: usize,
    step: usize,
    left: usize,
    point: DVec3,
    next: DVec3,
}

impl<'l, 'p, P: Fn(u32) -> DVec3> CornerWalk<'l, 'p, P> {
    fn new(flush: &'l Flush<'p>, start: usize, direction: isize, place: P) -> Self {
        let step = if direction < 0 { flush.count - 1 } else { 1 };
        let index = start + step;
        let (point, next) = (place(flush.corner(start)), place(flush.corner(index)));
        let left = if flush.count == 1 { 0 } else { flush.count };
        Self { flush, place, index, step, left, point, next }
    }

    fn edge(&self) -> DVec3 {
        self.next - self.point
    }

    /// Moves to the next corner and returns the vector to it.
    fn advance(&mut self) -> DVec3 {
        let edge = self.edge();
        self.index = (self.index + self.step) % self.flush.count;
        self.point = self.next;
        self.next = (self.place)(self.flush.corner(self.index));
        self.left -= 1;
        edge
    }
}

/// Returns the largest feature at vertex `v` that lies in the supporting plane at `v` within the
/// angle `within` (radians). `direction` is the plane's normal (unit, in the polytope's frame).
pub(super) fn flush_at_vertex(polytope: &Polytope, v: u32, direction: DVec3, within: f64) -> Feature {
    let at = polytope.vertex(v);
    let mut feature = Feature::Vertex(v);
    for spoke in polytope.ring(v) {
        if is_flush(polytope, spoke.left, direction, within) {
            return Feature::Face(spoke.left);
        }
        let edge = polytope.vertex(spoke.neighbour) - at;
        let rise = direction.dot(edge);
        if rise * rise <= within * within * edge.length_squared() {
            feature = Feature::Edge(spoke.edge);
        }
    }
    feature
}

/// Returns the face beside edge `e` that lies in the supporting plane within the angle `within`
/// (radians). If neither face lies in this plane, returns the edge. `direction` is the plane's
/// normal (unit, in the polytope's frame).
fn flush_at_edge(polytope: &Polytope, e: u32, direction: DVec3, within: f64) -> Feature {
    let edge = polytope.edge(e);
    [edge.left, edge.right]
        .into_iter()
        .find(|&face| is_flush(polytope, face, direction, within))
        .map_or(Feature::Edge(e), Feature::Face)
}

#[inline]
fn is_flush(polytope: &Polytope, face: u32, direction: DVec3, within: f64) -> bool {
    polytope.plane(face).normal.distance_squared(direction) <= within * within
}
