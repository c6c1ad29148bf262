//! The paper's scenes and scripted hands as code, for display, tests and benches alike.
//!
//! * [`shape`] — meshes as code, in metres: closed, outward, manifold, free of self-intersection,
//!   the same on every call.
//! * [`HandPath`] — scripted hands: pure functions from time to the pose that a hand intends;
//!   [`Wander`] — one that never ends; [`tour`] — a path over a body of which nothing is known.
//! * [`flush`] — parts with flush faces in play, with parameters; [`overlap`] — how far two solids
//!   truly overlap.
//! * [`sweep`] — how deep a body can be felt, and how truly.
//! * [`truth`] — what contacts there truly are, where that can be said in closed form; [`refined`]
//!   — where there are several, or curved ones.
//! * [`scenes`], [`trials`], [`scene`] — a probe, an environment, how they touch and how the hand
//!   moves, by name.

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
