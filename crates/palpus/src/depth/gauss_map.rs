//! The normal cone of a vertex.
