//! Builds the convex piece of a patch, which collision detection uses \[K02 §3.2, §3.4\].
//!
//! 1. Compute the hull of the patch's vertices. The hull of a flat patch is a plate whose front
//!    faces outward.
//! 2. Find which facets of the patch cover which faces of the hull. A part of a facet covers a face
//!    if it lies in the face's plane and within the face's sides.
//! 3. Tag a face as original if facets cover at least half of its area, else as virtual. A face may
//!    be partly covered, because the hull can bridge a gap between coplanar facets. With a limit of
//!    one half, the tag is correct for the larger part of the face.

pub(super) mod admissible;
pub(super) mod deviation;

use glam::DVec3;

use super::decompose::Patch;
use super::{Hull, HullError, Polytope, Provenance, convex_hull, convex_polygon};
use crate::algebra::Plane;
use crate::algebra::tolerance::{COVERED_HALF, FLAT_PATCH, FOLDED, ON_FACE};
use crate::body::decompose::facet::{Facets, NONE, Surface};

/// The mesh triangles of a convex piece.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Three lists in one: the triangles of the patch, the start of each face's triangles (one
    /// entry more than faces), and the triangles of the faces. One list saves memory, because a
    /// body can have hundreds of thousands of pieces.
    all: Box<[u32]>,
    face_starts: u32,
    face_triangles: u32,
}

impl Piece {
    /// Creates a piece over `triangles`. The triangles `face_triangles[face_starts[f] ..
    /// face_starts[f + 1]]` lie in face `f`. This function does not check its arguments;
    /// [`Body::restore`](super::Body::restore) does.
    pub fn from_parts(triangles: &[u32], face_starts: &[u32], face_triangles: &[u32]) -> Self {
        let starts = triangles.len() as u32;
        let all = [triangles, face_starts, face_triangles].concat().into_boxed_slice();
        Self { all, face_starts: starts, face_triangles: starts + face_starts.len() as u32 }
    }

    /// Returns true if the lists are valid for a polytope of `face_count` faces.
    pub(super) fn fits(&self, face_count: usize) -> bool {
        let (starts, held) = (self.face_starts(), self.all_face_triangles());
        starts.len() == face_count + 1
            && starts[0] == 0
            && starts.is_sorted()
            && starts[face_count] as usize == held.len()
            && held.iter().all(|t| self.triangles().binary_search(t).is_ok())
    }

    /// Returns the mesh triangles of the piece's patch, in ascending order. Each triangle of a mesh
    /// belongs to exactly one piece.
    pub fn triangles(&self) -> &[u32] {
        &self.all[..self.face_starts as usize]
    }

    /// Returns the mesh triangles of the patch that lie in face `f` of the piece's polytope. The
    /// list is empty if no part of the face is on the surface.
    pub fn face_triangles(&self, f: u32) -> &[u32] {
        let starts = self.face_starts();
        &self.all_face_triangles()[starts[f as usize] as usize..starts[f as usize + 1] as usize]
    }

    fn face_starts(&self) -> &[u32] {
        &self.all[self.face_starts as usize..self.face_triangles as usize]
    }

    fn all_face_triangles(&self) -> &[u32] {
        &self.all[self.face_triangles as usize..]
    }

    /// Returns true if every triangle of the patch lies in some face.
    fn holds_all(&self) -> bool {
        let mut held = self.all_face_triangles().to_vec();
        held.sort_unstable();
        held.dedup();
        held == self.triangles()
    }
}

/// Builds the polytope over a patch and its inner corners (see `thicken`), and finds its mesh
/// triangles.
///
/// If the hull with the inner corners cannot be built, or if a facet does not lie on this hull, the
/// function builds the piece without inner corners.
pub(crate) fn build_piece(
    surface: &Surface<'_>,
    facets: &Facets,
    patch: &Patch,
    inner: &[DVec3],
) -> Result<(Polytope, Piece), HullError> {
    let thick = if inner.is_empty() { None } else { hull_and_ties(surface, facets, patch, inner).ok() };
    if let Some(thick) = thick.filter(|(_, piece)| piece.holds_all()) {
        return Ok(thick);
    }
    hull_and_ties(surface, facets, patch, &[])
}

fn hull_and_ties(
    surface: &Surface<'_>,
    facets: &Facets,
    patch: &Patch,
    inner: &[DVec3],
) -> Result<(Polytope, Piece), HullError> {
    let mut corners: Vec<u32> = patch.facets.iter().flat_map(|&f| facets.corners(f)).copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let mut points: Vec<DVec3> = corners.iter().map(|&v| surface.vertex(v)).collect();
    points.extend_from_slice(inner);
    let outward = patch.facets.iter().map(|&f| facets.area(f) * facets.plane(f).normal).sum();
    let (polytope, inputs) = hull_of_patch(&points, outward, surface.noise())?;
    let mut vertex_of = vec![NONE; points.len()];
    for (v, &input) in inputs.iter().enumerate() {
        vertex_of[input as usize] = v as u32;
    }
    let covers = lay_facets(surface, facets, patch, &polytope, &|corner| {
        let v = vertex_of[corners.binary_search(&corner).ok()?];
        (v != NONE).then_some(v)
    });
    let mut covered = vec![0.0; polytope.face_count()];
    for cover in &covers {
        covered[cover.face as usize] += cover.area;
    }
    let polytope = polytope.with_provenance(|polytope, f| {
        let real = covered[f as usize] >= COVERED_HALF * face_area(polytope, f);
        if real { Provenance::Original } else { Provenance::Virtual }
    });
    let piece = tie(facets, patch, &covers, polytope.face_count());
    Ok((polytope, piece))
}

/// Computes the hull of a patch's vertices. If the vertices are nearly coplanar, the result is a
/// plate whose front is on the side of `outward`.
fn hull_of_patch(points: &[DVec3], outward: DVec3, noise: f64) -> Result<(Polytope, Vec<u32>), HullError> {
    let up = outward.normalize_or_zero();
    let (low, high) = points
        .iter()
        .map(|p| up.dot(*p))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
    let thin = high - low <= FLAT_PATCH * noise;
    // A thin triangle may be narrower than the tolerance, and its hull then has no area. In this
    // case, try again with exact signs.
    for coplanar in [if thin { FLAT_PATCH * noise } else { noise }, 0.0] {
        let hull = match convex_hull(points, coplanar)? {
            Hull::Polygon { .. } => convex_polygon(points, outward, coplanar)?,
            hull => hull,
        };
        if let Some(answer) = hull.into_polytope() {
            return Ok(answer);
        }
    }
    Err(HullError::Inconsistent)
}

/// The part of a facet that covers a face; `area` in m².
struct Cover {
    face: u32,
    facet: u32,
    area: f64,
}

/// Finds which facets cover which faces. `vertex_of` returns the polytope's vertex at a mesh
/// vertex.
fn lay_facets(
    surface: &Surface<'_>,
    facets: &Facets,
    patch: &Patch,
    polytope: &Polytope,
    vertex_of: &dyn Fn(u32) -> Option<u32>,
) -> Vec<Cover> {
    let tolerance = ON_FACE * surface.noise();
    let mut covers = Vec::new();
    let mut faces: Vec<u32> = Vec::new();
    let mut polygon: Vec<DVec3> = Vec::new();
    for &facet in &patch.facets {
        // If corners of the facet are hull vertices, the facet can cover only faces at these
        // corners. Otherwise all faces are tested.
        faces.clear();
        let corners = facets.corners(facet).iter();
        faces.extend(corners.filter_map(|&v| vertex_of(v)).flat_map(|v| polytope.ring(v)).map(|spoke| spoke.left));
        if faces.is_empty() {
            faces.extend(0..polytope.face_count() as u32);
        }
        faces.sort_unstable();
        faces.dedup();
        for &face in &faces {
            let plane = polytope.plane(face);
            let cosine = plane.normal.dot(facets.plane(facet).normal);
            // A facet of a sheet covers both faces of its plate.
            let cosine = if surface.is_sheet(facets.triangles(facet)[0]) { cosine.abs() } else { cosine };
            if polytope.is_rim(face) || cosine < FOLDED {
                continue;
            }
            polygon.clear();
            polygon.extend(facets.corners(facet).iter().map(|&v| surface.vertex(v)));
            clip_to_face(&mut polygon, polytope, face);
            if polygon.len() >= 3 && polygon.iter().all(|p| plane.height(*p).abs() <= tolerance) {
                covers.push(Cover { face, facet, area: polygon_area(&polygon, plane.normal) });
            }
        }
    }
    covers
}

/// Clips a polygon to the prism over a face.
pub(super) fn clip_to_face(polygon: &mut Vec<DVec3>, polytope: &Polytope, face: u32) {
    let corners = polytope.face_vertices(face);
    let normal = polytope.plane(face).normal;
    for (k, tail) in corners.iter().enumerate() {
        let (tail, head) = (polytope.vertex(tail), polytope.vertex(corners.at((k + 1) % corners.len())));
        let outward = (head - tail).cross(normal);
        let side = Plane { normal: outward, offset: outward.dot(tail) };
        if polygon.iter().all(|p| side.height(*p) <= 0.0) {
            continue;
        }
        let whole = std::mem::take(polygon);
        for (i, &p) in whole.iter().enumerate() {
            let q = whole[(i + 1) % whole.len()];
            let (hp, hq) = (side.height(p), side.height(q));
            if hp <= 0.0 {
                polygon.push(p);
            }
            if (hp <= 0.0) != (hq <= 0.0) {
                polygon.push(p + (q - p) * (hp / (hp - hq)));
            }
        }
    }
}

pub(super) fn polygon_area(polygon: &[DVec3], normal: DVec3) -> f64 {
    let fan = polygon.windows(2).skip(1).map(|pair| (pair[0] - polygon[0]).cross(pair[1] - polygon[0]));
    0.5 * fan.sum::<DVec3>().dot(normal).abs()
}

/// Returns the area of face `f` (m²).
pub(super) fn face_area(polytope: &Polytope, f: u32) -> f64 {
    let corners: Vec<DVec3> = polytope.face_vertices(f).iter().map(|v| polytope.vertex(v)).collect();
    polygon_area(&corners, polytope.plane(f).normal)
}

/// Collects the triangles of the patch and of each face.
fn tie(facets: &Facets, patch: &Patch, covers: &[Cover], face_count: usize) -> Piece {
    let mut triangles: Vec<u32> = patch.facets.iter().flat_map(|&f| facets.triangles(f)).copied().collect();
    triangles.sort_unstable();
    let (mut face_starts, mut face_triangles) = (vec![0], Vec::with_capacity(triangles.len()));
    let mut by_face: Vec<(u32, u32)> = covers.iter().map(|cover| (cover.face, cover.facet)).collect();
    by_face.sort_unstable();
    let mut next = by_face.into_iter().peekable();
    for f in 0..face_count as u32 {
        while let Some((_, facet)) = next.next_if(|&(face, _)| face == f) {
            face_triangles.extend_from_slice(facets.triangles(facet));
        }
        face_starts.push(face_triangles.len() as u32);
    }
    Piece::from_parts(&triangles, &face_starts, &face_triangles)
}
