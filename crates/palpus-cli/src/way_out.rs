//! Motion that takes a probe out of the part: there is no force until it is nearly out.
//!
//! Before a run begins, the penetration depth of the whole bodies is computed at the start pose, and its
//! translation is the way out. In the loop, the deepest contact gives it.

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::depth::{Containment, ContainmentQuery, GlobalDepth, GlobalMemory, GlobalSettings, Interior};
use palpus::detect::{ContactQuery, QuerySettings};
use palpus::render::{Settings, Tick};
use palpus_device::DeviceState;
use palpus_io::Threads;

use crate::engine::Frame;
use crate::stage::Stage;

/// Evaluations for the way out of a start: a fraction of a second.
const BUDGET: u64 = 30_000;

/// m: a device that begins within this of the expected start is there.
const AT_START: f64 = 1e-3;

/// An overlap, and the way out of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WayOut {
    /// m: how deep the deepest contact is; 0 where the tool has left the part already and the
    /// device has not.
    pub(crate) depth: f64,
    /// World, m.
    pub(crate) way: DVec3,
}

impl WayOut {
    /// Of the probe that a device in `state` holds, after the engine's tick; `None` if it is
    /// outside. With a coupling the tool leaves the part first, and shows where the device is to
    /// go.
    pub(crate) fn of(tick: &Tick, settings: &Settings, frame: &Frame, state: &DeviceState) -> Option<Self> {
        let deepest = tick.contacts.iter().min_by(|a, b| a.separation.total_cmp(&b.separation))?;
        if deepest.separation < 0.0 {
            let depth = -deepest.separation;
            return Some(Self { depth, way: frame.vector_in_world(deepest.normal) * (depth + settings.skin()) });
        }
        let tool = frame.in_world(&tick.tool_ba).point(settings.grip_a);
        let way = tool - state.pose.translation;
        (settings.coupling.is_some() && way.length() > settings.skin()).then_some(Self { depth: 0.0, way })
    }

    /// In words: how far to move the probe, and along what.
    pub(crate) fn words(&self) -> String {
        let along = self.way.normalize_or_zero();
        format!("move it {:.1} mm along ({:.2}, {:.2}, {:.2})", self.way.length() * 1e3, along.x, along.y, along.z)
    }
}

/// A probe that stands inside the part where the run begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InsideStart {
    /// The grip, world, m.
    from: DVec3,
    /// Of the whole bodies; its depth is verified.
    pub(crate) out: WayOut,
    /// One body lies inside the other with the surfaces apart, so that no contact tells.
    pub(crate) contained: bool,
}

impl InsideStart {
    /// Of the probe where the stage's hand path begins; `None` if it is outside of the environment there.
    pub(crate) fn of(stage: &Stage) -> Option<Self> {
        let start = stage.path.pose(0.0);
        let pose_ba = stage.environment_pose.inverse() * start;
        let (a, b) = (&stage.probe, &stage.environment);
        let contained = ContainmentQuery::new(a, b).run(&pose_ba) != Containment::Neither;
        if !contained && !overlaps(stage, &pose_ba) {
            return None;
        }
        let threads = Threads::all();
        let interior = |body| Interior::new(body, &threads, &mut |_| ());
        let (interior_a, interior_b) = (interior(a), interior(b));
        let settings = GlobalSettings { budget: BUDGET, ..GlobalSettings::new(a, b) };
        let depth =
            GlobalDepth::new(a, &interior_a, b, &interior_b).run(&pose_ba, &settings, &mut GlobalMemory::default());
        let way = stage.environment_pose.vector(depth.translation);
        let way = way + way.normalize_or_zero() * stage.settings.skin();
        let out = WayOut { depth: depth.upper, way };
        (depth.upper > 0.0).then(|| Self { from: stage.grip(start).translation, out, contained })
    }

    /// True if a device at `grip` (world, m) stands where this was computed.
    pub(crate) fn is_at(&self, grip: DVec3) -> bool {
        grip.distance(self.from) <= AT_START
    }

    /// What is left of the way for a device at `grip` (world, m); `None` if it is past the end.
    pub(crate) fn left(&self, grip: DVec3) -> Option<WayOut> {
        let way = self.from + self.out.way - grip;
        (way.dot(self.out.way) > 0.0).then_some(WayOut { way, ..self.out })
    }
}

/// True if the deepest contact of the probe with the environment is an overlap.
fn overlaps(stage: &Stage, pose_ba: &Pose) -> bool {
    let settings = QuerySettings { tolerance: 0.0, ..QuerySettings::default() };
    let mut query = ContactQuery::new(stage.probe.clone(), stage.environment.clone(), settings);
    query.contacts(pose_ba).iter().any(|contact| contact.separation < 0.0)
}
