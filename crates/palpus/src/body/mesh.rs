//! Builds a validated triangle mesh from a polygon soup.
//!
//! 1. Reject invalid input: coordinates that are not finite or too large, indices out of range, or
//!    no faces.
//! 2. Weld vertices that are closer than [`tolerance::WELD`]. If neighbouring corners of a face
//!    become equal, keep one of them.
//! 3. Cut polygons into triangles by ear clipping.
//! 4. Drop duplicate triangles. Replace caps by cutting their neighbours; a cap is a triangle
//!    without area whose middle corner lies on its longest side. Drop all other triangles without
//!    area.
//! 5. Split the mesh into components. Flip triangles until the orientations within each component
//!    agree. Flip closed components that are inside out.
//!
//! [`Cleaning`] counts each of these changes. A vertex moves only if it is welded onto another
//! vertex.

pub(super) mod edge_uses;
pub(super) mod half_edge;
pub(super) mod health;
pub(super) mod orient;
pub(super) mod shading_normals;
mod sheet;
pub(super) mod soup;
pub(super) mod triangle_pair;
pub(super) mod triangle_tree;
pub(super) mod triangulate;
pub(super) mod weld;

use glam::DVec3;

use super::{Aabb, PolygonSoup, TriangleTree};
use crate::algebra::tolerance;
use orient::{Orientation, orient};
use triangulate::{Cut, triangulate};
use weld::{drop_duplicates, drop_empty, unbend_caps, weld};

/// The reason why a mesh cannot be built from a soup.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a finite number: {position}")]
    NotFinite {
        /// Index of the vertex, counted from 0.
        vertex: usize,
        /// Coordinates of the vertex, in model units.
        position: DVec3,
    },
    /// A coordinate is larger than [`tolerance::LARGEST_COORDINATE`].
    #[error("vertex {vertex} is too far from the origin: {position}")]
    TooFar {
        /// Index of the vertex, counted from 0.
        vertex: usize,
        /// Coordinates of the vertex, in model units.
        position: DVec3,
    },
    /// The bounding box of all vertices that faces use is smaller than
    /// [`tolerance::SMALLEST_EXTENT`].
    #[error("the model is too small: its largest extent is {extent:e} units")]
    TooSmall {
        /// Longest side of the bounding box, in model units.
        extent: f64,
    },
    /// A face uses a vertex that does not exist.
    #[error("face {face} names vertex {index}, but there are only {vertices} vertices, counted from 0")]
    IndexOutOfRange {
        /// Index of the face, counted from 0.
        face: usize,
        /// Index of the vertex, counted from 0.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// The list of face starts does not increase from 0 to the number of face vertices.
    #[error("the face list is broken at face {face}")]
    BrokenFaces {
        /// Index of the face, counted from 0.
        face: usize,
    },
    /// There is no face.
    #[error("the model has no faces")]
    Empty,
    /// There are faces, but every face has zero area.
    #[error("all {faces} faces have zero area")]
    NoArea {
        /// Number of faces.
        faces: usize,
    },
    /// There are more vertices or face corners than 32-bit indices of triangle sides can address.
    #[error("the model has too many vertices or face corners: {count}")]
    TooMany {
        /// The count that is too large.
        count: usize,
    },
}

/// Counts of the changes that [`Mesh::from_soup`] made to a soup.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cleaning {
    /// Number of vertices that were welded onto an earlier vertex.
    pub welded_vertices: usize,
    /// Number of vertices that no remaining triangle uses.
    pub unused_vertices: usize,
    /// Number of polygons, including triangles, that were dropped because they have no area or
    /// fewer than three different corners.
    pub degenerate_faces: usize,
    /// Number of polygons that cross themselves. These polygons are cut into triangles, but the
    /// triangles cover no well-defined region.
    pub self_crossing_faces: usize,
    /// Number of triangles that were dropped because an earlier triangle has the same three
    /// corners.
    pub duplicate_triangles: usize,
    /// Number of triangles without area that were removed by cutting a neighbour in two. The
    /// removal opens no gap.
    pub exchanged_triangles: usize,
    /// Number of triangles that were dropped because they have no area.
    pub empty_triangles: usize,
    /// Number of triangles that were flipped to agree with the other triangles of their component.
    pub turned_triangles: usize,
    /// Number of closed components that were inside out. All their triangles were flipped.
    pub inverted_components: usize,
    /// Number of components whose orientations cannot agree, such as a Möbius band.
    pub one_sided_components: usize,
}

/// A triangle mesh. Every triangle has a positive area, and no two triangles have the same three
/// corners. The normals of closed components point out of the solid. On the wall of a cavity, they
/// point into the cavity. A mesh may be open, non-manifold or self-intersecting;
/// [`Health`](super::Health) lists these defects.
#[derive(Clone, Debug)]
pub struct Mesh {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    component: Vec<u32>,
    component_closed: Vec<bool>,
    component_sheet: Vec<bool>,
    closed: bool,
    bounds: Aabb,
}

impl Mesh {
    /// Builds a mesh from a soup; see the module's description. The remaining vertices and
    /// triangles keep the order of the file.
    ///
    /// # Errors
    /// Fails if the soup is invalid, or if no triangle has an area (see [`MeshError`]).
    pub fn from_soup(soup: &PolygonSoup) -> Result<(Self, Cleaning), MeshError> {
        let used = validate(soup)?;
        let mut cleaning = Cleaning::default();
        let welded = weld(&soup.vertices, &used);
        cleaning.welded_vertices = welded.iter().zip(0..).filter(|&(&first, v)| first != v).count();
        let mut triangles = cut_faces(soup, &welded, &mut cleaning);
        cleaning.duplicate_triangles = drop_duplicates(&mut triangles);
        cleaning.exchanged_triangles = unbend_caps(&soup.vertices, &mut triangles);
        cleaning.empty_triangles = drop_empty(&soup.vertices, &mut triangles);
        if cleaning.exchanged_triangles > 0 {
            cleaning.duplicate_triangles += drop_duplicates(&mut triangles);
        }
        if triangles.is_empty() {
            return Err(MeshError::NoArea { faces: soup.face_count() });
        }
        let vertices = compact(&soup.vertices, &mut triangles);
        cleaning.unused_vertices = soup.vertices.len() - cleaning.welded_vertices - vertices.len();
        let Orientation { component, closed, sheet, balanced, turned, inverted, one_sided } =
            orient(&vertices, &mut triangles);
        cleaning.turned_triangles = turned;
        cleaning.inverted_components = inverted;
        cleaning.one_sided_components = one_sided;
        let bounds = Aabb::around(vertices.iter().copied());
        let (component_closed, component_sheet) = (closed, sheet);
        let mesh = Self { vertices, triangles, component, component_closed, component_sheet, closed: balanced, bounds };
        Ok((mesh, cleaning))
    }

    /// Returns this mesh with all coordinates multiplied by `factor`, which must be positive.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        for vertex in &mut self.vertices {
            *vertex *= factor;
        }
        self.bounds = Aabb::around(self.vertices.iter().copied());
        self
    }

    /// Returns all vertices. Each vertex belongs to a triangle.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Returns the vertex indices of each triangle, counter-clockwise as seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns the component of triangle `t`. Two triangles are connected if they share an
    /// edge that no other triangle uses.
    pub fn component(&self, t: u32) -> u32 {
        self.component[t as usize]
    }

    /// Returns the number of components.
    pub fn component_count(&self) -> usize {
        self.component_closed.len()
    }

    /// Returns true if component `c` has no boundary and its triangles agree on which side is
    /// outside.
    pub fn is_component_closed(&self, c: u32) -> bool {
        self.component_closed[c as usize]
    }

    /// Returns true if the component of triangle `t` is a sheet: an open surface whose both sides
    /// can be touched, because one of its openings is wide. A component with small holes alone,
    /// such as a scan with a few missing triangles, is not a sheet.
    pub fn is_sheet(&self, t: u32) -> bool {
        self.component_sheet[self.component[t as usize] as usize]
    }

    /// Returns true if each edge is used equally often in both directions. The surface then has no
    /// boundary, and winding numbers are integers.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Returns the bounding box of all vertices.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Returns the length of the bounding box's diagonal. Tolerances are relative to this size.
    pub fn bounding_diagonal(&self) -> f64 {
        self.bounds.diagonal()
    }

    /// Returns the corner points of triangle `t`.
    #[inline]
    pub fn triangle_points(&self, t: u32) -> [DVec3; 3] {
        self.triangles[t as usize].map(|v| self.vertices[v as usize])
    }

    /// Returns the outward unit normal of triangle `t`.
    pub fn triangle_normal(&self, t: u32) -> DVec3 {
        // The sides are scaled first. Otherwise the product of two short sides could underflow.
        let (area, scale) = self.scaled_area(t);
        if scale > 0.0 { area.normalize_or_zero() } else { DVec3::ZERO }
    }

    /// Returns the area of triangle `t`.
    pub fn triangle_area(&self, t: u32) -> f64 {
        let (area, scale) = self.scaled_area(t);
        0.5 * area.length() * scale * scale
    }

    /// Returns the centroid of triangle `t`.
    pub fn triangle_centroid(&self, t: u32) -> DVec3 {
        let [a, b, c] = self.triangle_points(t);
        a + ((b - a) + (c - a)) / 3.0
    }

    /// Returns the longest side `k` of triangle `t`, which runs from corner `k` to corner `k + 1`.
    /// If several sides are equally long, returns the first.
    pub fn longest_side(&self, t: u32) -> usize {
        let p = self.triangle_points(t);
        let squared = |k: usize| p[k].distance_squared(p[(k + 1) % 3]);
        let best = usize::from(squared(1) > squared(0));
        if squared(2) > squared(best) { 2 } else { best }
    }

    /// Divides the two shorter sides by a scale, and returns their cross product and the scale. The
    /// two shorter sides give the smallest rounding error. The scale is the largest coordinate
    /// difference of these sides.
    fn scaled_area(&self, t: u32) -> (DVec3, f64) {
        let p = self.triangle_points(t);
        let k = self.longest_side(t);
        let apex = p[(k + 2) % 3];
        let (to_first, to_second) = (p[k] - apex, p[(k + 1) % 3] - apex);
        let scale = to_first.abs().max_element().max(to_second.abs().max_element());
        ((to_first / scale).cross(to_second / scale), scale)
    }

    /// Builds the bounding-volume tree over the triangles.
    pub fn tree(&self) -> TriangleTree {
        let ids = (0..self.triangles.len() as u32).collect();
        TriangleTree::over(&self.vertices, &self.triangles, ids, self.is_closed())
    }
}

/// Checks the conditions that the later steps need. Returns for each vertex whether a face uses it.
fn validate(soup: &PolygonSoup) -> Result<Vec<bool>, MeshError> {
    let largest = u32::MAX as usize / 3;
    for count in [soup.vertices.len(), soup.face_vertices.len()] {
        if count >= largest {
            return Err(MeshError::TooMany { count });
        }
    }
    for (vertex, &position) in soup.vertices.iter().enumerate() {
        if !position.is_finite() {
            return Err(MeshError::NotFinite { vertex, position });
        }
        if position.abs().max_element() > tolerance::LARGEST_COORDINATE {
            return Err(MeshError::TooFar { vertex, position });
        }
    }
    if soup.face_count() == 0 {
        return Err(MeshError::Empty);
    }
    let ends = (soup.face_starts.first(), soup.face_starts.last());
    if ends != (Some(&0), Some(&(soup.face_vertices.len() as u32))) {
        return Err(MeshError::BrokenFaces { face: 0 });
    }
    let mut used = vec![false; soup.vertices.len()];
    for (face, range) in soup.face_starts.windows(2).enumerate() {
        if range[1] < range[0] || range[1] as usize > soup.face_vertices.len() {
            return Err(MeshError::BrokenFaces { face });
        }
        for &index in soup.face(face) {
            let vertices = soup.vertices.len();
            *used.get_mut(index as usize).ok_or(MeshError::IndexOutOfRange { face, index, vertices })? = true;
        }
    }
    let bounds = Aabb::around(soup.vertices.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p));
    let extent = (bounds.max - bounds.min).max_element();
    if extent < tolerance::SMALLEST_EXTENT {
        return Err(if extent > 0.0 {
            MeshError::TooSmall { extent }
        } else {
            MeshError::NoArea { faces: soup.face_count() }
        });
    }
    Ok(used)
}

/// Cuts all faces over the welded vertices into triangles.
fn cut_faces(soup: &PolygonSoup, welded: &[u32], cleaning: &mut Cleaning) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(soup.face_count());
    let mut polygon = Vec::new();
    for face in 0..soup.face_count() {
        polygon.clear();
        polygon.extend(soup.face(face).iter().map(|&v| welded[v as usize]));
        polygon.dedup();
        while polygon.len() > 1 && polygon.first() == polygon.last() {
            polygon.pop();
        }
        let first = triangles.len();
        match triangulate(&soup.vertices, &polygon, &mut triangles) {
            Cut::Whole => {}
            Cut::SelfCrossing => cleaning.self_crossing_faces += 1,
            Cut::Degenerate => cleaning.degenerate_faces += 1,
        }
        // If a polygon uses a vertex twice, one of its triangles may use the vertex twice too.
        let mut kept = first;
        for t in first..triangles.len() {
            let [a, b, c] = triangles[t];
            if a != b && b != c && c != a {
                triangles[kept] = triangles[t];
                kept += 1;
            }
        }
        triangles.truncate(kept);
    }
    triangles
}

/// Returns the vertices that `triangles` use, in their old order. Changes the vertex indices of the
/// triangles to the new list.
fn compact(vertices: &[DVec3], triangles: &mut [[u32; 3]]) -> Vec<DVec3> {
    let mut number = vec![u32::MAX; vertices.len()];
    for &v in triangles.iter().flatten() {
        number[v as usize] = 0;
    }
    let mut answer = Vec::new();
    for (v, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
        *number = answer.len() as u32;
        answer.push(vertices[v]);
    }
    for v in triangles.iter_mut().flatten() {
        *v = number[*v as usize];
    }
    answer
}

#[cfg(test)]
mod tests;
