//! A body: everything about one object that is computed once and then only read.

use super::decompose::decompose;
use super::facet::{Facets, Surface};
use super::grow::Grower;
use super::piece::{Piece, build_piece};
use super::{HalfEdges, Hierarchy, HierarchyError, HullError, Mesh, Polytope, TriangleTree};
use crate::algebra::tolerance::COPLANAR;

/// How a body is made of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySettings {
    /// Metres per unit of the model; finite and positive.
    pub scale: f64,
    /// Radians: where neighbouring triangles bend by more, shading normals do not blend across.
    pub crease_angle: f64,
}

impl Default for BodySettings {
    /// A model in metres, with creases from 30 degrees on.
    fn default() -> Self {
        Self { scale: 1.0, crease_angle: std::f64::consts::FRAC_PI_6 }
    }
}

/// Why a mesh makes no body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// The scale is zero, negative, infinite or NaN.
    #[error("the scale must be a positive number of metres per model unit, not {0}")]
    Scale(f64),
    /// The hull of a patch could not be built.
    #[error("piece {piece} (first triangle {triangle}) has no hull")]
    Piece {
        /// Index of the piece.
        piece: usize,
        /// A triangle of it.
        triangle: u32,
        /// What the hull says.
        #[source]
        source: HullError,
    },
    /// The pieces make no tree.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
}

/// An object, ready for queries. Immutable, to be shared between threads. Metres, in the frame of the model.
#[derive(Clone, Debug)]
pub struct Body {
    mesh: Mesh,
    half_edges: HalfEdges,
    tree: TriangleTree,
    polytopes: Vec<Polytope>,
    pieces: Vec<Piece>,
    hierarchy: Hierarchy,
}

impl Body {
    /// Makes a body of a mesh; `progress` is told the fraction done, rising to one.
    pub fn build(mesh: Mesh, settings: &BodySettings, progress: &mut dyn FnMut(f64)) -> Result<Self, BodyError> {
        if !(settings.scale.is_finite() && settings.scale > 0.0) {
            return Err(BodyError::Scale(settings.scale));
        }
        let mesh = mesh.scaled(settings.scale);
        let half_edges = HalfEdges::new(&mesh);
        let tree = mesh.tree();
        let (polytopes, pieces) = convex_pieces(&mesh, &half_edges, &tree, progress)?;
        let hierarchy = Hierarchy::build(&polytopes, COPLANAR * mesh.bounding_diagonal())?;
        Ok(Self { mesh, half_edges, tree, polytopes, pieces, hierarchy })
    }

    /// The surface.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Neighbours of the surface's triangles.
    pub fn half_edges(&self) -> &HalfEdges {
        &self.half_edges
    }

    /// The surface's triangles as a tree, for nearest points, rays and inside tests.
    pub fn tree(&self) -> &TriangleTree {
        &self.tree
    }

    /// The convex pieces' shapes.
    pub fn polytopes(&self) -> &[Polytope] {
        &self.polytopes
    }

    /// The convex pieces' ties to the mesh, parallel to [`Self::polytopes`].
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The tree of hulls over the pieces.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// Bounding diagonal of the mesh, metres.
    pub fn size(&self) -> f64 {
        self.mesh.bounding_diagonal()
    }
}

/// Facets, patches, pieces.
fn convex_pieces(
    mesh: &Mesh,
    half_edges: &HalfEdges,
    tree: &TriangleTree,
    progress: &mut dyn FnMut(f64),
) -> Result<(Vec<Polytope>, Vec<Piece>), BodyError> {
    let surface = Surface::new(mesh, half_edges);
    let facets = Facets::of(&surface);
    let mut grower = Grower::new(surface, &facets, tree);
    let patches = decompose(&mut grower, &mut |done| progress(DECOMPOSITION_SHARE * done));
    let mut answer = (Vec::with_capacity(patches.len()), Vec::with_capacity(patches.len()));
    for (k, patch) in patches.iter().enumerate() {
        let (polytope, piece) = build_piece(&surface, &facets, patch).map_err(|source| BodyError::Piece {
            piece: k,
            triangle: facets.triangles(patch.facets[0])[0],
            source,
        })?;
        answer.0.push(polytope);
        answer.1.push(piece);
        progress(DECOMPOSITION_SHARE + (1.0 - DECOMPOSITION_SHARE) * (k + 1) as f64 / patches.len() as f64);
    }
    Ok(answer)
}

/// The part of the work that the decomposition is, for the progress report.
const DECOMPOSITION_SHARE: f64 = 0.8;

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::body::{PolygonSoup, Provenance};

    /// A block in the shape of an L, one unit thick, its caps cut into triangles.
    fn l_block() -> Mesh {
        let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
        let vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
        let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
        soup.push_face(&[5, 4, 3, 2, 1, 0]);
        soup.push_face(&[6, 7, 8, 9, 10, 11]);
        for k in 0..6 {
            soup.push_face(&[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]);
        }
        Mesh::from_soup(&soup).unwrap().0
    }

    #[test]
    fn an_l_is_two_pieces_that_leave_its_notch_free() {
        let mut last = 0.0;
        let settings = BodySettings { scale: 0.1, ..BodySettings::default() };
        let body = Body::build(l_block(), &settings, &mut |done| {
            assert!(done >= last);
            last = done;
        })
        .unwrap();
        assert!((last - 1.0).abs() < 1e-12);
        assert_eq!(body.polytopes().len(), 2);
        let mut triangles: Vec<u32> = body.pieces().iter().flat_map(Piece::triangles).copied().collect();
        triangles.sort_unstable();
        assert_eq!(triangles, (0..body.mesh().triangles().len() as u32).collect::<Vec<_>>());
        let notch = DVec3::new(0.15, 0.15, 0.05);
        for (polytope, piece) in body.polytopes().iter().zip(body.pieces()) {
            assert!(polytope.planes().iter().any(|plane| plane.height(notch) > 0.0));
            for f in 0..polytope.face_count() as u32 {
                assert!(polytope.face_provenance(f) == Provenance::Virtual || !piece.face_triangles(f).is_empty());
            }
        }
    }

    #[test]
    fn a_scale_that_is_none_is_refused() {
        let settings = BodySettings { scale: f64::NAN, ..BodySettings::default() };
        assert!(matches!(Body::build(l_block(), &settings, &mut |_| ()), Err(BodyError::Scale(_))));
    }
}
