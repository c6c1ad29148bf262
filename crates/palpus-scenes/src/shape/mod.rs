//! Meshes as code, in metres.
//!
//! Each function returns a triangle soup that is closed, manifold, oriented outward and free of
//! self-intersection, with a stated number of triangles. The description of each shape states the
//! position of its frame. The origin of a held shape is the point at which the hand grips it.

mod ball_joint;
mod cup;
mod fit;
mod gear;
mod groove;
mod intestine;
mod peg_hole;
mod primitive;
mod rails;
mod roller;
mod scan;
mod screwdriver;
#[cfg(test)]
mod soundness;
mod spoon;
mod surface;
mod thread;
mod torus;

pub use ball_joint::{JOINT_CENTER, JOINT_RADIUS, ball_on_stem, socket};
pub use cup::{CUP_FLOOR, CUP_HEIGHT, CUP_WALL, cup, cup_inner_radius};
pub use fit::{ChannelSection, KEY_SIDE, KEY_TIP, SQUARE_PEG, along_x, channel, key, sleeve, square_peg};
pub use gear::{GEAR_BACKLASH, GEAR_PITCH_RADIUS, GEAR_TEETH, gear};
pub use groove::{GROOVE_DEPTH, v_groove};
pub use intestine::{CenterLine, GUT_WALL, LUMEN_RADIUS, intestine};
pub use peg_hole::{DEFAULT_CLEARANCE, PEG_RADIUS, PEG_TIP, hole_block, peg};
pub use primitive::{PEN_TIP, cuboid, disc, pen, sphere, table};
pub use rails::{KNIFE_DEPTH, knife, rails, rails_half_gap};
pub use roller::{KNURL_HEIGHT, ROLLER_RADIUS, knurled_roller};
pub use scan::scanned_torus;
pub use screwdriver::{BLADE_THICKNESS, SCREWDRIVER_TIP, screwdriver};
pub use spoon::{SPOON_TIP, spoon};
pub use thread::{BOLT_LENGTH, NUT_GRIP, THREAD_CLEARANCE, THREAD_PITCH, bolt, nut};
pub use torus::{TORUS_MAJOR_RADIUS, TORUS_MINOR_RADIUS, torus};
