//! Cutting polygons into triangles by ears.
