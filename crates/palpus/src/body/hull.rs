//! Convex hulls of small, large, flat and needle-like point sets.
