//! Meshes as code, in metres.
//!
//! Each function answers a triangle soup that is closed, manifold, oriented outward and free of self-intersection, with
//! a stated number of triangles. Each shape's doc says where its frame lies; a shape that is held has its origin where
//! the hand grips it.

mod cup;
mod groove;
mod intestine;
mod peg_hole;
mod primitive;
mod rails;
mod scan;
mod skin;
#[cfg(test)]
mod soundness;
mod spoon;
mod thread;
mod torus;

pub use cup::{CUP_FLOOR, CUP_HEIGHT, cup, cup_inner_radius};
pub use groove::{GROOVE_DEPTH, v_groove};
pub use intestine::{CenterLine, LUMEN_RADIUS, intestine};
pub use peg_hole::{DEFAULT_CLEARANCE, PEG_RADIUS, PEG_TIP, hole_block, peg};
pub use primitive::{PEN_TIP, cuboid, pen, sphere, table};
pub use rails::{KNIFE_DEPTH, knife, rails, rails_half_gap};
pub use scan::scanned_torus;
pub use spoon::{SPOON_TIP, spoon};
pub use thread::{BOLT_LENGTH, NUT_GRIP, THREAD_CLEARANCE, THREAD_PITCH, bolt, nut};
pub use torus::{TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS, torus};
