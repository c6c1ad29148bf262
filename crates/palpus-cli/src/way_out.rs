//! Motion that takes a probe out of the part: there is no force until it is nearly out.

use glam::DVec3;
use palpus::render::{Settings, Tick};
use palpus_device::DeviceState;

use crate::engine::Frame;

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
