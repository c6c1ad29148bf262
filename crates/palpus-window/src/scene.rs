//! The visible scene.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;

use crate::camera::Camera;
use crate::moment::Moment;
use crate::picture::Rgb;
use crate::solid::Solid;
use crate::style::Theme;
use crate::xray::XRay;

/// Drawing style of one body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// True if each convex piece has its own colour.
    pub pieces: bool,
    /// True if the triangles' sides are drawn.
    pub wireframe: bool,
    /// True if bodies behind this body are visible through it.
    pub translucent: bool,
    /// True if the body is translucent only around a probe that it hides.
    pub xray: bool,
}

/// A body at its pose.
#[derive(Clone, Debug)]
pub struct ShownBody {
    /// The body's role in the scene.
    pub part: BodyPart,
    /// Its triangles.
    pub solid: Arc<Solid>,
    /// Pose of the body in the world.
    pub pose: Pose,
    /// Colour of the body, if its pieces have no colours.
    pub colour: Rgb,
    /// Its drawing style.
    pub look: Look,
}

/// The content of one picture.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The bodies: in the scene of a run the probe, the environment, the other probes and the
    /// objects.
    pub bodies: Vec<ShownBody>,
    /// Contacts and forces, if any.
    pub moment: Option<Moment>,
    /// Pose of the moment's frame (the environment's frame) in the world.
    pub moment_pose: Pose,
    /// Force that is drawn with the longest arrow, N: the device's limit.
    pub force_scale: f64,
    /// Torque that is drawn with the longest turning arrow, N·m.
    pub torque_scale: f64,
    /// Title, at the top.
    pub title: String,
    /// Caption, at the bottom.
    pub caption: String,
    /// Unit of length.
    pub unit: Unit,
}

impl Default for Scene {
    /// Returns an empty scene.
    fn default() -> Self {
        Self {
            bodies: Vec::new(),
            moment: None,
            moment_pose: Pose::IDENTITY,
            force_scale: 1.0,
            torque_scale: 1.0,
            title: String::new(),
            caption: String::new(),
            unit: Unit::Metre,
        }
    }
}

/// Units of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    /// Metres.
    #[default]
    Metre,
    /// The unknown unit of the model's file.
    Model,
}

/// Role of a body in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyPart {
    /// The probe in the first hand.
    Probe,
    /// The environment, with its parts that are drawn separately.
    Environment,
    /// The probe in another hand. The number is at least 2.
    OtherProbe(usize),
    /// A moving body that no hand holds. The number is at least 1.
    Object(usize),
    /// An object that never moves.
    FixedObject(usize),
}

impl BodyPart {
    /// Returns the name of the role.
    pub fn name(self) -> String {
        match self {
            Self::Probe => "probe".to_owned(),
            Self::Environment => "environment".to_owned(),
            Self::OtherProbe(k) => format!("probe {k}"),
            Self::Object(k) | Self::FixedObject(k) => format!("object {k}"),
        }
    }

    /// Returns the colour of the role in a theme.
    pub fn colour(self, theme: Theme) -> Rgb {
        let colours = theme.colours();
        match self {
            Self::Probe | Self::OtherProbe(_) => colours.probe,
            Self::Environment | Self::FixedObject(_) => colours.environment,
            Self::Object(_) => colours.object,
        }
    }
}

/// The window lists the drawing styles of at most this many bodies, because a longer list would
/// fill the window.
#[cfg(feature = "gui")]
pub(crate) const LISTED: usize = 4;

/// If the proxy is farther from the device than this share of the probe's size, both are drawn.
const APART: f64 = 2e-3;

impl Scene {
    /// Moves bodies to their poses at `moment`; an invalid pose leaves its body in place.
    #[cfg(feature = "gui")]
    pub(crate) fn pose_probes(&mut self, moment: &Moment) {
        let moment_pose = self.moment_pose;
        let others = moment.others.iter().enumerate().map(|(k, pose)| (k + 2, pose));
        for (body, pose) in std::iter::once((0, &moment.tool)).chain(others).filter(|(_, pose)| pose.is_valid()) {
            if let Some(body) = self.bodies.get_mut(body) {
                body.pose = moment_pose * *pose;
            }
        }
    }

    /// Selects the next look of the environment: transparent around the probe, transparent
    /// everywhere, or opaque.
    #[cfg(feature = "gui")]
    pub(crate) fn turn_glass(&mut self) {
        if let Some(Look { xray, translucent, .. }) = self.bodies.get_mut(1).map(|body| &mut body.look) {
            (*xray, *translucent) = (!*xray && !*translucent, *xray);
        }
    }

    /// Returns the x-ray regions of the bodies that hands hold, in a picture of `size` pixels;
    /// `nominal` pixels make one pixel of a nominal picture.
    pub(crate) fn xrays(&self, camera: &Camera, size: [f64; 2], nominal: f64) -> Vec<XRay> {
        let held = self.bodies.iter().filter(|body| matches!(body.part, BodyPart::Probe | BodyPart::OtherProbe(_)));
        held.filter_map(|body| XRay::around(&body.solid, &body.pose, camera, size, nominal)).collect()
    }

    /// True if the device's pose of the probe differs from the proxy's, so that both are drawn.
    pub(crate) fn is_device_apart(&self, moment: &Moment, probe: &ShownBody) -> bool {
        let (low, high) = probe.solid.bounds();
        let apart = |p: DVec3| (moment.device.point(p) - moment.tool.point(p)).length();
        apart(low).max(apart(high)) > APART * (high - low).length()
    }

    /// True if the grip of the hand is so far from the grip of the tool that both grips are marked.
    pub(crate) fn is_grip_apart(&self) -> bool {
        let (Some(moment), Some(probe)) = (&self.moment, self.bodies.first()) else { return false };
        let (low, high) = probe.solid.bounds();
        moment.hand.distance(moment.grip) > APART * (high - low).length()
    }

    /// Returns the corners of the boxes around all bodies, world, for framing.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + Clone {
        let boxes: Vec<(Pose, DVec3, DVec3)> = self
            .bodies
            .iter()
            .filter(|body| !body.solid.vertices.is_empty())
            .map(|body| (body.pose, body.solid.bounds().0, body.solid.bounds().1))
            .collect();
        boxes.into_iter().flat_map(|(pose, low, high)| {
            (0..8usize).map(move |k| {
                let pick = |bit: usize, low: f64, high: f64| if k >> bit & 1 == 1 { high } else { low };
                pose.point(DVec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z)))
            })
        })
    }
}
