//! Scene files in TOML: the bodies, their unit, and the contact between them. Only `unit` and the
//! two meshes are required.
//!
//! ```toml
//! unit = "mm"               # of meshes and lengths: um, mm, cm, dm, m, km, inch, ft, or metres
//! gravity = [0, 0, -9.81]   # m/s²; this is the default with free objects; otherwise zero
//!
//! [probe]                   # body a, held by the user's hand
//! mesh = "spoon.obj"        # in the folder of this file or a subfolder
//! unit = "mm"               # of this mesh only; lengths in this table use the scene's unit
//! position = [0, 0, 0]      # of the mesh's origin in the world at the start
//! orientation = [0, 0, 0, 1]   # unit quaternion x, y, z, w
//! grip = [0, 0, 0]          # point that the device moves, in the mesh's frame
//!
//! [environment]             # body b
//! mesh = "cup.obj"
//! unit = "mm"               # of this mesh only
//! position = [0, 0, 0]
//! orientation = [0, 0, 0, 1]
//!
//! [contact]
//! tolerance = 1.0           # default at most 1 mm; when coupled, it determines the contact offset
//! cluster_radius = 4.0      # default 4 mm; for linkage and for the range of friction
//! clustering = "smooth"     # continuous forces; or "linkage", the paper's method
//! split_angle = 130         # degrees, or false for no splitting; for linkage
//! stiffness = 800           # N/m; default: largest force / (contact offset / 2); direct: 800
//! damping = 0               # N·s/m
//! # default: no friction; stiffness in N/m, default: contact stiffness
//! friction = { static = 0.4, dynamic = 0.3, stiffness = 800 }
//! # rubber, wood, steel, or { frequency, decay, gain } in Hz, 1/s, N·s/m; default: none
//! material = "wood"
//! shading = true            # default false
//! crease_angle = 40         # degrees; sharper edges are not smoothed
//! shading_limit = 45        # degrees; largest rotation of a force by shading
//! time_budget = 300         # µs for a step; default: 0.6 of the period
//!
//! [coupling]
//! mode = "coupled"          # or "direct"
//! stiffness = 800           # N/m; defaults are computed from the device
//! damping = 2               # N·s/m
//! angular_stiffness = 2     # N·m/rad
//! angular_damping = 0.005   # N·m·s/rad
//! contact_offset = 0.1      # largest separation with a force
//! mass = 0                  # kg, of the probe; 0: the probe is in force equilibrium
//!
//! [device]
//! force_limit = 8.5         # N
//! torque_limit = 0.188      # N·m
//! saturation = "separate"   # or "joint", or "under-actuated": forces only (three axes)
//! rate = 1000               # Hz
//!
//! [hand]
//! preset = "normal"         # or relaxed, firm, tight, none
//! path = "stir.csv"         # poses half a second apart, or a recorded motion (`crate::hand`)
//! path_scale = 1            # factor of the translations of a recorded motion
//! path_speed = 1            # factor of the speed
//! tremor = 0                # amplitude, a length
//! seed = 1
//!
//! [second]                  # another tool, in another hand; other tables apply to both
//! mesh = "lid.obj"
//! position = [0, 0, 50]     # and orientation, grip, unit, as in [probe]
//!
//! [second.hand]             # same keys as [hand]
//! preset = "firm"
//!
//! [[object]]                # any number of objects, which no hand holds
//! mesh = "nut.obj"
//! position = [20, 0, 0]     # and orientation, unit, as in [probe]
//! motion = "free"           # it falls, slides and can be pushed; or "driven", "fixed"
//! density = 7800            # kg/m³, for "free", default 1000; or mass, in kg
//!
//! [[object]]
//! mesh = "belt.obj"
//! motion = "driven"         # it moves at this velocity and ignores contact
//! velocity = [200, 0, 0]    # lengths per second, of the origin of its frame
//! angular_velocity = [0, 0, 0]   # rad/s
//! ```
//!
//! Instead of `[probe]`, `[second]` and `[hand]`, a scene may have any number of tools. Each tool
//! has its own hand and its own device:
//!
//! ```toml
//! [[tool]]                  # the first replaces [probe], the second [second]
//! mesh = "lid.obj"          # and position, orientation, grip, unit, as in [probe]
//! hand = { preset = "firm" }            # same keys as [hand]
//! coupling = { stiffness = 500 }        # overrides [coupling]
//! device = { force_limit = 3.0 }        # overrides [device]; without rate
//! ```
//!
//! 1. The text is parsed with the location of every key and value, so that each error names the
//!    line and the column.
//! 2. An unknown key is an error that suggests the nearest valid key. If a misspelled key were
//!    ignored, the scene would feel different without any message.
//! 3. Lengths are multiplied by the unit, and degrees are converted to radians. Results are in SI
//!    units. The coordinates of a mesh must be multiplied by its [`SceneBody::metres_per_unit`].
//! 4. Files that a scene refers to must be in its folder or a subfolder, also after symbolic links
//!    are resolved, so that a downloaded scene cannot make the program read other files. The caller
//!    can allow other files by [`FilePolicy::Anywhere`].

mod coupling;
mod keys;
mod likely_unit;
mod objects;
mod open;
mod read;
mod unit;

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::body::Body;
use palpus::render::{Limits, Object, Saturation, Settings};
use serde::{Deserialize, Serialize};

pub use keys::similar_name;
pub use likely_unit::LikelyUnit;
pub use open::{OpenError, SceneWorld};
pub use read::{parse_scene, read_scene};
pub use unit::metres;

/// A scene, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// Text of the file, as read.
    pub text: String,
    /// Length of one unit of the scene's lengths in metres; also used for meshes without a separate
    /// unit.
    pub metres_per_unit: f64,
    /// Body a, the probe.
    pub probe: SceneBody,
    /// Body b, the environment.
    pub environment: SceneBody,
    /// Settings of the engine, which [`Settings::validate`] accepts.
    pub render: Settings,
    /// Coupling between the device and the probe.
    pub coupling: SceneCoupling,
    /// Nominal rate of the loop in Hz; the default is 1000.
    pub rate_hz: f64,
    /// The simulated operator of the probe.
    pub hand: SceneHand,
    /// Missing values whose defaults depend on the meshes.
    pub gaps: SceneGaps,
    /// Tools in addition to the probe, each on a separate device.
    pub others: Vec<SceneTool>,
    /// Objects in addition to the environment.
    pub objects: Vec<SceneObject>,
    /// Gravity along the world's axes (m/s²).
    pub gravity: DVec3,
}

/// A body that no hand holds.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneObject {
    /// Mesh and start pose.
    pub body: SceneBody,
    /// How the object moves.
    pub motion: ObjectMotion,
}

/// How an object moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ObjectMotion {
    /// The object does not move.
    Fixed,
    /// The object moves with this velocity of the origin of its frame (m/s, rad/s) and ignores
    /// contact.
    Driven(Twist),
    /// The object moves by gravity, contact and friction; density in kg/m³.
    FreeOfDensity(f64),
    /// The object moves by gravity, contact and friction; mass in kg.
    FreeOfMass(f64),
}

impl ObjectMotion {
    /// Returns an object of a world with this motion. `pose` is the pose of the body's frame at the
    /// start.
    pub fn object(&self, body: Arc<Body>, pose: Pose) -> Object {
        match *self {
            Self::Fixed => Object::fixed(body, pose),
            Self::Driven(_) => Object::driven(body, pose),
            Self::FreeOfDensity(density) => Object::free(body, pose, density),
            Self::FreeOfMass(mass) => Object::free_of_mass(body, pose, mass),
        }
    }
}

/// Values that a scene file does not set and whose defaults may not suit the meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneGaps {
    /// True if the contact tolerance is missing.
    pub tolerance: bool,
    /// True if the cluster radius is missing.
    pub cluster_radius: bool,
    /// True if neither body has a position or an orientation.
    pub places: bool,
    /// True if the grip of the probe is missing.
    pub grip: bool,
}

/// A tool in addition to the probe, and its simulated operator.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneTool {
    /// Mesh and start pose.
    pub body: SceneBody,
    /// Grip in the frame of the tool's mesh (m); `None` if the file sets no grip.
    pub grip: Option<DVec3>,
    /// The simulated operator of the tool.
    pub hand: SceneHand,
    /// Coupling between the device and the tool.
    pub coupling: SceneCoupling,
    /// Largest force and torque of the device.
    pub limits: Limits,
    /// How a wrench beyond the limits is limited.
    pub saturation: Saturation,
}

/// A body of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneBody {
    /// Path of the mesh file, relative to the folder of the scene file and starting with that
    /// folder's path.
    pub mesh: PathBuf,
    /// Length of one unit of the mesh file in metres: the factor for its coordinates.
    pub metres_per_unit: f64,
    /// Pose of the body in the world at the start (m); identity if the file does not set it.
    pub pose: Pose,
}

/// Coupling between a device and its tool. The program computes the values that are `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneCoupling {
    /// How the tool follows the device.
    pub mode: CouplingMode,
    /// Stiffness (N/m).
    pub stiffness: Option<f64>,
    /// Damping (N·s/m).
    pub damping: Option<f64>,
    /// Angular stiffness (N·m/rad).
    pub angular_stiffness: Option<f64>,
    /// Angular damping (N·m·s/rad).
    pub angular_damping: Option<f64>,
    /// Contact offset: the largest separation at which a contact produces a force (m).
    #[serde(alias = "skin")]
    pub contact_offset: Option<f64>,
    /// Mass of the tool (kg); 0 for a tool without mass.
    pub mass: Option<f64>,
    /// Contact stiffness (N/m); [`SceneFile::render`] contains this value or the default.
    pub contact_stiffness: Option<f64>,
    /// Tangential stiffness of sticking contacts (N/m); also in [`SceneFile::render`].
    pub friction_stiffness: Option<f64>,
}

/// How the tool follows the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CouplingMode {
    /// Through a virtual coupling: the tool is a separate body.
    #[default]
    Coupled,
    /// The tool is rigidly attached to the device, as in the paper.
    Direct,
}

/// A simulated operator.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneHand {
    /// Grip of the operator.
    pub preset: HandPreset,
    /// File with the motion of the hand ([`crate::read_hand`]), with the folder of the scene file;
    /// `None` for the built-in motion of the scene. Poses without times are in the scene's unit:
    /// multiply their translations by [`SceneFile::metres_per_unit`].
    pub path: Option<PathBuf>,
    /// Factor of the translations of a recorded hand motion.
    pub path_scale: Option<f64>,
    /// Factor of the speed of a recorded hand motion.
    pub path_speed: Option<f64>,
    /// Amplitude of the tremor (m); 0 for no tremor.
    pub tremor: f64,
    /// Seed of the tremor.
    pub seed: u32,
}

/// Grip of a simulated operator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HandPreset {
    /// A loosely held stylus.
    Relaxed,
    /// The usual grip.
    #[default]
    Normal,
    /// A firm grip.
    Firm,
    /// The tightest grip.
    Tight,
    /// No hand: the worst case for stability.
    None,
}

impl HandPreset {
    /// Returns the name in a scene file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Relaxed => "relaxed",
            Self::Normal => "normal",
            Self::Firm => "firm",
            Self::Tight => "tight",
            Self::None => "none",
        }
    }
}

/// The files that a scene may refer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePolicy {
    /// Only files in the folder of the scene file and its subfolders.
    Inside,
    /// Any file, because the user allowed it.
    Anywhere,
}

/// Why a scene file cannot be read.
///
/// Displayed for example as `cup.toml, line 9, column 1: [contact] has no key "tolerence"; did you
/// mean "tolerance"? (…)`.
#[derive(Debug, thiserror::Error)]
#[error("{file}{}: {problem}", place(*.line, *.column))]
pub struct SceneError {
    /// Name of the file, as given by the caller.
    pub file: String,
    /// Line, counted from 1; 0 if the error concerns the whole file.
    pub line: usize,
    /// Column in characters, counted from 1; 0 if the line is 0.
    pub column: usize,
    /// The problem, and how to fix it.
    pub problem: String,
}

fn place(line: usize, column: usize) -> String {
    if line == 0 { String::new() } else { format!(", line {line}, column {column}") }
}
