//! palpus computes the force and torque that a hand feels when its tool touches another object.
//! Tool and object can be arbitrary triangle meshes.
//!
//! ```sh
//! # The engine; mesh and scene files; devices, the loop and the safety chain.
//! cargo add palpus palpus-io palpus-device
//! ```
//!
//! # Contacts of two meshes
//!
//! Build a [`Body`] from a mesh once. A [`ContactQuery`] then returns the contacts of two bodies at
//! any pose.
//!
//! ```
//! use std::sync::Arc;
//! use palpus::{Body, BodySettings, ContactQuery, PolygonSoup, Pose, QuerySettings, glam::DVec3};
//!
//! // Programs usually read the mesh from a file with `palpus_io::read_mesh`.
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
//! free. Each step computes the wrench that each hand should feel. (The crate `palpus-device` has
//! devices, the safety chain, and the loop that calls the step a thousand times a second.)
//!
//! ```
//! use std::sync::Arc;
//! use palpus::glam::DVec3;
//! use palpus::{Body, Limits, NoClock, Object, Pose, ProbeState, Settings, World};
//! use palpus::contact_tolerance;
//!
//! let block = |side: f64| {
//!     let ends = [-0.5 * side, 0.5 * side];
//!     let corners = ends.map(|x| ends.map(|y| ends.map(|z| DVec3::new(x, y, z))));
//!     Body::from_convex(corners.as_flattened().as_flattened()).map(Arc::new)
//! };
//! let (part, probe) = (block(0.1)?, block(0.02)?);
//! // The device gives up to 8.5 N and 0.19 N·m, at 1 kHz.
//! let tolerance = contact_tolerance(&probe, &part, &Pose::from_translation(DVec3::Z * 0.07));
//! let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, 1e-3, tolerance);
//! let mut world = World::new(settings)?;
//! world.add(Object::fixed(part, Pose::IDENTITY))?;
//! let tool = world.add_tool(probe, settings)?;
//! for tick in 0..500 {
//!     // The device moves down until the tool is 2 mm inside the block.
//!     let height = f64::max(0.07 - 1e-4 * f64::from(tick), 0.058);
//!     world.step(&[ProbeState::at(Pose::from_translation(DVec3::Z * height))], 1e-3, &NoClock);
//! }
//! let wrench = world.tick(tool).commanded;
//! println!("{} N, {} N·m", wrench.force, wrench.torque);
//! # assert!(wrench.force.z > 1.0 && wrench.force.x.abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A loop in real time passes a [`WallClock`] instead of [`NoClock`]. Each step then limits its
//! work to what fits into its time ([`WorkLimit`]). Meshes for a world are best built with the
//! flatness [`BodySettings::HAPTIC`]: bodies with curved surfaces then have fewer pieces, and steps
//! take less time.
//!
//! [`GlobalDepth`] computes the penetration depth of two meshes, with proven bounds.
//!
//! # Conventions
//!
//! The engine consists of pure functions of values. The engine has no input or output, no threads
//! and no globals. It reads no clock but the one that the caller passes to it. Units are SI
//! (metres, seconds, newtons, newton-metres, radians) unless a name says otherwise; frames are
//! right-handed. Body **a** is the probe, body **b** the environment; a contact normal has the
//! length 1 and points from body b into body a; `point_a − point_b = separation · normal`.
//!
//! With the feature `serde`, settings, poses, wrenches and contacts can be serialized.
//!
//! # The modules
//!
//! The types that most programs use are at the top of the crate. Everything else is in the
//! top-level modules. Their alphabetical order is the order of the paper's sections. A module may
//! import only modules that sort before it:
//!
//! `algebra` → `body` → `collision` → `depth` → `detect` → `force` → `render`
//!
//! The paper is Kim, Otaduy, Lin, Manocha, *Six-Degree-of-Freedom Haptic Display Using Localized
//! Contact Computations*, 2002. The documentation cites this paper as \[K02\].
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

pub use algebra::{Clock, NoClock, Pose, Twist, WallClock, Wrench};
pub use body::{Body, BodyError, BodySettings, Health, PolygonSoup};
pub use depth::{DepthBracket, GlobalDepth, GlobalMemory, GlobalSettings};
pub use detect::{Contact, ContactQuery, Proof, QuerySettings};
pub use force::{FrictionSettings, ShadingSettings};
pub use render::{
    BodyId, Limits, Object, ProbeState, Settings, SettingsError, Tick, ToolId, VirtualCoupling, WorkLimit, World,
    contact_tolerance,
};
