//! Bytes to values and back: meshes, scenes, recordings.
