//! A body: all data of one object that are computed once and do not change later.

use glam::DVec3;

use super::decompose::decompose;
use super::piece::deviation::Deviations;
use super::piece::{Piece, build_piece};
use super::precision::coordinate_step;
use super::{
    Aabb, Admissible, AdmissibleNormals, Cleaning, Feature, HalfEdges, Health, Hierarchy, HierarchyError, HullError,
    MassProperties, Mesh, MeshError, PolygonSoup, Polytope, TriangleTree, convex_hull,
};
use crate::algebra::tolerance::{COPLANAR, PIECES_PER_PART};
use crate::algebra::{Alone, Workers, both, map_in_order};
use crate::body::decompose::facet::{Facets, Surface};
use crate::body::decompose::grow::Grower;
use crate::body::decompose::thicken::{InwardPaths, inner_corners};

/// Settings for [`Body::build`] and [`Body::from_soup`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodySettings {
    /// Metres per unit of the model; finite and positive.
    pub scale: f64,
    /// Largest deviation of a piece from the surface, divided by the model's bounding diagonal;
    /// from 0 to 1e-3. A deviation is needed because rounded coordinates in a file make planes
    /// slightly uneven. See [`Self::EXACT`] and [`Self::HAPTIC`].
    pub flatness: f64,
    /// If true, each piece of a closed surface extends from its patch into the solid, until another
    /// part of the surface is equally near. Deep penetration is then detected. If false, each piece
    /// is only the convex hull of its patch.
    pub thick: bool,
}

impl BodySettings {
    /// Flatness for measurements. The error of depths is at most about this value times the
    /// bounding diagonal. The distance of [`ContactQuery::nearest`] has only rounding errors. (With
    /// a larger flatness, it is the distance of the pieces.)
    ///
    /// [`ContactQuery::nearest`]: crate::detect::ContactQuery::nearest
    pub const EXACT: f64 = 3e-8;
    /// Flatness for haptic rendering: 3 µm on an object of 10 cm. A person cannot feel this
    /// deviation. If a plane is written with six digits, this flatness merges it into one face. A
    /// round peg then has 1 piece instead of 4870.
    pub const HAPTIC: f64 = 3e-5;
}

impl Default for BodySettings {
    /// Returns the settings for a model in metres, with flatness [`Self::EXACT`] and thick pieces.
    fn default() -> Self {
        Self { scale: 1.0, flatness: Self::EXACT, thick: true }
    }
}

/// The reason why a body cannot be built from a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// The scale is zero, negative, infinite or NaN.
    #[error("the scale must be a positive number of metres per model unit, not {0}")]
    Scale(f64),
    /// The flatness is negative, NaN or above the limit.
    #[error("the flatness must be from 0 to {LARGEST_FLATNESS} of the model's size, not {0}")]
    Flatness(f64),
    /// The polygons do not form a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The points of a convex body have no hull, or their hull is a point or a segment.
    #[error("the points do not span a convex body")]
    NotConvexBody(#[source] Option<HullError>),
    /// The hull of a patch could not be built.
    #[error("piece {piece} (first triangle {triangle}) has no hull")]
    Piece {
        /// Index of the piece.
        piece: usize,
        /// Index of one triangle of the piece.
        triangle: u32,
        /// The error of the hull's construction.
        #[source]
        source: HullError,
    },
    /// The [`BodyParts`] do not fit each other or the mesh.
    #[error("the parts do not belong to this mesh: {0}")]
    Parts(&'static str),
    /// The hierarchy over the pieces could not be built.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
}

/// An object that is ready for queries. A body is immutable, and threads can share it. All
/// coordinates are in metres, in the model's frame.
#[derive(Clone, Debug)]
pub struct Body {
    mesh: Mesh,
    half_edges: HalfEdges,
    tree: TriangleTree,
    polytopes: Vec<Polytope>,
    pieces: Vec<Piece>,
    admissible: Admissible,
    hierarchy: Hierarchy,
    mass: MassProperties,
    health: Health,
    deviations: Deviations,
}

impl Body {
    /// Hash of the source files that decide which pieces a mesh gives. Do not restore parts that an
    /// engine with another fingerprint made.
    pub const FINGERPRINT: &str = env!("PALPUS_BODY_FINGERPRINT");

    /// Builds a body from the polygons of a file. Calls `progress` with the finished fraction,
    /// which rises to 1.
    pub fn from_soup(
        soup: &PolygonSoup,
        settings: &BodySettings,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, BodyError> {
        Self::from_soup_with(soup, settings, &Alone, progress)
    }

    /// Builds the same body as [`Self::from_soup`] on several `workers`. The result does not depend
    /// on the workers.
    pub fn from_soup_with(
        soup: &PolygonSoup,
        settings: &BodySettings,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, BodyError> {
        Self::assemble(Ground::new(soup, settings)?, settings, workers, progress)
    }

    /// Restores a body from its `parts`. The caller must make `ground` from the same soup and the
    /// same settings as the parts.
    ///
    /// # Errors
    /// Fails if the parts do not fit each other, or do not fit the mesh.
    pub fn restore(ground: Ground, parts: BodyParts, workers: &dyn Workers) -> Result<Self, BodyError> {
        parts.check(ground.mesh.triangles().len(), workers).map_err(BodyError::Parts)?;
        Ok(Self::finish(ground, parts, workers))
    }

    /// Builds a body from a mesh. The body's [`Self::health`] does not list the repairs that
    /// [`Mesh::from_soup`] made.
    pub fn build(mesh: Mesh, settings: &BodySettings, progress: &mut dyn FnMut(f64)) -> Result<Self, BodyError> {
        Self::assemble(Ground::of_mesh(mesh, Cleaning::default(), settings)?, settings, &Alone, progress)
    }

    fn assemble(
        ground: Ground,
        settings: &BodySettings,
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, BodyError> {
        progress(GROUND_SHARE);
        let surface = Surface::new(&ground.mesh, &ground.half_edges, ground.step, settings.flatness);
        let (polytopes, pieces) = convex_pieces(&surface, &ground.tree, settings.thick, workers, progress)?;
        let coplanar = COPLANAR * ground.mesh.bounding_diagonal();
        let hierarchy = Hierarchy::build_with(&polytopes, coplanar, workers, &mut |done| {
            progress(BELOW_HIERARCHY + (BELOW_FINISH - BELOW_HIERARCHY) * done);
        })?;
        let body = Self::finish(ground, BodyParts { polytopes, pieces, hierarchy }, workers);
        progress(1.0);
        Ok(body)
    }

    /// Computes the admissible normals, the mass properties and the health, and assembles the body.
    fn finish(ground: Ground, parts: BodyParts, workers: &dyn Workers) -> Self {
        let Ground { mesh, cleaning, half_edges, tree, step, flatness } = ground;
        let BodyParts { polytopes, pieces, hierarchy } = parts;
        let noise = Surface::new(&mesh, &half_edges, step, flatness).noise();
        let of_pieces = || {
            let admissible = Admissible::new(&mesh, &half_edges, &polytopes, &pieces, noise, workers);
            // With a larger flatness, the surface of the pieces is the surface that is felt, so
            // distances need no correction.
            let deviations = match flatness <= BodySettings::EXACT {
                true => Deviations::new(&mesh, &polytopes, &pieces, noise, workers),
                false => Deviations::none(pieces.len()),
            };
            (admissible, deviations)
        };
        let of_mesh = || (MassProperties::new(&mesh), Health::quick(&mesh, &half_edges, cleaning));
        let ((admissible, deviations), (mass, health)) = both(workers, of_pieces, of_mesh);
        Self { mesh, half_edges, tree, polytopes, pieces, admissible, hierarchy, mass, health, deviations }
    }

    /// Builds a body of one piece from the convex hull of `points` (m).
    pub fn from_convex(points: &[DVec3]) -> Result<Self, BodyError> {
        let size = Aabb::around(points.iter().copied());
        let hull = convex_hull(points, COPLANAR * size.min.distance(size.max));
        let hull = hull.map_err(|error| BodyError::NotConvexBody(Some(error)))?;
        let (polytope, _) = hull.into_polytope().ok_or(BodyError::NotConvexBody(None))?;
        let mut soup = PolygonSoup { vertices: polytope.vertices().to_vec(), ..PolygonSoup::new() };
        for f in (0..polytope.face_count() as u32).filter(|&f| !polytope.is_rim(f)) {
            soup.push_face(&polytope.face_vertices(f).to_vec());
        }
        Self::from_soup(&soup, &BodySettings::default(), &mut |_| ())
    }

    /// Returns the surface mesh.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Returns the neighbours of the mesh's triangles.
    pub fn half_edges(&self) -> &HalfEdges {
        &self.half_edges
    }

    /// Returns the tree over the mesh's triangles, for nearest points, rays and inside tests.
    pub fn tree(&self) -> &TriangleTree {
        &self.tree
    }

    /// Returns the polytopes of the convex pieces.
    pub fn polytopes(&self) -> &[Polytope] {
        &self.polytopes
    }

    /// Returns the mesh triangles of the convex pieces, in the order of [`Self::polytopes`].
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Returns the admissible normals of all pieces.
    pub fn admissible(&self) -> &Admissible {
        &self.admissible
    }

    /// Returns the admissible normals of piece `k`.
    #[inline]
    pub fn admissible_normals(&self, k: u32) -> AdmissibleNormals<'_> {
        self.admissible.of(k, &self.polytopes[k as usize], &self.mesh)
    }

    /// Returns true if `point` on `feature` of piece `k` lies on the mesh and `outward` (unit) is
    /// an admissible normal at that point. Both vectors are in the body's frame; `point` is in
    /// metres.
    pub fn admits(&self, k: u32, feature: Feature, point: DVec3, outward: DVec3) -> bool {
        self.admissible_normals(k).holds(&self.pieces[k as usize], feature, point, outward)
    }

    /// Returns how far the pieces differ from the mesh.
    pub(crate) fn deviations(&self) -> &Deviations {
        &self.deviations
    }

    /// Returns the tree of hulls over the pieces.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// Returns the volume, the centre of mass and the inertia at density 1 kg/m³.
    pub fn mass(&self) -> &MassProperties {
        &self.mass
    }

    /// Returns the health of the mesh, without the test for self-intersections (see
    /// [`Health::full`]).
    pub fn health(&self) -> &Health {
        &self.health
    }

    /// Returns the length of the mesh's bounding diagonal (m).
    pub fn size(&self) -> f64 {
        self.mesh.bounding_diagonal()
    }
}

/// A mesh and the data from which the pieces are computed. These data are quick to compute.
#[derive(Clone, Debug)]
pub struct Ground {
    mesh: Mesh,
    cleaning: Cleaning,
    half_edges: HalfEdges,
    tree: TriangleTree,
    /// Distance between neighbouring values of the file's coordinates (m); see `precision`.
    step: f64,
    flatness: f64,
}

impl Ground {
    /// Builds the mesh and its tree from the polygons of a file.
    pub fn new(soup: &PolygonSoup, settings: &BodySettings) -> Result<Self, BodyError> {
        let (mesh, cleaning) = Mesh::from_soup(soup)?;
        Self::of_mesh(mesh, cleaning, settings)
    }

    fn of_mesh(mesh: Mesh, cleaning: Cleaning, settings: &BodySettings) -> Result<Self, BodyError> {
        if !(settings.scale.is_finite() && settings.scale > 0.0) {
            return Err(BodyError::Scale(settings.scale));
        }
        if !(0.0..=LARGEST_FLATNESS).contains(&settings.flatness) {
            return Err(BodyError::Flatness(settings.flatness));
        }
        let step = coordinate_step(mesh.vertices()) * settings.scale;
        let mesh = mesh.scaled(settings.scale);
        let half_edges = HalfEdges::new(&mesh);
        let tree = mesh.tree();
        Ok(Self { mesh, cleaning, half_edges, tree, step, flatness: settings.flatness })
    }
}

/// The parts of a body whose computation takes long. Callers may cache them.
#[derive(Clone, Debug)]
pub struct BodyParts {
    /// See [`Body::polytopes`].
    pub polytopes: Vec<Polytope>,
    /// See [`Body::pieces`].
    pub pieces: Vec<Piece>,
    /// See [`Body::hierarchy`].
    pub hierarchy: Hierarchy,
}

impl BodyParts {
    /// Checks that these parts fit a mesh of `triangles` triangles. The error describes the first
    /// mismatch.
    fn check(&self, triangles: usize, workers: &dyn Workers) -> Result<(), &'static str> {
        let count = self.polytopes.len();
        if self.pieces.len() != count || self.hierarchy.nodes().len() != (2 * count).saturating_sub(1) {
            return Err("the numbers of pieces, polytopes and tree nodes do not match");
        }
        let mut free = vec![true; triangles];
        let taken = |t: &u32| free.get_mut(*t as usize).is_some_and(std::mem::take);
        if !self.pieces.iter().flat_map(Piece::triangles).all(taken) || free.contains(&true) {
            return Err("a triangle belongs to no piece or to several");
        }
        // The polytopes are not checked here, because their constructor checks each of them.
        let fits = |k: usize| self.pieces[k].fits(self.polytopes[k].face_count());
        let all = map_in_order(workers, count, PIECES_PER_PART, fits, &mut |_| ());
        if all.contains(&false) { Err("a piece does not fit its polytope") } else { Ok(()) }
    }
}

/// Computes the convex pieces: merges triangles into facets, grows patches, and builds one piece
/// per patch.
fn convex_pieces(
    surface: &Surface<'_>,
    tree: &TriangleTree,
    thick: bool,
    workers: &dyn Workers,
    progress: &mut dyn FnMut(f64),
) -> Result<(Vec<Polytope>, Vec<Piece>), BodyError> {
    let facets = Facets::of(surface);
    let mut grower = Grower::new(*surface, &facets, tree);
    let patches = decompose(&mut grower, &mut |done| progress(GROUND_SHARE + (BELOW_PATHS - GROUND_SHARE) * done));
    let paths = if thick {
        let mut report = |done| progress(BELOW_PATHS + (BELOW_PIECES - BELOW_PATHS) * done);
        InwardPaths::new(surface, &facets, tree, &patches, workers, &mut report)
    } else {
        InwardPaths::default()
    };
    let build = |k: usize| {
        let inner = inner_corners(surface, &facets, tree, &paths, &patches[k]);
        build_piece(surface, &facets, &patches[k], &inner)
    };
    let pieces = map_in_order(workers, patches.len(), PIECES_PER_PART, build, &mut |done| {
        progress(BELOW_PIECES + (BELOW_HIERARCHY - BELOW_PIECES) * done);
    });
    let mut answer = (Vec::with_capacity(patches.len()), Vec::with_capacity(patches.len()));
    for (k, piece) in pieces.into_iter().enumerate() {
        let triangle = || facets.triangles(patches[k].facets[0])[0];
        let (polytope, piece) = piece.map_err(|source| BodyError::Piece { piece: k, triangle: triangle(), source })?;
        answer.0.push(polytope);
        answer.1.push(piece);
    }
    Ok(answer)
}

/// The largest allowed [`BodySettings::flatness`]. Details larger than a thousandth of the model's
/// size are real features, not rounding noise.
const LARGEST_FLATNESS: f64 = 1e-3;

/// Fractions of the work that are finished after each stage, for the progress report. The stages
/// are: mesh with edges and tree, decomposition, inward paths, pieces, hierarchy.
const GROUND_SHARE: f64 = 0.05;
const BELOW_PATHS: f64 = 0.3;
const BELOW_PIECES: f64 = 0.5;
const BELOW_HIERARCHY: f64 = 0.65;
const BELOW_FINISH: f64 = 0.99;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Provenance;

    /// Returns an L-shaped block of thickness 1.
    fn l_block() -> PolygonSoup {
        let outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
        let vertices = [0.0, 1.0].iter().flat_map(|&z| outline.map(|(x, y)| DVec3::new(x, y, z))).collect();
        let mut soup = PolygonSoup { vertices, ..PolygonSoup::new() };
        soup.push_face(&[5, 4, 3, 2, 1, 0]);
        soup.push_face(&[6, 7, 8, 9, 10, 11]);
        for k in 0..6 {
            soup.push_face(&[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k]);
        }
        soup
    }

    #[test]
    fn l_block_gives_two_pieces_outside_its_notch() {
        let mut last = 0.0;
        let settings = BodySettings { scale: 0.1, ..BodySettings::default() };
        let body = Body::from_soup(&l_block(), &settings, &mut |done| {
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
    fn a_convex_body_has_one_piece() {
        let points: Vec<DVec3> =
            (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2))).collect();
        let body = Body::from_convex(&points).unwrap();
        assert_eq!((body.polytopes().len(), body.polytopes()[0].face_count()), (1, 6));
        assert!(matches!(Body::from_convex(&points[..2]), Err(BodyError::NotConvexBody(None))));
    }

    #[test]
    fn a_nan_scale_gives_an_error() {
        let settings = BodySettings { scale: f64::NAN, ..BodySettings::default() };
        assert!(matches!(Body::from_soup(&l_block(), &settings, &mut |_| ()), Err(BodyError::Scale(_))));
    }
}
