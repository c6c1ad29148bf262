//! The unchecked content of a mesh file.

use glam::DVec3;

/// Polygons over a list of vertices, as read from a file: the readers check only that indices are
/// in range and coordinates are finite, since they know the line of an error. Everything else may
/// be wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PolygonSoup {
    /// In model units.
    pub vertices: Vec<DVec3>,
    /// Face `f` uses `face_vertices[face_starts[f]..face_starts[f + 1]]`; one longer than the
    /// number of faces.
    pub face_starts: Vec<u32>,
    /// Vertex indices of all faces one after the other, each loop counter-clockwise seen from
    /// outside.
    pub face_vertices: Vec<u32>,
}

impl PolygonSoup {
    /// A soup without vertices or faces.
    pub fn new() -> Self {
        Self { vertices: Vec::new(), face_starts: vec![0], face_vertices: Vec::new() }
    }

    /// A soup of triangles.
    pub fn from_triangles(vertices: Vec<DVec3>, triangles: &[[u32; 3]]) -> Self {
        let mut soup = Self { vertices, face_starts: vec![0], face_vertices: Vec::with_capacity(3 * triangles.len()) };
        for triangle in triangles {
            soup.push_face(triangle);
        }
        soup
    }

    /// Appends a face.
    pub fn push_face(&mut self, vertices: &[u32]) {
        if self.face_starts.is_empty() {
            self.face_starts.push(0);
        }
        self.face_vertices.extend_from_slice(vertices);
        self.face_starts.push(self.face_vertices.len() as u32);
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.face_starts.len().saturating_sub(1)
    }

    /// The vertex loop of face `f`.
    pub fn face(&self, f: usize) -> &[u32] {
        &self.face_vertices[self.face_starts[f] as usize..self.face_starts[f + 1] as usize]
    }
}
