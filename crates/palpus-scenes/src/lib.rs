//! The paper's scenes and scripted hand motions as code, for display, tests and benchmarks.
//!
//! * [`shape`] — meshes as code, in metres: closed, outward, manifold, free of self-intersection,
//!   and the same on every call.
//! * [`HandPath`] — scripted hand motions: pure functions from time to the pose that the operator
//!   intends. [`Wander`] — an endless motion. [`tour`] — a path over two arbitrary bodies.
//! * [`flush`] — parts that fit into each other with flush faces. [`overlap`] — the true overlap of
//!   two solids.
//! * [`sweep`] — the depth to which contact with a body persists, and its error.
//! * [`truth`] — the true contacts of scenes in which formulas give the contacts. [`refined`] — the
//!   true contacts of scenes with several contacts or curved surfaces.
//! * [`scenes`], [`trials`], [`scene`] — the built-in scenes by name: a probe, an environment, the
//!   contact settings and the motion of the hand.

mod catalogue;
mod features;
pub mod flush;
pub mod overlap;
mod path;
pub mod refined;
mod scene;
pub mod shape;
pub mod sweep;
mod tour;
pub mod truth;

pub use catalogue::{SceneEntry, scene, scenes, trials};
pub use path::{HandPath, Key, Placement, RecordedPathError, Tremor, Wander};
pub use scene::{ContactSettings, Friction, Motion, Object, Scene, SecondTool};
pub use tour::tour;
