//! The files of `palpus query` and `palpus depth`: poses in, results and contacts out, all CSV with
//! commas and a header line.
//!
//! * Poses: `tx,ty,tz,qx,qy,qz,qw` — body a placed in b's frame, in model units.
//! * Results: [`RESULT_COLUMNS`], one line for each pose, in b's frame and model units.
//! * Contacts: [`CONTACT_COLUMNS`], one line for each contact of each pose. A feature is `v`, `e`
//!   or `f` (vertex, edge, face) and its index in the piece.
//! * Depths: [`DEPTH_COLUMNS`], one line for each pose, of `palpus depth`.
//!
//! Numbers are written with the fewest digits that read back as the same double.

mod depths;
mod poses;
mod results;

pub use depths::{DEPTH_COLUMNS, DepthWriter, containment_number};
pub use poses::{POSE_COLUMNS, pose_of, read_poses, read_poses_from};
pub use results::{CONTACT_COLUMNS, ContactWriter, QueryRow, QueryWriter, RESULT_COLUMNS};
