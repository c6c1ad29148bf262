//! A bounding-volume tree over the triangles of a mesh.
