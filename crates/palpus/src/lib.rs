//! palpus computes the force and torque that a hand feels when the tool that it holds touches
//! another object. Both may be arbitrary triangle meshes.
//!
//! ```sh
//! # The engine; mesh and scene files; devices, the loop and the safety chain.
//! cargo add palpus palpus-io palpus-device
//! ```
//!
//! # Contacts of two meshes
//!
//! A [`Body`] is made from a mesh once. A [`ContactQuery`] then returns where two bodies touch, at
//! any pose.
//!
//! ```
//! use std::sync::Arc;
//! use palpus::{Body, BodySettings, ContactQuery, PolygonSoup, Pose, QuerySettings, glam::DVec3};
//!
//! // Usually read from a file: `palpus_io::read_mesh`.
//! let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(DVec3::from_array);
//! let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
//! let soup = PolygonSoup::from_triangles(corners.to_vec(), &triangles);
//! let body = Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ())?);
//!
//! let settings = QuerySettings { tolerance: 0.01, ..QuerySettings::default() };
//! let mut query = ContactQuery::new(body.clone(), body, settings);
//! let contacts = query.contacts(&Pose::from_translation(DVec3::new(0.0, 0.0, 0.995)));
//! let deepest = contacts.iter().min_by(|x, y| x.separation.total_cmp(&y.separation)).unwrap();
//! println!("{} m apart along {}, at {}", deepest.separation, deepest.normal, deepest.point_b);
//! # assert!(deepest.separation < 0.0, "the tip is in the foot");
//! # Ok::<(), palpus::BodyError>(())
//! ```
//!
//! # The wrench of a tick
//!
//! A [`World`] has tools, which follow devices, and objects, which are fixed, driven by a host or
//! free. Its step computes what each hand shall feel. (The crate `palpus-device` has devices, the
//! safety chain, and the loop that calls the step a thousand times a second.)
//!
//! ```
//! use std::sync::Arc;
//! use palpus::{Body, Limits, NoClock, Object, Pose, ProbeState, Settings, World, glam::DVec3};
//!
//! let block = |side: f64| {
//!     let ends = [-0.5 * side, 0.5 * side];
//!     let corners = ends.map(|x| ends.map(|y| ends.map(|z| DVec3::new(x, y, z))));
//!     Body::from_convex(corners.as_flattened().as_flattened()).map(Arc::new)
//! };
//! // A device that gives 8.5 N and 0.19 N·m, at 1 kHz; contacts are looked for within 0.2 mm.
//! let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, 1e-3, 2e-4);
//! let mut world = World::new(settings)?;
//! world.add(Object::fixed(block(0.1)?, Pose::IDENTITY))?;
//! let tool = world.add_tool(block(0.02)?, settings)?;
//! for tick in 0..500 {
//!     // The device goes down, 2 mm into the block at last.
//!     let height = f64::max(0.07 - 1e-4 * f64::from(tick), 0.058);
//!     world.step(&[ProbeState::at(Pose::from_translation(DVec3::Z * height))], 1e-3, &NoClock);
//! }
//! let wrench = world.tick(tool).commanded;
//! println!("{} N, {} N·m", wrench.force, wrench.torque);
//! # assert!(wrench.force.z > 1.0 && wrench.force.x.abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`GlobalDepth`] computes how deep two meshes are in each other, with proven bounds.
//!
//! # Conventions
//!
//! The engine is a set of pure functions of values: no input or output, no thread, no clock, no
//! global. Units are SI (metres, seconds, newtons, newton-metres, radians) unless a name says
//! otherwise; frames are right-handed. Body **a** is the probe, body **b** the environment; a
//! contact normal is unit and points from b into a; `point_a − point_b = separation · normal`.
//!
//! With the feature `serde`, settings, poses, wrenches and contacts can be serialized.
//!
//! # The rooms
//!
//! The types that most programs use are at the top of the crate. Everything else is in *rooms*
//! (top-level modules). In alphabetical order they follow the paper's sections, and a room may
//! import only rooms that sort before it:
//!
//! `algebra` → `body` → `collision` → `depth` → `detect` → `force` → `render`
//!
//! Source: Kim, Otaduy, Lin, Manocha, *Six-Degree-of-Freedom Haptic Display Using Localized Contact
//! Computations*, 2002, cited as \[K02\].
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod algebra;
pub mod body;
pub mod collision;
pub mod depth;
pub mod detect;
pub mod force;
pub mod render;

pub use glam;

pub use algebra::{Clock, NoClock, Pose, Twist, Wrench};
pub use body::{Body, BodyError, BodySettings, Health, PolygonSoup};
pub use depth::{DepthBracket, GlobalDepth, GlobalMemory, GlobalSettings};
pub use detect::{Contact, ContactQuery, Proof, QuerySettings};
pub use force::{FrictionSettings, ShadingSettings};
pub use render::{BodyId, Limits, Object, ProbeState, Settings, SettingsError, Tick, ToolId, VirtualCoupling, World};
