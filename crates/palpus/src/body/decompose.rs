//! Convex surface decomposition.
