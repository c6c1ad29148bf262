//! Scene files: the bodies, their unit, and the contact between them, in TOML. Only `unit` and the
//! two meshes are required.
//!
//! ```toml
//! unit = "mm"               # of meshes and lengths: um, mm, cm, dm, m, km, inch, ft, or in m
//! gravity = [0, 0, -9.81]   # m/s²; the default if there are free objects, else none
//!
//! [probe]                   # body a, held in the hand
//! mesh = "spoon.obj"        # beside this file or below
//! unit = "mm"               # of this mesh alone; lengths here stay in the scene's unit
//! position = [0, 0, 0]      # where it starts: its mesh's origin in the world
//! orientation = [0, 0, 0, 1]   # unit quaternion x, y, z, w
//! grip = [0, 0, 0]          # where the hand holds it, in its mesh's frame: what a device moves
//!
//! [environment]             # body b
//! mesh = "cup.obj"
//! unit = "mm"               # likewise
//! position = [0, 0, 0]
//! orientation = [0, 0, 0, 1]
//!
//! [contact]
//! tolerance = 1.0           # else 1 mm, whatever the unit; coupled, it decides the skin
//! cluster_radius = 4.0      # else 4 mm; of linkage, and how far friction holds on
//! clustering = "smooth"     # forces that never jump when contacts meet; or "linkage", the paper's
//! split_angle = 130         # degrees, or false for no cut; of linkage
//! stiffness = 800           # N/m, as felt; else the largest force at half the skin; direct: 800
//! damping = 0               # N·s/m
//! # else none; N/m, else the contact's stiffness
//! friction = { static = 0.4, dynamic = 0.3, stiffness = 800 }
//! # rubber, wood, steel, or { frequency, decay, gain } in Hz, 1/s, N·s/m; else none
//! material = "wood"
//! shading = true            # else false
//! crease_angle = 40         # degrees: sharper edges stay sharp
//! shading_limit = 45        # degrees: the farthest that shading turns a force
//! time_budget = 300         # µs that a step should take, else 0.6 of the period
//!
//! [coupling]
//! mode = "coupled"          # or "direct"
//! stiffness = 800           # N/m; these follow from the device when left out
//! damping = 2               # N·s/m
//! angular_stiffness = 2     # N·m/rad
//! angular_damping = 0.005   # N·m·s/rad
//! skin = 0.1                # contact offset: contacts push from this separation on
//! mass = 0                  # kg, of the probe; with 0 it is where all forces balance
//!
//! [device]
//! force_limit = 8.5         # N
//! torque_limit = 0.188      # N·m
//! saturation = "separate"   # or "joint", or "under-actuated": forces only, for three driven axes
//! rate = 1000               # Hz
//!
//! [hand]
//! preset = "normal"         # or relaxed, firm, tight, none
//! path = "stir.csv"         # poses half a second apart, or a recorded hand ([`crate::hand`])
//! path_scale = 1            # of a recorded hand's way
//! path_speed = 1            # so many times as fast
//! tremor = 0                # a length
//! seed = 1
//!
//! [second]                  # another tool, in another hand; everything else holds for both
//! mesh = "lid.obj"
//! position = [0, 0, 50]     # and orientation, grip, unit, as of the probe
//!
//! [second.hand]             # as [hand]
//! preset = "firm"
//!
//! [[object]]                # any number; not held by a hand
//! mesh = "nut.obj"
//! position = [20, 0, 0]     # and orientation, unit, as of the probe
//! motion = "free"           # it falls, slides and can be pushed; or "driven", or "fixed"
//! density = 7800            # kg/m³, of a free one, else 1000; or mass, kg
//!
//! [[object]]
//! mesh = "belt.obj"
//! motion = "driven"         # it moves so, whatever touches it
//! velocity = [200, 0, 0]    # lengths per second, of its frame's origin
//! angular_velocity = [0, 0, 0]   # rad/s
//! ```
//!
//! In place of `[probe]`, `[second]` and `[hand]`, a scene may have any number of tools, each in a
//! hand and on a device of its own:
//!
//! ```toml
//! [[tool]]                  # the first is what [probe] is, the second what [second] is
//! mesh = "lid.obj"          # and position, orientation, grip, unit, as of the probe
//! hand = { preset = "firm" }            # as [hand]
//! coupling = { stiffness = 500 }        # as [coupling], which has the other values
//! device = { force_limit = 3.0 }        # as [device], likewise, without rate
//! ```
//!
//! 1. The text is parsed with the place of every key and value, so that whatever is wrong is named
//!    with line and column.
//! 2. An unknown key is an error that names the nearest valid one: a mistyped key that is ignored
//!    would change the feel without a message.
//! 3. Lengths are multiplied by the unit, degrees become radians. This is the only place where
//!    units are converted; results are SI, and meshes must be multiplied by their
//!    [`SceneBody::metres_per_unit`].
//! 4. Files that a scene names must lie in its folder or below, also behind symbolic links, unless
//!    the caller says [`FilePolicy::Anywhere`]: a scene from elsewhere must not make the program
//!    read other files.

mod coupling;
mod keys;
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
pub use open::{OpenError, SceneWorld};
pub use read::{parse_scene, read_scene};
pub use unit::metres;

/// A scene, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The file's text, as it was read.
    pub text: String,
    /// Metres for each unit of the scene's lengths, and of the meshes that have none of their own.
    pub metres_per_unit: f64,
    /// Body a.
    pub probe: SceneBody,
    /// Body b.
    pub environment: SceneBody,
    /// The engine's settings; they pass [`Settings::validate`].
    pub render: Settings,
    /// Between the device and the probe.
    pub coupling: SceneCoupling,
    /// Nominal rate of the loop, Hz; 1000 when the file doesn't say.
    pub rate_hz: f64,
    /// The simulated hand.
    pub hand: SceneHand,
    /// Values that the file leaves out and that depend on the meshes.
    pub gaps: SceneGaps,
    /// Tools beside the probe, each on a device of its own.
    pub others: Vec<SceneTool>,
    /// Objects beside the environment.
    pub objects: Vec<SceneObject>,
    /// m/s², along the world's axes.
    pub gravity: DVec3,
}

/// A body that no hand holds.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneObject {
    /// Mesh and start pose.
    pub body: SceneBody,
    /// How it moves.
    pub motion: ObjectMotion,
}

/// How an object moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ObjectMotion {
    /// Not at all.
    Fixed,
    /// With this velocity of its frame's origin, m/s and rad/s, whatever touches it.
    Driven(Twist),
    /// By gravity, contact and friction; kg/m³.
    FreeOfDensity(f64),
    /// The same; kg.
    FreeOfMass(f64),
}

impl ObjectMotion {
    /// The object of a world that moves like this; the pose is that of its frame at the start.
    pub fn object(&self, body: Arc<Body>, pose: Pose) -> Object {
        match *self {
            Self::Fixed => Object::fixed(body, pose),
            Self::Driven(_) => Object::driven(body, pose),
            Self::FreeOfDensity(density) => Object::free(body, pose, density),
            Self::FreeOfMass(mass) => Object::free_of_mass(body, pose, mass),
        }
    }
}

/// Values that a scene file leaves out: the defaults in their place may not suit the meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneGaps {
    /// The contact tolerance.
    pub tolerance: bool,
    /// The poses of the two bodies: neither has a position or an orientation.
    pub places: bool,
    /// The grip of the probe.
    pub grip: bool,
}

/// A tool beside the probe, and its hand.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneTool {
    /// Mesh and start pose.
    pub body: SceneBody,
    /// Grip, m, in the frame of its mesh; `None` if the file does not set it.
    pub grip: Option<DVec3>,
    /// The simulated hand.
    pub hand: SceneHand,
    /// Between its device and the tool.
    pub coupling: SceneCoupling,
    /// Largest force and torque of its device.
    pub limits: Limits,
    /// How a wrench beyond them is cut.
    pub saturation: Saturation,
}

/// A body of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneBody {
    /// Its mesh file, with the scene file's folder in front.
    pub mesh: PathBuf,
    /// Metres for each unit of that file: what to multiply its coordinates by.
    pub metres_per_unit: f64,
    /// Pose of the body in the world at the start, m; identity if the file states no pose.
    pub pose: Pose,
}

/// Coupling between device and probe. The program chooses values that are `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneCoupling {
    /// How the probe follows the device.
    pub mode: CouplingMode,
    /// N/m.
    pub stiffness: Option<f64>,
    /// N·s/m.
    pub damping: Option<f64>,
    /// N·m/rad.
    pub angular_stiffness: Option<f64>,
    /// N·m·s/rad.
    pub angular_damping: Option<f64>,
    /// m: contacts push from this separation on.
    pub skin: Option<f64>,
    /// Mass of the probe, kg; 0 for none.
    pub mass: Option<f64>,
    /// Contact stiffness, N/m; [`SceneFile::render`] has this or the default.
    pub contact_stiffness: Option<f64>,
    /// Tangential stiffness of sticking contacts, N/m; also in [`SceneFile::render`].
    pub friction_stiffness: Option<f64>,
}

/// How the probe follows the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CouplingMode {
    /// Through a virtual coupling: the probe is a body of its own.
    #[default]
    Coupled,
    /// The probe is where the device is, as in the paper.
    Direct,
}

/// The simulated hand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneHand {
    /// How it holds.
    pub preset: HandPreset,
    /// A file that it follows ([`crate::read_hand`]), with the scene file's folder in front; `None`
    /// for the scene's own motion. Poses without times are in the scene's unit: multiply their
    /// translations by [`SceneFile::metres_per_unit`].
    pub path: Option<PathBuf>,
    /// Factor of the translations of a recorded hand.
    pub path_scale: Option<f64>,
    /// How many times as fast as recorded.
    pub path_speed: Option<f64>,
    /// Amplitude of its tremor, m; 0 for none.
    pub tremor: f64,
    /// Seed of the tremor.
    pub seed: u32,
}

/// How a simulated hand holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HandPreset {
    /// A stylus held loosely.
    Relaxed,
    /// The usual grip.
    #[default]
    Normal,
    /// A firm grip.
    Firm,
    /// As tight as it goes.
    Tight,
    /// No hand at all: the worst case for stability.
    None,
}

impl HandPreset {
    /// As it is written in a scene file.
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

/// Which files a scene may name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePolicy {
    /// Only files in the scene file's folder or below.
    Inside,
    /// Any file: the user asked for it.
    Anywhere,
}

/// Why a scene file was not read.
///
/// Shows as `cup.toml, line 9, column 1: [contact] has no key "tolerence"; did you mean
/// "tolerance"? (…)`.
#[derive(Debug, thiserror::Error)]
#[error("{file}{}: {problem}", place(*.line, *.column))]
pub struct SceneError {
    /// The file as the caller named it.
    pub file: String,
    /// Counted from 1; 0 when it is about the whole file.
    pub line: usize,
    /// Counted from 1, in characters; 0 with the line.
    pub column: usize,
    /// The problem, and what to do.
    pub problem: String,
}

fn place(line: usize, column: usize) -> String {
    if line == 0 { String::new() } else { format!(", line {line}, column {column}") }
}
