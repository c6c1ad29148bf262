//! The motion that takes a probe out of the part. There is no force until the probe is nearly out.
//!
//! Before a run begins, the penetration depth of the whole bodies is computed at the start pose,
//! with the shortest translation that separates them. This translation is the way out. If the probe
//! overlaps several parts (the environment and objects), or the way out of one part leads into
//! another, further translations are added until the probe overlaps no part. In the loop, the
//! deepest contact gives the way out.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::depth::{Containment, ContainmentQuery, GlobalDepth, GlobalMemory, GlobalSettings, Interior};
use palpus::detect::{ContactQuery, QuerySettings};
use palpus::render::{Settings, Tick};
use palpus_device::DeviceState;
use palpus_io::Threads;

use crate::engine::Frame;
use crate::stage::Stage;

/// Largest number of evaluations for the way out at the start; they take a fraction of a second.
const BUDGET: u64 = 30_000;

/// Largest number of translations of a way out. A way with more translations is not shown.
const MOST_LEGS: usize = 8;

/// Largest distance from the expected start at which a device counts as being there, m.
const AT_START: f64 = 1e-3;

/// An overlap and the way out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WayOut {
    /// Depth of the deepest contact, m; 0 if the tool has left the part and the device has not.
    pub(crate) depth: f64,
    /// The translation out of the part, world, m.
    pub(crate) way: DVec3,
}

impl WayOut {
    /// Returns the way out for the probe that a device in `state` holds, after the engine's tick;
    /// `None` if the probe is outside. With a coupling, the tool leaves the part first, and the way
    /// leads the device.
    pub(crate) fn of(tick: &Tick, settings: &Settings, frame: &Frame, state: &DeviceState) -> Option<Self> {
        let deepest = tick.contacts.iter().min_by(|a, b| a.separation.total_cmp(&b.separation))?;
        if deepest.separation < 0.0 {
            let depth = -deepest.separation;
            return Some(Self {
                depth,
                way: frame.vector_in_world(deepest.normal) * (depth + settings.contact_offset()),
            });
        }
        let tool = frame.in_world(&tick.tool_ba).point(settings.grip_a);
        let way = tool - state.pose.translation;
        (settings.coupling.is_some() && way.length() > settings.contact_offset()).then_some(Self { depth: 0.0, way })
    }

    /// Describes how far to move the probe, and in which direction.
    pub(crate) fn words(&self) -> String {
        let along = self.way.normalize_or_zero();
        format!("move it {:.1} mm along ({:.2}, {:.2}, {:.2})", self.way.length() * 1e3, along.x, along.y, along.z)
    }
}

/// A probe that is inside the part at the start of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InsideStart {
    /// Position of the grip, world, m.
    from: DVec3,
    /// Way out, computed from the whole bodies with a proven depth.
    pub(crate) out: WayOut,
    /// True if one body lies inside the other and the surfaces do not touch, so that there is no
    /// contact.
    pub(crate) contained: bool,
}

impl InsideStart {
    /// Returns the way out for the probe at the start of the stage's hand path. `None` if the probe
    /// overlaps neither the environment nor an object nor one of the `tools` (at their start poses,
    /// world), or if no way out of all of them was found.
    pub(crate) fn of(stage: &Stage, tools: &[(Arc<Body>, Pose)]) -> Option<Self> {
        let start = stage.path.pose(0.0);
        let objects = stage.objects.iter().map(|object| Part::new(&object.body, object.pose));
        let tools = tools.iter().map(|(tool, pose)| Part::new(tool, *pose));
        let environment = Part::new(&stage.environment, stage.environment_pose);
        let mut parts: Vec<Part<'_>> = std::iter::once(environment).chain(objects).chain(tools).collect();
        let mut interior = None;
        let mut found: Option<Self> = None;
        for _ in 0..MOST_LEGS {
            let way = found.map_or(DVec3::ZERO, |found| found.out.way);
            let at = Pose { translation: start.translation + way, ..start };
            let legs = parts.iter_mut().filter_map(|part| part.leg(&stage.probe, &at, &mut interior));
            let Some(leg) = legs.max_by(|a, b| a.depth.total_cmp(&b.depth)) else { return found };
            let way = way + leg.way + leg.way.normalize_or_zero() * stage.settings.contact_offset();
            let from = stage.grip(start).translation;
            let first = Self { from, out: WayOut { depth: leg.depth, way }, contained: leg.contained };
            found = found.map_or(Some(first), |found| Some(Self { out: WayOut { way, ..found.out }, ..found }));
        }
        None
    }

    /// True if a device at `grip` (world, m) is at the start for which this way out was computed.
    pub(crate) fn is_at(&self, grip: DVec3) -> bool {
        Self::is_near(self.from, grip)
    }

    /// True if a device at `grip` is at the start `from` (world, m).
    pub(crate) fn is_near(from: DVec3, grip: DVec3) -> bool {
        grip.distance(from) <= AT_START
    }

    /// Returns the plane that the grip has passed at the end of the way: a point (m) and the
    /// normal, world.
    pub(crate) fn end(&self) -> [DVec3; 2] {
        [self.from + self.out.way, self.out.way.normalize_or_zero()]
    }

    /// Returns the start position of the grip and the whole translation, world, m.
    pub(crate) fn way(&self) -> (DVec3, DVec3) {
        (self.from, self.out.way)
    }

    /// Returns the rest of the way for a device at `grip` (world, m); `None` if the device is past
    /// the end.
    pub(crate) fn left(&self, grip: DVec3) -> Option<WayOut> {
        let way = self.from + self.out.way - grip;
        (way.dot(self.out.way) > 0.0).then_some(WayOut { way, ..self.out })
    }
}

/// The environment, or an object or another tool at its start pose.
struct Part<'a> {
    body: &'a Arc<Body>,
    /// Pose, world.
    pose: Pose,
    interior: Option<Interior>,
}

/// A translation out of one part.
struct Leg {
    /// Depth, m.
    depth: f64,
    /// Translation, world, m.
    way: DVec3,
    /// True if one body lies inside the other and the surfaces do not touch.
    contained: bool,
}

impl<'a> Part<'a> {
    fn new(body: &'a Arc<Body>, pose: Pose) -> Self {
        Self { body, pose, interior: None }
    }

    /// Computes the way out for a `probe` at `at` (world). The probe's `interior` is computed at
    /// its first use. `None` if the probe is outside.
    fn leg(&mut self, probe: &Arc<Body>, at: &Pose, interior: &mut Option<Interior>) -> Option<Leg> {
        let pose_ba = self.pose.inverse() * *at;
        if !probe.mesh().bounds().placed(&pose_ba).overlaps(&self.body.mesh().bounds()) {
            return None;
        }
        let contained = ContainmentQuery::new(probe, self.body).run(&pose_ba) != Containment::Neither;
        if !contained && !overlap(probe, self.body, &pose_ba) {
            return None;
        }
        let threads = Threads::all();
        let of = |body: &Body| Interior::new(body, &threads, &mut |_| ());
        let interior_a = interior.get_or_insert_with(|| of(probe));
        let interior_b = self.interior.get_or_insert_with(|| of(self.body));
        let settings = GlobalSettings { budget: BUDGET, ..GlobalSettings::new(probe, self.body) };
        let query = GlobalDepth::new(probe, interior_a, self.body, interior_b);
        let depth = query.run(&pose_ba, &settings, &mut GlobalMemory::default());
        let way = self.pose.vector(depth.translation);
        (depth.upper > 0.0).then_some(Leg { depth: depth.upper, way, contained })
    }
}

/// True if the deepest contact of the bodies is an overlap.
fn overlap(a: &Arc<Body>, b: &Arc<Body>, pose_ba: &Pose) -> bool {
    let settings = QuerySettings { tolerance: 0.0, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    query.contacts(pose_ba).iter().any(|contact| contact.separation < 0.0)
}
