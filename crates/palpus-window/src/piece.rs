//! One convex piece, as numbers and as triangles: what of it is the mesh's surface, and what the
//! hull has added.

use glam::DVec3;
use palpus::body::{Body, Polytope, Provenance};

use crate::solid::Solid;

/// Counts of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceNumbers {
    /// Faces with a width.
    pub faces: usize,
    /// Number of faces that are wholly or for the larger part the mesh's.
    pub original_faces: usize,
    /// Number of faces that only the hull has.
    pub virtual_faces: usize,
    /// Faces of no width along the sides of a plate.
    pub rims: usize,
    /// Corners.
    pub vertices: usize,
    /// Edges, those of rims included.
    pub edges: usize,
    /// Edges along which the piece owns normals.
    pub arcs: usize,
    /// Normals that are a neighbour's on the mesh, and owned as the ends of arcs.
    pub borrowed: usize,
    /// Triangles of the mesh that it stands for.
    pub triangles: usize,
    /// m³; zero for a plate.
    pub volume: f64,
    /// Which part of all directions it owns, from 0 to 1.
    pub owned: f64,
}

/// Directions over which the owned part is counted.
const DIRECTIONS: usize = 4096;

impl PieceNumbers {
    /// Counts piece `k` of a body, which must exist.
    pub fn of(body: &Body, k: u32) -> Self {
        let polytope = &body.polytopes()[k as usize];
        let own = body.own_normals(k);
        let all = 0..polytope.face_count() as u32;
        let rims = all.clone().filter(|&f| polytope.is_rim(f)).count();
        let original = all.filter(|&f| polytope.face_provenance(f) == Provenance::Original).count();
        let owned = (0..DIRECTIONS).filter(|&i| {
            let direction = spread_direction(i);
            own.vertex_owns(polytope.support(direction), direction)
        });
        Self {
            faces: polytope.face_count() - rims,
            original_faces: original,
            virtual_faces: polytope.face_count() - rims - original,
            rims,
            vertices: polytope.vertices().len(),
            edges: polytope.edge_count(),
            arcs: own.arcs().len(),
            borrowed: own.borrowed().len(),
            triangles: body.pieces()[k as usize].triangles().len(),
            volume: volume(polytope),
            owned: owned.count() as f64 / DIRECTIONS as f64,
        }
    }
}

/// Directions spread evenly, in a spiral from pole to pole.
fn spread_direction(i: usize) -> DVec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / DIRECTIONS as f64;
    let (sin, cos) = (i as f64 * GOLDEN_ANGLE).sin_cos();
    let wide = (1.0 - z * z).sqrt();
    DVec3::new(wide * cos, wide * sin, z)
}

/// rad: π (3 − √5).
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// The sum of the signed tetrahedra between the middle and the faces.
fn volume(polytope: &Polytope) -> f64 {
    let middle = polytope.centroid();
    let of_face = |f: u32| {
        let corners: Vec<DVec3> = polytope.face_vertices(f).iter().map(|v| polytope.vertex(v) - middle).collect();
        let fan = corners.windows(2).skip(1).map(|pair| corners[0].dot(pair[0].cross(pair[1])));
        fan.sum::<f64>() / 6.0
    };
    (0..polytope.face_count() as u32).map(of_face).sum()
}

/// The piece with most faces, of several the first; none of a body without pieces.
pub fn richest_piece(body: &Body) -> Option<u32> {
    let faces = |k: &usize| body.polytopes()[*k].face_count();
    (0..body.polytopes().len()).rev().max_by_key(faces).map(|k| k as u32)
}

/// The faces of piece `k` that are the mesh's surface, and those that only the hull has.
pub(crate) fn piece_solids(body: &Body, k: u32) -> [Solid; 2] {
    let polytope = &body.polytopes()[k as usize];
    [Provenance::Original, Provenance::Virtual].map(|provenance| {
        let mut solid = Solid::default();
        solid.add_faces(polytope, k, DVec3::ZERO, |f| polytope.face_provenance(f) == provenance);
        solid
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_owns_all_directions_and_has_its_volume() {
        let side = |k: usize, bit: usize| (k >> bit & 1) as f64;
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(2.0 * side(k, 0), side(k, 1), 3.0 * side(k, 2))).collect();
        let body = Body::from_convex(&points).expect("the box has a hull");
        let numbers = PieceNumbers::of(&body, 0);
        assert!((numbers.volume - 6.0).abs() < 1e-12);
        let counted = [numbers.faces, numbers.original_faces, numbers.virtual_faces, numbers.rims, numbers.vertices];
        assert_eq!(counted, [6, 6, 0, 0, 8]);
        assert_eq!((numbers.edges, numbers.arcs, numbers.triangles), (12, 12, 12));
        assert!(numbers.owned > 0.999, "{}", numbers.owned);
        let [own, hull] = piece_solids(&body, 0);
        assert_eq!((own.triangles.len(), hull.triangles.len()), (12, 0));
        assert_eq!(richest_piece(&body), Some(0));
    }
}
