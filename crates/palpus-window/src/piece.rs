//! One convex piece, as numbers and as triangles. Separates the mesh's surface from the faces that
//! the hull added.

use glam::DVec3;
use palpus::body::{Body, Polytope, Provenance};

use crate::solid::Solid;

/// Counts of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceNumbers {
    /// Number of faces with a width.
    pub faces: usize,
    /// Number of faces that belong wholly or mostly to the mesh.
    pub original_faces: usize,
    /// Number of faces that only the hull has.
    pub virtual_faces: usize,
    /// Number of faces of zero width along the sides of a flat piece.
    pub rims: usize,
    /// Number of corners.
    pub vertices: usize,
    /// Number of edges, including the edges of rims.
    pub edges: usize,
    /// Number of edges with admissible normals.
    pub arcs: usize,
    /// Number of neighbours' normals on the mesh that are admissible as the ends of arcs.
    pub borrowed: usize,
    /// Number of triangles of the mesh in the piece's patch.
    pub triangles: usize,
    /// Volume, m³; zero for a flat piece.
    pub volume: f64,
    /// Share of all directions that is admissible, from 0 to 1.
    pub owned: f64,
}

/// Number of directions with which this share is measured.
const DIRECTIONS: usize = 4096;

impl PieceNumbers {
    /// Counts the parts of piece `k`, which must exist.
    pub fn of(body: &Body, k: u32) -> Self {
        let polytope = &body.polytopes()[k as usize];
        let own = body.admissible_normals(k);
        let all = 0..polytope.face_count() as u32;
        let rims = all.clone().filter(|&f| polytope.is_rim(f)).count();
        let original = all.filter(|&f| polytope.face_provenance(f) == Provenance::Original).count();
        let owned = (0..DIRECTIONS).filter(|&i| {
            let direction = spread_direction(i);
            own.vertex_admits(polytope.support(direction), direction)
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

/// Returns the `i`-th of evenly distributed directions, in a spiral from pole to pole.
fn spread_direction(i: usize) -> DVec3 {
    let z = 1.0 - (2.0 * i as f64 + 1.0) / DIRECTIONS as f64;
    let (sin, cos) = (i as f64 * GOLDEN_ANGLE).sin_cos();
    let wide = (1.0 - z * z).sqrt();
    DVec3::new(wide * cos, wide * sin, z)
}

/// Golden angle, π (3 − √5), rad.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Returns the volume: the sum of the signed tetrahedra between the middle and the faces.
fn volume(polytope: &Polytope) -> f64 {
    let middle = polytope.centroid();
    let of_face = |f: u32| {
        let corners: Vec<DVec3> = polytope.face_vertices(f).iter().map(|v| polytope.vertex(v) - middle).collect();
        let fan = corners.windows(2).skip(1).map(|pair| corners[0].dot(pair[0].cross(pair[1])));
        fan.sum::<f64>() / 6.0
    };
    (0..polytope.face_count() as u32).map(of_face).sum()
}

/// Returns the piece with most faces (the first, if several have most faces); `None` for a body
/// without pieces.
pub fn richest_piece(body: &Body) -> Option<u32> {
    let faces = |k: &usize| body.polytopes()[*k].face_count();
    (0..body.polytopes().len()).rev().max_by_key(faces).map(|k| k as u32)
}

/// Returns the faces of piece `k` that belong to the mesh's surface, and the faces that only the
/// hull has.
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
