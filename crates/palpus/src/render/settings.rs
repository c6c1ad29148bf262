//! What a renderer is told once.
