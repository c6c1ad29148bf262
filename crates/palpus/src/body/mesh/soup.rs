//! The content of a mesh file before validation.

use glam::DVec3;

/// Polygons over a list of vertices, as read from a file. The readers check that indices are in
/// range and that coordinates are finite, because they know the line number of an error. The
/// readers check nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolygonSoup {
    /// Positions in model units.
    pub vertices: Vec<DVec3>,
    /// Face `f` uses `face_vertices[face_starts[f]..face_starts[f + 1]]`. The list has one entry
    /// more than there are faces.
    pub face_starts: Vec<u32>,
    /// Vertex indices of all faces, one face after the other. The corners of each face are
    /// counter-clockwise as seen from outside.
    pub face_vertices: Vec<u32>,
}

impl PolygonSoup {
    /// Creates a soup without vertices and faces.
    pub fn new() -> Self {
        Self { vertices: Vec::new(), face_starts: vec![0], face_vertices: Vec::new() }
    }

    /// Creates a soup of triangles.
    pub fn from_triangles(vertices: Vec<DVec3>, triangles: &[[u32; 3]]) -> Self {
        let mut soup = Self { vertices, face_starts: vec![0], face_vertices: Vec::with_capacity(3 * triangles.len()) };
        for triangle in triangles {
            soup.push_face(triangle);
        }
        soup
    }

    /// Appends a face with these vertex indices.
    pub fn push_face(&mut self, vertices: &[u32]) {
        if self.face_starts.is_empty() {
            self.face_starts.push(0);
        }
        self.face_vertices.extend_from_slice(vertices);
        self.face_starts.push(self.face_vertices.len() as u32);
    }

    /// Returns the number of faces.
    pub fn face_count(&self) -> usize {
        self.face_starts.len().saturating_sub(1)
    }

    /// Returns the vertex indices of face `f`.
    pub fn face(&self, f: usize) -> &[u32] {
        &self.face_vertices[self.face_starts[f] as usize..self.face_starts[f + 1] as usize]
    }
}
