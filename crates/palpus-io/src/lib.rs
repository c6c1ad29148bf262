//! Bytes to values and back: meshes, scenes, recordings.

pub mod mesh;
pub use mesh::{ContentHash, MeshFileError, MeshFormat, MeshProblem, Place, read_mesh, write_obj_groups};
