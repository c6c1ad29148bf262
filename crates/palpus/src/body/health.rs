//! What a mesh is like: closed or open, manifold, self-intersecting, inverted.
