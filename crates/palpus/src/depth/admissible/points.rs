//! The points of an admissible depth: its witness points, and the points where its features face
//! each other.

use glam::DVec3;

use super::super::Antipodal;
use super::super::antipodal::{Corner, Facet, flush_at_vertex};
use super::super::witness::{Clip, witness};
use super::{Found, Search};
use crate::algebra::closest_on_segment;
use crate::algebra::tolerance::FLUSH_WITNESS;
use crate::body::{Feature, Polytope};

impl Search<'_> {
    /// Returns the nearest points of the two features (on a, on b), in b's frame.
    pub(super) fn facing(&self, found: &Found, depth: f64, clip: &mut Clip) -> (DVec3, DVec3) {
        let Found { normal, features, hub } = *found;
        let antipodal = match (features.a, features.b) {
            (Feature::Vertex(_), Feature::Face(b)) => Antipodal::VertexFace { a: hub.a, b },
            (Feature::Face(a), Feature::Vertex(_)) => Antipodal::FaceVertex { a, b: hub.b },
            (Feature::Edge(a), Feature::Edge(b)) => Antipodal::EdgeEdge { a, b },
            (_, Feature::Edge(edge)) => {
                let edge = self.cso.b.edge(edge);
                let ends = [edge.tail, edge.head].map(|v| self.cso.b.vertex(v));
                let point_b = nearest_of(ends, self.cso.point_a(hub.a));
                return (point_b - normal * depth, point_b);
            }
            (Feature::Edge(edge), _) => {
                let edge = self.cso.a.edge(edge);
                let ends = [edge.tail, edge.head].map(|v| self.cso.point_a(v));
                let point_a = nearest_of(ends, self.cso.b.vertex(hub.b));
                return (point_a, point_a + normal * depth);
            }
            // A facet of the CSO has no other pair of features.
            _ => Antipodal::VertexFace { a: hub.a, b: 0 },
        };
        let corner = Corner { normal, offset: depth, antipodal, hub };
        witness(&self.cso, &Facet::at(&self.cso, &corner, FLUSH_WITNESS), &corner, clip)
    }

    /// Returns the witness points (on a, on b) in b's frame. If the vertex lies beside the feature
    /// with the admissible normal, the vertex faces a neighbouring piece. The witness then stays at
    /// the vertex, so the contacts of both pieces coincide.
    pub(super) fn witness(&self, found: &Found, depth: f64, facing: (DVec3, DVec3)) -> (DVec3, DVec3) {
        let Found { normal, features, hub } = *found;
        match (features.a, features.b) {
            (Feature::Vertex(_), Feature::Face(_) | Feature::Edge(_)) => {
                let flush = flush_at_vertex(self.cso.a, hub.a, self.cso.toward_b(normal), FLUSH_WITNESS);
                match (flush, features.b) {
                    (Feature::Edge(_) | Feature::Face(_), Feature::Face(_)) => facing,
                    _ => {
                        let point_a = self.cso.pose_ba.point(middle(self.cso.a, flush));
                        (point_a, point_a + normal * depth)
                    }
                }
            }
            (Feature::Edge(_), Feature::Vertex(_)) => {
                let flush = flush_at_vertex(self.cso.b, hub.b, normal, FLUSH_WITNESS);
                let point_b = middle(self.cso.b, flush);
                (point_b - normal * depth, point_b)
            }
            _ => facing,
        }
    }
}

/// Returns the point of a segment that is nearest to `p`.
fn nearest_of([tail, head]: [DVec3; 2], p: DVec3) -> DVec3 {
    tail.lerp(head, closest_on_segment(p, tail, head))
}

/// Returns the mean of a feature's corners, in the polytope's frame.
fn middle(polytope: &Polytope, feature: Feature) -> DVec3 {
    match feature {
        Feature::Vertex(v) => polytope.vertex(v),
        Feature::Edge(e) => {
            let edge = polytope.edge(e);
            0.5 * (polytope.vertex(edge.tail) + polytope.vertex(edge.head))
        }
        Feature::Face(f) => {
            let corners = polytope.face_vertices(f);
            corners.iter().map(|v| polytope.vertex(v)).sum::<DVec3>() / corners.len() as f64
        }
    }
}
