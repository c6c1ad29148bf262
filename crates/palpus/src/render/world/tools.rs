//! Access to a world's tools, and changes of their settings between steps.

use super::{BodyId, ToolId, World};
use crate::force::ShadingSettings;
use crate::render::{Limits, Settings, SettingsError, Tick};

impl World {
    /// Returns the body id of a tool.
    pub fn body_of(&self, tool: ToolId) -> BodyId {
        BodyId(self.tools[tool.0].thing)
    }

    /// Returns the tick of a tool in the last step.
    pub fn tick(&self, tool: ToolId) -> &Tick {
        &self.tools[tool.0].tick
    }

    /// Returns the settings of a tool for the next step.
    pub fn tool_settings(&self, tool: ToolId) -> &Settings {
        &self.tools[tool.0].settings
    }

    /// Prepares shading of a tool at this crease angle (rad), so that [`Self::set_tool_settings`]
    /// can turn it on later. Has no effect if shading is on from the start.
    pub fn prepare_shading(&mut self, tool: ToolId, crease_angle: f64) {
        let held = &mut self.tools[tool.0];
        held.crease_angle.get_or_insert(crease_angle);
        for pair in self.pairs.iter_mut().filter(|pair| pair.bodies.contains(&held.thing)) {
            pair.prepare_surfaces(crease_angle);
        }
    }

    /// Returns the crease angle at which a tool's shading can be turned on, rad.
    pub fn crease_angle(&self, tool: ToolId) -> Option<f64> {
        self.tools[tool.0].crease_angle
    }

    /// Changes the settings of a tool from the next step on. Contacts, friction, the tool's pose
    /// and the tick index are kept. A new coupling starts at the device's pose.
    ///
    /// Allocates no memory. Changes that would need memory are refused like invalid settings:
    /// another `capacity`, or shading at a crease angle that was not prepared
    /// ([`Self::prepare_shading`]).
    ///
    /// # Errors
    /// Fails if a setting is invalid; all settings are then unchanged.
    pub fn set_tool_settings(&mut self, tool: ToolId, settings: &Settings) -> Result<(), SettingsError> {
        settings.validate()?;
        let held = &self.tools[tool.0];
        let refused = |field, value, rule| Err(SettingsError { field, value, rule });
        if settings.capacity != held.settings.capacity {
            return refused("capacity", settings.capacity as f64, "the value at the start");
        }
        let other = |shading: &ShadingSettings| held.crease_angle != Some(shading.crease_angle);
        if let Some(shading) = settings.shading.filter(other) {
            return refused("shading.crease_angle", shading.crease_angle, "the prepared crease angle");
        }
        let thing = held.thing;
        self.wake_all();
        self.tools[tool.0].set_settings(&self.things[thing].body, settings);
        self.margin = self.margin.max(settings.contact_tolerance);
        for k in 0..self.pairs.len() {
            if self.pairs[k].bodies.contains(&thing) {
                let law = self.law(self.pairs[k].bodies);
                self.pairs[k].set_settings(law);
            }
        }
        Ok(())
    }

    /// Limits the force and torque of a tool's coupling to its device's present limits,
    /// `available`. Without a coupling, nothing changes.
    pub fn set_available(&mut self, tool: ToolId, available: &Limits) {
        self.tools[tool.0].set_available(available);
    }
}
