//! The normal cone of a vertex as a spherical polygon: the local Gauss map of \[K02 §3.3.1\].
//!
//! The normals of the faces around the vertex are the corners of the polygon, and the edges at the
//! vertex are the arcs of the polygon. A vertex supports a unit vector n if and only if no edge
//! rises from the vertex along n: `n · edge ≤ 0` for every edge. Deviation from \[K02\]: the paper
//! projects the map centrally onto the plane z = 1. Without this projection, cones wider than a
//! hemisphere and needle tips need no special case.
//!
//! Body a is reflected (−a in b's frame). Both cones then contain outward directions, and the
//! overlay needs one method for both. The maps are copied from the polytopes into flat pages, once
//! per query and vertex. A vertex with more edges than a page can contain has several pages.

use glam::DVec3;

use super::cso::Cso;
use crate::algebra::tolerance::CONE_SLACK;
use crate::body::{Polytope, Ring};

/// Number of arcs in one page. Vertices of meshes have about 6 edges. A vertex with more than this
/// number needs several pages.
pub(super) const PAGE: usize = 32;

/// Number of pages that are kept per body. The vertices of an edge need 2 pages, and the
/// vertices of a triangle need 3.
const PAGES: usize = 4;

/// One arc of a local Gauss map, in b's frame. An arc of body a belongs to the reflected body −a.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    /// Vector from the vertex to the neighbour; not a unit vector.
    pub(super) edge: DVec3,
    /// Outward normal of the face on the left of the edge. For body a, left refers to the body
    /// before the reflection.
    pub(super) left: DVec3,
    /// Outward normal of the face on the right.
    pub(super) right: DVec3,
    /// Index of the edge.
    pub(super) edge_index: u32,
    /// Index of the left face.
    pub(super) left_index: u32,
}

const NO_ARC: Arc = Arc { edge: DVec3::ZERO, left: DVec3::ZERO, right: DVec3::ZERO, edge_index: 0, left_index: 0 };

/// A page of the local Gauss map of one vertex.
#[derive(Clone, Debug)]
pub(super) struct GaussMap {
    /// Number of the query that filled this page.
    query: u32,
    vertex: u32,
    page: u32,
    count: usize,
    arcs: [Arc; PAGE],
}

impl GaussMap {
    /// The arcs, in ring order.
    #[inline]
    pub(super) fn arcs(&self) -> &[Arc] {
        &self.arcs[..self.count]
    }

    /// Copies the arcs of `spokes` into this page. `before` is the face to the right of the first
    /// spoke.
    fn fill(&mut self, polytope: &Polytope, before: u32, spokes: Ring<'_>, place: impl Fn(DVec3) -> DVec3) {
        let at = polytope.vertex(self.vertex);
        let mut right = place(polytope.plane(before).normal);
        self.count = spokes.len();
        for (arc, spoke) in self.arcs.iter_mut().zip(spokes) {
            let left = place(polytope.plane(spoke.left).normal);
            let edge = place(polytope.vertex(spoke.neighbour) - at);
            *arc = Arc { edge, left, right, edge_index: spoke.edge, left_index: spoke.left };
            right = left;
        }
    }
}

/// The pages of one body that were filled in the current query.
#[derive(Clone, Debug)]
pub(super) struct GaussMaps {
    maps: [GaussMap; PAGES],
    next: usize,
    query: u32,
}

impl GaussMaps {
    pub(super) fn new() -> Self {
        let empty = GaussMap { query: 0, vertex: 0, page: 0, count: 0, arcs: [NO_ARC; PAGE] };
        Self { maps: std::array::from_fn(|_| empty.clone()), next: 0, query: 1 }
    }

    /// Clears all pages. Call this when the pose or the polytope has changed.
    #[inline]
    pub(super) fn clear(&mut self) {
        self.query = self.query.wrapping_add(1);
        if self.query == 0 {
            *self = Self::new();
        }
    }

    /// Returns page `page` of vertex `v` of b.
    pub(super) fn of_b(&mut self, cso: &Cso<'_>, v: u32, page: usize) -> &GaussMap {
        self.read(cso.b, v, page, |p| p)
    }

    /// Returns page `page` of vertex `v` of the reflected a.
    pub(super) fn of_reflected_a(&mut self, cso: &Cso<'_>, v: u32, page: usize) -> &GaussMap {
        self.read(cso.a, v, page, |p| -cso.pose_ba.vector(p))
    }

    #[inline]
    fn read(&mut self, polytope: &Polytope, v: u32, page: usize, place: impl Fn(DVec3) -> DVec3) -> &GaussMap {
        if let Some(k) =
            self.maps.iter().position(|map| map.query == self.query && map.vertex == v && map.page == page as u32)
        {
            return &self.maps[k];
        }
        let k = self.next;
        self.next = (k + 1) % PAGES;
        let ring = polytope.ring(v);
        let spokes = ring.part(page * PAGE..ring.len().min((page + 1) * PAGE));
        let before = ring.at(if page == 0 { ring.len() } else { page * PAGE } - 1).left;
        let map = &mut self.maps[k];
        (map.query, map.vertex) = (self.query, v);
        map.page = page as u32;
        map.fill(polytope, before, spokes, place);
        map
    }
}

/// Returns the number of pages that vertex `v` needs.
#[inline]
pub(super) fn pages(polytope: &Polytope, v: u32) -> usize {
    polytope.ring(v).len().div_ceil(PAGE)
}

/// Returns true if vertex `v` supports `direction` (unit, in the polytope's frame) within
/// [`CONE_SLACK`].
#[inline]
pub(super) fn cone_holds(polytope: &Polytope, v: u32, direction: DVec3) -> bool {
    let at = polytope.vertex(v);
    polytope.ring(v).iter().all(|spoke| {
        let edge = polytope.vertex(spoke.neighbour) - at;
        let rise = direction.dot(edge);
        rise <= 0.0 || rise * rise <= CONE_SLACK * CONE_SLACK * edge.length_squared()
    })
}
