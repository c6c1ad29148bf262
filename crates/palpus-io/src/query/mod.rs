//! The files of `palpus query` and `palpus depth`: poses are read; results, contacts and depths are
//! written. All files are CSV with commas and a header line.
//!
//! * Poses: `tx,ty,tz,qx,qy,qz,qw`, the pose of body a in body b's frame, in model units.
//! * Results: [`RESULT_COLUMNS`], one line for each pose, in b's frame and model units.
//! * Contacts: [`CONTACT_COLUMNS`], one line for each contact of each pose. A feature is written as
//!   `v`, `e` or `f` (vertex, edge, face), followed by its index in the piece.
//! * Depths: [`DEPTH_COLUMNS`], one line for each pose, written by `palpus depth`.
//!
//! Numbers are written with the fewest digits that read back as the same double.

mod depths;
mod poses;
mod results;

pub use depths::{DEPTH_COLUMNS, DepthWriter, containment_number};
pub use poses::{POSE_COLUMNS, pose_of, read_poses, read_poses_from};
pub use results::{CONTACT_COLUMNS, ContactWriter, QueryRow, QueryWriter, RESULT_COLUMNS};
