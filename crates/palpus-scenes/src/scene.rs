//! Parts of a scene.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::body::PolygonSoup;

use crate::HandPath;

/// A probe, an environment, the contact settings, and a hand that moves the probe against the
/// environment.
///
/// The environment's frame is the world. All values are in SI units.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name of the scene, by which it is selected.
    pub name: &'static str,
    /// Summary in one line, for a list.
    pub summary: &'static str,
    /// Shape of body a, m. The hand holds the body at the origin of this shape.
    pub probe: PolygonSoup,
    /// Body b, m.
    pub environment: PolygonSoup,
    /// Contact settings between the probe and the environment.
    pub contact: ContactSettings,
    /// Pose of the probe when the scene starts. It has no contact with the environment.
    pub start: Pose,
    /// Motion of the scripted hand. `path.pose(0.0)` equals `start`.
    pub path: HandPath,
    /// A second tool, if the scene has one.
    pub second: Option<SecondTool>,
    /// Objects in addition to the environment.
    pub objects: Vec<Object>,
    /// Gravity, m/s².
    pub gravity: DVec3,
}

impl Scene {
    /// Returns true if the scene has no bodies except the probe and the environment.
    pub fn is_of_two_bodies(&self) -> bool {
        self.second.is_none() && self.objects.is_empty()
    }
}

/// A body that no hand holds.
#[derive(Clone, Debug)]
pub struct Object {
    /// Shape of the object, m. Equal objects of one scene share it.
    pub shape: Arc<PolygonSoup>,
    /// Pose of the object when the scene starts.
    pub start: Pose,
    /// How the object moves.
    pub motion: Motion,
}

/// How an object moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// The object does not move.
    Fixed,
    /// The object moves with this velocity of its frame's origin (m/s and rad/s) and ignores
    /// contact.
    Driven(Twist),
    /// The object moves under gravity, contact and friction. The value is its density, kg/m³.
    Free(f64),
}

/// A second probe, which another hand holds.
#[derive(Clone, Debug)]
pub struct SecondTool {
    /// Shape of the probe, m. The hand holds the probe at the origin of this shape.
    pub probe: PolygonSoup,
    /// Pose of the probe when the scene starts, free of contact.
    pub start: Pose,
    /// Motion of its scripted hand. `path.pose(0.0)` equals `start`.
    pub path: HandPath,
}

/// Contact settings of two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Contact tolerance, t of \[K02\], m: a contact exists below this separation.
    pub tolerance: f64,
    /// Cluster radius, δ of \[K02\], m.
    pub cluster_radius: f64,
    /// Contact stiffness, k of \[K02\], N/m.
    pub stiffness: f64,
    /// `None` means frictionless.
    pub friction: Option<Friction>,
    /// If true, force directions follow interpolated normals.
    pub shading: bool,
    /// With shading, edges whose faces differ by more than this angle stay sharp, rad.
    pub crease: f64,
}

/// Coefficients of dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coefficient before sliding begins.
    pub static_coefficient: f64,
    /// Coefficient while sliding.
    pub dynamic_coefficient: f64,
}
