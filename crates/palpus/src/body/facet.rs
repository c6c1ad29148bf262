//! Maximal convex planar polygons of coplanar triangles.
