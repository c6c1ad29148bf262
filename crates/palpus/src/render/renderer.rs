//! One probe and one environment: a [`World`] of two bodies \[K02 §4, §5\].
//!
//! A step computes the device's wrench in five stages:
//!
//! 1. *Query*: find all contacts of the two bodies within the tolerance.
//! 2. *Depth*: in the same pass, compute the depths of overlapping pieces.
//! 3. *Force*: compute the wrenches on both bodies by clusters, shading, penalty forces and
//!    friction.
//! 4. *Couple*: compute the wrench on the device about the grip. In direct rendering, as in the
//!    paper, this is the wrench of the contacts. With a virtual coupling, the query uses the
//!    pose of the *tool*. Contacts and coupling then move the tool, and the device gets the
//!    coupling's wrench.
//! 5. *Saturate*: limit the wrench to the device's limits.
//!
//! With a work limit ([`Renderer::allow`]), pairs that the query did not reach keep their contacts,
//! extrapolated to the new pose.

use std::sync::Arc;

use super::{Limits, Object, ProbeState, Settings, SettingsError, Tick, ToolId, WorkLimit, World};
use crate::algebra::{Clock, Pose};
use crate::body::Body;
use crate::detect::Helper;

/// Renders the contact of a probe (a) with an environment (b). The environment's frame is the
/// scene's frame.
#[derive(Clone, Debug)]
pub struct Renderer {
    world: World,
    tool: ToolId,
}

impl Renderer {
    /// Returns a renderer with its memory. Fails if a setting is invalid.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: Settings) -> Result<Self, SettingsError> {
        let mut world = World::new(settings)?;
        world.add(Object::fixed(b, Pose::IDENTITY))?;
        let tool = world.add_tool(a, settings)?;
        Ok(Self { world, tool })
    }

    /// Prepares shading at this crease angle (rad), so that [`Self::set_settings`] can turn it on
    /// later. Has no effect if shading is on from the start.
    #[must_use]
    pub fn with_surfaces(mut self, crease_angle: f64) -> Self {
        self.world.prepare_shading(self.tool, crease_angle);
        self
    }

    /// Changes the settings from the next step on: see [`World::set_tool_settings`].
    ///
    /// # Errors
    /// Fails if a setting is invalid; all settings are then unchanged.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<(), SettingsError> {
        self.world.set_tool_settings(self.tool, settings)
    }

    /// Runs one step of the loop: computes the wrench for the probe's state. `dt` is the time since
    /// the last step, s.
    pub fn step(&mut self, probe: &ProbeState, dt: f64, clock: &impl Clock) -> &Tick {
        self.world.step(std::slice::from_ref(probe), dt, clock);
        self.tick()
    }

    /// Limits the force to the device's present limits: see [`World::set_available`].
    pub fn set_available(&mut self, available: &Limits) {
        self.world.set_available(self.tool, available);
    }

    /// Limits the work of the queries of the next steps: see [`World::allow`].
    pub fn allow(&mut self, limit: WorkLimit) {
        self.world.allow(limit);
    }

    /// Returns a helper for the steps: see [`World::helper`].
    pub fn helper(&self) -> Helper {
        self.world.helper()
    }

    /// Returns the last tick.
    pub fn tick(&self) -> &Tick {
        self.world.tick(self.tool)
    }

    /// Returns the settings of the next step.
    pub fn settings(&self) -> &Settings {
        self.world.tool_settings(self.tool)
    }

    /// Returns the crease angle at which shading can be turned on, rad.
    pub fn crease_angle(&self) -> Option<f64> {
        self.world.crease_angle(self.tool)
    }

    /// Drops all state, for use after a jump of the probe. The next step runs like the first step.
    pub fn clear(&mut self) {
        self.world.clear();
    }
}
