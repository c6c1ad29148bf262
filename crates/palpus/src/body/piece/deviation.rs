//! How far the shape of a piece differs from its part of the mesh.
//!
//! Facets merge triangles that are coplanar within the surface's noise, and the hull merges its
//! faces within the same length. The planes of a piece's faces then differ from the triangles by
//! about the noise. A piece of exact triangles or exactly planar polygons has no deviation.

use crate::algebra::tolerance::{FLAT_PATCH, PIECES_PER_PART, WELL_FORMED_ROUNDING};
use crate::algebra::{Workers, map_in_order};
use crate::body::{Mesh, Piece, Polytope};

/// The deviations of all pieces of a body.
#[derive(Clone, Debug, Default)]
pub(crate) struct Deviations {
    of: Vec<f64>,
    most: f64,
}

impl Deviations {
    /// Computes the deviations. `noise` is the largest distance of the vertices of a planar face
    /// from its plane (m).
    pub(crate) fn new(
        mesh: &Mesh,
        polytopes: &[Polytope],
        pieces: &[Piece],
        noise: f64,
        workers: &dyn Workers,
    ) -> Self {
        let of = |k: usize| deviation(mesh, &polytopes[k], &pieces[k], noise);
        let of = map_in_order(workers, pieces.len(), PIECES_PER_PART, of, &mut |_| ());
        let most = of.iter().copied().fold(0.0, f64::max);
        Self { of, most }
    }

    /// Returns no deviations for `pieces` pieces, so that distances are those of the pieces.
    pub(crate) fn none(pieces: usize) -> Self {
        Self { of: vec![0.0; pieces], most: 0.0 }
    }

    /// Returns the deviation of piece `k` (m); 0 if it consists of rounding errors only.
    pub(crate) fn of(&self, k: u32) -> f64 {
        self.of[k as usize]
    }

    /// Returns the largest deviation (m).
    pub(crate) fn most(&self) -> f64 {
        self.most
    }
}

/// Returns the largest distance of a triangle's corner from the plane of the face in which the
/// triangle lies. If parts of a triangle lie in several faces, the nearest plane counts.
fn deviation(mesh: &Mesh, polytope: &Polytope, piece: &Piece, noise: f64) -> f64 {
    // A triangle that lies in no face is hidden below a merged face.
    let largest = FLAT_PATCH * noise;
    let mut of = vec![largest; piece.triangles().len()];
    for f in 0..polytope.face_count() as u32 {
        let plane = polytope.plane(f);
        for t in piece.face_triangles(f) {
            // The list of a face also has triangles that only touch it.
            let [p, q, r] = mesh.triangle_points(*t).map(|p| plane.height(p).abs());
            let off = p.max(q).max(r);
            if off < largest
                && let Ok(k) = piece.triangles().binary_search(t)
            {
                of[k] = off.min(of[k]);
            }
        }
    }
    let most = of.into_iter().fold(0.0, f64::max);
    let rounding = WELL_FORMED_ROUNDING * (polytope.centroid().abs().max_element() + polytope.radius());
    if most <= rounding { 0.0 } else { most }
}
