//! Force shading.
