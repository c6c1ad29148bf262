//! Overlaps of two normal cones on the sphere \[K02 §3.3.3, steps 1–4\].
//!
//! The normal cone of a vertex of b and the normal cone of a vertex of the reflected a overlap. The
//! corners of the overlap are the facets of the CSO around its vertex `c = b − a`. Over the
//! overlap, h(n) = n·c. This function is concave along every arc on which it is not negative. So
//! its least value lies at a corner. If both ends of an arc are higher than the best known offset,
//! no point of the arc is lower.
//!
//! 1. Compute n·c for all face normals of both rings. If n·c is below the limit `bar`, test whether
//!    the other cone contains the normal (VF, FV). If the other cone contains it, compute the
//!    offset from the face's plane. Merged faces are flat only within a tolerance, so each
//!    corner of a face would give another offset.
//! 2. Keep the arcs with an end below `bar`.
//! 3. Cross the kept arcs of body a with the kept arcs of b (EE). Two arcs cross if the ends of
//!    each arc lie on both sides of the other arc's great circle, in matching order. Four signs of
//!    dot products decide whether the arcs cross. Offsets are compared without square roots.
//!
//! If two cones only touch (aligned boxes), they meet in face normals, and step 1 accepts these
//! normals within a tolerance. So step 3 needs no tolerance, and skips nearly parallel edges.

use glam::DVec3;

use super::antipodal::Corner;
use super::cso::{Cso, below};
use super::gauss_map::{Arc, GaussMaps, PAGE, cone_holds, pages};
use super::{Antipodal, HubPair};
use crate::algebra::tolerance::PARALLEL_EDGES;

/// The arcs of one page with an end below `bar`.
struct Kept {
    count: usize,
    arcs: [u8; PAGE],
}

/// Returns the corner with the smallest offset in the overlap at `hub`. `None` if no corner is
/// below `bar`.
pub(super) fn lowest_corner(
    cso: &Cso<'_>,
    maps_a: &mut GaussMaps,
    maps_b: &mut GaussMaps,
    hub: HubPair,
    bar: f64,
) -> Option<Corner> {
    let c = cso.vertex(hub);
    let mut search = Search { cso, c, hub, bar, best: None };
    for page in 0..pages(cso.b, hub.b) {
        search.faces_of_b(maps_b.of_b(cso, hub.b, page).arcs());
    }
    for page in 0..pages(cso.a, hub.a) {
        search.faces_of_a(maps_a.of_reflected_a(cso, hub.a, page).arcs());
    }
    for page_a in 0..pages(cso.a, hub.a) {
        let arcs_a = maps_a.of_reflected_a(cso, hub.a, page_a).arcs();
        let kept_a = search.keep(arcs_a);
        if kept_a.count == 0 {
            continue;
        }
        for page_b in 0..pages(cso.b, hub.b) {
            let arcs_b = maps_b.of_b(cso, hub.b, page_b).arcs();
            let kept_b = search.keep(arcs_b);
            search.crossings(arcs_a, &kept_a, arcs_b, &kept_b);
        }
    }
    search.best
}

struct Search<'s> {
    cso: &'s Cso<'s>,
    c: DVec3,
    hub: HubPair,
    bar: f64,
    best: Option<Corner>,
}

impl Search<'_> {
    #[inline]
    fn take(&mut self, normal: DVec3, offset: f64, antipodal: Antipodal) {
        self.bar = offset;
        self.best = Some(Corner { normal, offset, antipodal, hub: self.hub });
    }

    fn faces_of_b(&mut self, arcs: &[Arc]) {
        for arc in arcs {
            if arc.left.dot(self.c) >= self.bar {
                continue;
            }
            let offset = self.cso.offset_at_face_of_b(arc.left_index, self.hub.a);
            if offset < self.bar && cone_holds(self.cso.a, self.hub.a, self.cso.toward_b(arc.left)) {
                self.take(arc.left, offset, Antipodal::VertexFace { a: self.hub.a, b: arc.left_index });
            }
        }
    }

    fn faces_of_a(&mut self, arcs: &[Arc]) {
        for arc in arcs {
            if arc.left.dot(self.c) >= self.bar {
                continue;
            }
            let offset = self.cso.offset_at_face_of_a(arc.left_index, self.hub.b, arc.left);
            if offset < self.bar && cone_holds(self.cso.b, self.hub.b, arc.left) {
                self.take(arc.left, offset, Antipodal::FaceVertex { a: arc.left_index, b: self.hub.b });
            }
        }
    }

    #[inline]
    fn keep(&self, arcs: &[Arc]) -> Kept {
        let mut kept = Kept { count: 0, arcs: [0; PAGE] };
        let mut right = arcs.first().map_or(0.0, |arc| arc.right.dot(self.c));
        for (k, arc) in arcs.iter().enumerate() {
            let left = arc.left.dot(self.c);
            if left.min(right) < self.bar {
                kept.arcs[kept.count] = k as u8;
                kept.count += 1;
            }
            right = left;
        }
        kept
    }

    #[inline]
    fn crossings(&mut self, arcs_a: &[Arc], kept_a: &Kept, arcs_b: &[Arc], kept_b: &Kept) {
        for &i in &kept_a.arcs[..kept_a.count] {
            let a = &arcs_a[usize::from(i)];
            for &j in &kept_b.arcs[..kept_b.count] {
                let b = &arcs_b[usize::from(j)];
                if let Some(across) = crossing([a.left, a.right], a.edge, [b.left, b.right], b.edge) {
                    self.edge_pair(a, b, across);
                }
            }
        }
    }

    fn edge_pair(&mut self, a: &Arc, b: &Arc, across: DVec3) {
        let (length_a, length_b, length) = (a.edge.length_squared(), b.edge.length_squared(), across.length_squared());
        if length <= PARALLEL_EDGES * PARALLEL_EDGES * length_a * length_b
            || !below(across.dot(self.c), length, self.bar)
        {
            return;
        }
        // The cross product of nearly parallel edges has a rounding error along the edges. After
        // removing that part, the plane supports both edges.
        let normal = (across - a.edge * (across.dot(a.edge) / length_a)).normalize_or_zero();
        let offset = normal.dot(self.c);
        // For nearly parallel edges, the signs depend on rounding, so the crossing may be false.
        if offset < self.bar
            && cone_holds(self.cso.a, self.hub.a, self.cso.toward_b(normal))
            && cone_holds(self.cso.b, self.hub.b, normal)
        {
            self.take(normal, offset, Antipodal::EdgeEdge { a: a.edge_index, b: b.edge_index });
        }
    }
}

/// Returns the direction in which the arcs of two edges cross; not a unit vector. `None` if the
/// arcs do not cross.
///
/// Two arcs cross if the ends of each arc lie on both sides of the other arc's great circle. The
/// ring of the reflected a runs clockwise, so both arcs need the same pattern of signs.
#[inline]
pub(super) fn crossing(
    [left_a, right_a]: [DVec3; 2],
    edge_a: DVec3,
    [left_b, right_b]: [DVec3; 2],
    edge_b: DVec3,
) -> Option<DVec3> {
    let (x, y) = (left_b.dot(edge_a), right_b.dot(edge_a));
    if x * y > 0.0 {
        return None;
    }
    let (z, w) = (left_a.dot(edge_b), right_a.dot(edge_b));
    let [up, down] = patterns([x, y, z, w], [0.0; 2]);
    (up || down).then(|| if up { edge_b.cross(edge_a) } else { edge_a.cross(edge_b) })
}

/// Returns true if the arcs of two edges cross, or may cross after a turn. `turn` is the largest
/// change of a unit vector.
pub(super) fn crosses_within(
    [left_a, right_a]: [DVec3; 2],
    edge_a: DVec3,
    [left_b, right_b]: [DVec3; 2],
    edge_b: DVec3,
    turn: f64,
) -> bool {
    let products = [left_b.dot(edge_a), right_b.dot(edge_a), left_a.dot(edge_b), right_a.dot(edge_b)];
    // The product of an edge with a unit vector changes by at most this times the edge's length.
    let [up, down] = patterns(products, [edge_a, edge_b].map(|edge| turn * edge.length()));
    up || down
}

/// Tests the two patterns of signs that crossing arcs can have. The products are those of the ends
/// of b's arc (left, right) with a's edge, and of the ends of a's arc with b's edge. A product
/// counts as both signs if it is at most as large as the slack of its edge.
#[inline]
fn patterns([x, y, z, w]: [f64; 4], [slack_a, slack_b]: [f64; 2]) -> [bool; 2] {
    let up = x >= -slack_a && y <= slack_a && z >= -slack_b && w <= slack_b;
    let down = x <= slack_a && y >= -slack_a && z <= slack_b && w >= -slack_b;
    [up, down]
}
