//! Reads and writes files: meshes, scenes, recordings, prepared bodies, and the CSV files of
//! queries.
//!
//! Each reader returns either a checked value or an error that describes the problem, its location
//! and how to fix it. Mesh readers do not convert lengths; the scene file states their unit.

pub mod cache;
mod exact;
pub mod hand;
pub mod mesh;
mod one_line;
pub mod query;
pub mod record;
pub mod scene;
mod table;
mod threads;

pub use cache::{BodyCache, BodyKey, CacheMiss};
pub use hand::{HandFile, RecordedHand, read_hand};
pub use mesh::{
    ContentHash, MeshFileError, MeshFormat, MeshProblem, Place, read_mesh, read_mesh_from, read_mesh_noting,
    write_obj_groups,
};
pub use query::{ContactWriter, DepthWriter, QueryRow, QueryWriter, pose_of, read_poses};
pub use record::{RecordRow, Recording, RecordingHeader, RecordingWriter, read_recording};
pub use scene::{FilePolicy, OpenError, SceneError, SceneFile, SceneWorld, read_scene, similar_name};
pub use table::TableError;
pub use threads::Threads;
