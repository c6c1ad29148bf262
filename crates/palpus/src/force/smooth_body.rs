//! The smooth surface of a body under each feature of each of its convex pieces.
//!
//! For each body, the triangles of the mesh that lie in each face of each piece, and the normal at
//! each vertex, are computed once. A face may also list triangles that only touch the face, and a
//! virtual face may list triangles that lie only partly in the face. A contact is never on such a
//! triangle. These triangles are left out, because a contact point may be equally near to them and
//! to the right triangle.

use glam::DVec3;

use super::SmoothNormal;
use super::smooth_surface::SmoothSurface;
use crate::algebra::tolerance::SHADING_IN_FACE;
use crate::body::{Body, Feature, Piece, Polytope, Provenance, ShadingNormals};

/// Data of a body for shading.
#[derive(Clone, Debug)]
pub struct SmoothBody {
    surface: SmoothSurface,
    pieces: Vec<First>,
    /// Face `f` of a piece lies on `triangles[starts[faces + f]..starts[faces + f + 1]]`.
    starts: Vec<u32>,
    triangles: Vec<u32>,
    vertices: Vec<Option<SmoothNormal>>,
}

/// Index of a piece's first face and first vertex in the lists of all pieces.
#[derive(Clone, Copy, Debug)]
struct First {
    face: u32,
    vertex: u32,
}

impl SmoothBody {
    /// Returns the smooth surface of `body`. Edges that bend by more than `crease_angle` (rad) stay
    /// sharp.
    pub fn new(body: &Body, crease_angle: f64) -> Self {
        let normals = ShadingNormals::new(body.mesh(), body.half_edges(), crease_angle);
        let mut answer = Self {
            surface: SmoothSurface::new(body.mesh(), body.half_edges(), |t, k| normals.corner(t, k)),
            pieces: Vec::with_capacity(body.pieces().len()),
            starts: vec![0],
            triangles: Vec::new(),
            vertices: Vec::new(),
        };
        for (polytope, piece) in body.polytopes().iter().zip(body.pieces()) {
            answer.push_piece(body, polytope, piece);
        }
        answer
    }

    /// Returns the smooth surface at `point` (in the body's frame), for a contact on `feature` of
    /// piece `piece`. `None` on a crease, and if the feature lies on no triangle of the mesh or on
    /// too many triangles.
    pub fn at(&self, body: &Body, piece: u32, feature: Feature, point: DVec3) -> Option<SmoothNormal> {
        let first = self.pieces[piece as usize];
        let on = |face: u32| self.on_face(first, face).iter().copied();
        match feature {
            Feature::Face(face) => self.surface.at(body.mesh(), feature, on(face), point),
            Feature::Edge(edge) => {
                let edge = body.polytopes()[piece as usize].edge(edge);
                self.surface.at(body.mesh(), feature, on(edge.left).chain(on(edge.right)), point)
            }
            Feature::Vertex(vertex) => self.vertices[(first.vertex + vertex) as usize],
        }
    }

    /// Limits the unit `direction` to the directions that a crease allows. The contact on the
    /// crease has the true outward `normal`; all vectors are in the body's frame. For
    /// features where [`Self::at`] returns `None`.
    ///
    /// A crease allows the directions between the normals of its faces. When the true normal leaves
    /// this range, the contact moves to a face, which has only one direction. So for continuity,
    /// the direction is turned by at most the angle between the true normal and the nearest
    /// bound of the range.
    pub fn confine(body: &Body, piece: u32, feature: Feature, normal: DVec3, direction: DVec3) -> DVec3 {
        let polytope = &body.polytopes()[piece as usize];
        match feature {
            Feature::Face(_) => normal,
            Feature::Edge(edge) => {
                let edge = polytope.edge(edge);
                let along = (polytope.vertex(edge.head) - polytope.vertex(edge.tail)).normalize_or_zero();
                let faces = [edge.left, edge.right].map(|face| polytope.plane(face).normal);
                let room = faces.map(|face| normal.angle_between(face));
                turned(normal, direction - along * along.dot(direction), room[0].min(room[1]))
            }
            Feature::Vertex(vertex) => {
                let from = polytope.vertex(vertex);
                let falls = |neighbour: u32| -normal.dot((polytope.vertex(neighbour) - from).normalize_or_zero());
                let least = polytope.ring(vertex).iter().map(|spoke| falls(spoke.neighbour)).fold(1.0, f64::min);
                turned(normal, direction, least.max(0.0).asin())
            }
        }
    }

    fn on_face(&self, first: First, face: u32) -> &[u32] {
        let at = (first.face + face) as usize;
        &self.triangles[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    fn push_piece(&mut self, body: &Body, polytope: &Polytope, piece: &Piece) {
        let first = First { face: self.starts.len() as u32 - 1, vertex: self.vertices.len() as u32 };
        for face in 0..polytope.face_count() as u32 {
            if polytope.face_provenance(face) == Provenance::Original {
                let normal = polytope.plane(face).normal;
                let lies_in = |&t: &u32| body.mesh().triangle_normal(t).dot(normal) >= SHADING_IN_FACE;
                self.triangles.extend(piece.face_triangles(face).iter().copied().filter(lies_in));
            }
            self.starts.push(self.triangles.len() as u32);
        }
        for (vertex, &point) in polytope.vertices().iter().enumerate() {
            let ring = polytope.ring(vertex as u32);
            let around = ring.iter().flat_map(|spoke| self.on_face(first, spoke.left).iter().copied());
            let answer = self.surface.at(body.mesh(), Feature::Vertex(vertex as u32), around, point);
            self.vertices.push(answer);
        }
        self.pieces.push(first);
    }
}

/// Returns `normal` (unit), turned towards `goal` by at most `most` (rad).
fn turned(normal: DVec3, goal: DVec3, most: f64) -> DVec3 {
    let across = goal.reject_from_normalized(normal);
    let angle = across.length().atan2(goal.dot(normal)).min(most);
    (normal * angle.cos() + across.normalize_or_zero() * angle.sin()).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{BodySettings, Mesh, PolygonSoup};

    /// Returns a closed prism of `sides` sides around the z axis.
    fn drum(sides: u32) -> Body {
        let mut soup = PolygonSoup::new();
        for k in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(sides);
            let rim = DVec3::new(angle.cos(), angle.sin(), 0.0);
            soup.vertices.extend([rim - DVec3::Z, rim + DVec3::Z]);
            let next = (k + 1) % sides;
            soup.push_face(&[2 * k, 2 * next, 2 * next + 1, 2 * k + 1]);
        }
        soup.push_face(&(0..sides).rev().map(|k| 2 * k).collect::<Vec<_>>());
        soup.push_face(&(0..sides).map(|k| 2 * k + 1).collect::<Vec<_>>());
        let (mesh, _) = Mesh::from_soup(&soup).unwrap();
        Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap()
    }

    #[test]
    fn drum_has_a_smooth_side_and_sharp_rims() {
        let body = drum(20);
        let smooth = SmoothBody::new(&body, 0.6);
        for (piece, polytope) in body.polytopes().iter().enumerate() {
            let at = |feature, point| smooth.at(&body, piece as u32, feature, point);
            for face in 0..polytope.face_count() as u32 {
                let middle = polytope.face_vertices(face).iter().map(|v| polytope.vertex(v)).sum::<DVec3>()
                    / polytope.face_vertices(face).len() as f64;
                match at(Feature::Face(face), middle) {
                    Some(there) => {
                        assert!((there.normal - polytope.plane(face).normal).length() < 1e-9);
                        let flat = there.normal.z.abs() > 0.5;
                        assert!(if flat { there.curvature == 0.0 } else { (there.curvature - 1.0).abs() < 0.02 });
                    }
                    None => assert_eq!(polytope.face_provenance(face), Provenance::Virtual),
                }
            }
            for e in 0..polytope.edge_count() as u32 {
                let edge = polytope.edge(e);
                let (tail, head) = (polytope.vertex(edge.tail), polytope.vertex(edge.head));
                let upright = (tail.z - head.z).abs() > 1.0 && tail.truncate().distance(head.truncate()) < 1e-9;
                if let Some(there) = at(Feature::Edge(e), 0.5 * (tail + head)) {
                    let outward = DVec3::new(tail.x, tail.y, 0.0).normalize();
                    assert!(upright && (there.normal - outward).length() < 1e-9);
                }
            }
            for vertex in 0..polytope.vertices().len() as u32 {
                assert_eq!(at(Feature::Vertex(vertex), polytope.vertex(vertex)), None);
            }
        }
    }
}
