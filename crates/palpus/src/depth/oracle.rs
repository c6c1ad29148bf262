//! Exhaustive search for the depth, for tests. The oracle uses no walk and no Gauss map, and no
//! tolerance decides its result.
//!
//! The least h lies at a normal of a face or at a common perpendicular of two edges. The oracle
//! tries all these directions with their true support offsets, so even an invalid candidate cannot
//! make the result too small. Limitation: the oracle uses the same vertices and the same support
//! mapping as the engine.

use glam::DVec3;

use super::HubPair;
use super::cso::Cso;
use crate::algebra::Placement;
use crate::body::Polytope;

/// Returns the global depth of the pair, and its normal from body b into body a in b's frame. If
/// the bodies are apart, the depth is negative, and their distance is at least its absolute value.
pub(crate) fn exhaustive_depth(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> (f64, DVec3) {
    let cso = Cso { a, b, pose_ba };
    let mut oracle = Oracle { cso, hub: HubPair { a: 0, b: 0 }, best: (f64::INFINITY, DVec3::ZERO) };
    for plane in b.planes() {
        oracle.attempt(plane.normal);
    }
    for plane in a.planes() {
        oracle.attempt(-pose_ba.vector(plane.normal));
    }
    oracle.edge_pairs();
    oracle.best
}

struct Oracle<'o> {
    cso: Cso<'o>,
    hub: HubPair,
    best: (f64, DVec3),
}

/// An edge, and one further vertex of each of its two faces. `along` and `beside` are relative to
/// the edge's tail.
struct Wedge {
    tail: DVec3,
    along: DVec3,
    beside: [DVec3; 2],
}

fn wedges(polytope: &Polytope, place: impl Fn(DVec3) -> DVec3) -> Vec<Wedge> {
    let wedge = |edge: crate::body::Edge| {
        let tail = place(polytope.vertex(edge.tail));
        let beside = [edge.left, edge.right].map(|face| {
            let further = polytope.face_vertices(face).iter().find(|&v| v != edge.tail && v != edge.head);
            // A face with only two vertices has no further vertex.
            further.map_or(DVec3::ZERO, |v| place(polytope.vertex(v)) - tail)
        });
        Wedge { tail, along: place(polytope.vertex(edge.head)) - tail, beside }
    };
    polytope.edges().map(wedge).collect()
}

impl Oracle<'_> {
    fn attempt(&mut self, normal: DVec3) {
        let normal = normal.normalize();
        let (hub, offset) = self.cso.support(self.hub, normal);
        self.hub = hub;
        if offset < self.best.0 {
            self.best = (offset, normal);
        }
    }

    fn edge_pairs(&mut self) {
        let wedges_a = wedges(self.cso.a, |p| self.cso.pose_ba.point(p));
        let wedges_b = wedges(self.cso.b, |p| p);
        for a in &wedges_a {
            for b in &wedges_b {
                let across = a.along.cross(b.along);
                let length = across.length();
                if length <= 1e-9 * a.along.length() * b.along.length() {
                    continue;
                }
                let unit = across / length;
                let offset = unit.dot(b.tail - a.tail);
                for normal in [unit, -unit] {
                    // n·(b − a) never exceeds h(n). Also, n cannot support an edge if a face beside
                    // the edge rises above the edge.
                    let lower = if normal == unit { offset } else { -offset };
                    let slack = |v: DVec3| 1e-7 * v.length();
                    if lower < self.best.0
                        && b.beside.iter().all(|&v| normal.dot(v) <= slack(v))
                        && a.beside.iter().all(|&v| normal.dot(v) >= -slack(v))
                    {
                        self.attempt(normal);
                    }
                }
            }
        }
    }
}
