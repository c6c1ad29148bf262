//! Parts of a scene.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::body::PolygonSoup;

use crate::HandPath;

/// A probe, an environment, how they touch, and a hand that moves the one against the other.
///
/// The environment's frame is the world; everything is in SI units.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The name it is asked for by.
    pub name: &'static str,
    /// One line for a list.
    pub summary: &'static str,
    /// Body a, held at its origin, m.
    pub probe: PolygonSoup,
    /// Body b, m.
    pub environment: PolygonSoup,
    /// How the two touch.
    pub contact: ContactSettings,
    /// The probe's pose when the scene starts: free of contact, except that a chain link starts
    /// inside its neighbour.
    pub start: Pose,
    /// The scripted hand; `path.pose(0.0)` is `start`.
    pub path: HandPath,
    /// A second tool, if there is one.
    pub second: Option<SecondTool>,
    /// Objects beside the environment.
    pub objects: Vec<Object>,
    /// m/s².
    pub gravity: DVec3,
}

impl Scene {
    /// True if probe and environment are all that there is.
    pub fn is_of_two_bodies(&self) -> bool {
        self.second.is_none() && self.objects.is_empty()
    }
}

/// A body that no hand holds.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its shape, m; equal objects of one scene share it.
    pub shape: Arc<PolygonSoup>,
    /// Its pose when the scene starts.
    pub start: Pose,
    /// How it moves.
    pub motion: Motion,
}

/// How an object moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// With this velocity of its frame's origin, m/s and rad/s, whatever touches it.
    Driven(Twist),
    /// By gravity, contact and friction; kg/m³.
    Free(f64),
}

/// A second probe, in a hand of its own.
#[derive(Clone, Debug)]
pub struct SecondTool {
    /// Held at its origin, m.
    pub probe: PolygonSoup,
    /// Its pose when the scene starts, free of contact.
    pub start: Pose,
    /// Its scripted hand; `path.pose(0.0)` is `start`.
    pub path: HandPath,
}

/// How two bodies touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// t of \[K02\]: a contact exists when the separation is below this, m.
    pub tolerance: f64,
    /// δ of \[K02\], m.
    pub cluster_radius: f64,
    /// k of \[K02\], N/m.
    pub stiffness: f64,
    /// None: frictionless.
    pub friction: Option<Friction>,
    /// Force directions follow interpolated normals.
    pub shading: bool,
    /// Edges whose faces turn by more than this stay sharp under shading, rad.
    pub crease: f64,
}

/// Coefficients of dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Before sliding begins.
    pub static_coefficient: f64,
    /// While sliding.
    pub dynamic_coefficient: f64,
}
