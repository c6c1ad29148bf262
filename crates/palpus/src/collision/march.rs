//! Voronoi marching: the distance of two convex polytopes.
