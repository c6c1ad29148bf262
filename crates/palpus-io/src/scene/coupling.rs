//! Default values of a scene's coupling, computed from the device's limits and the period of the
//! loop.

use palpus::render::{Saturation, Settings, VirtualCoupling};

use super::{CouplingMode, SceneCoupling};

impl SceneCoupling {
    /// Returns `render` with this coupling and a time budget, for a loop with a period of `period`
    /// seconds.
    /// `render.limits` are the combined limits of the device and the scene. Values that the scene
    /// does not set are computed from these limits.
    pub fn settings(&self, render: &Settings, period: f64) -> Settings {
        let mut settings = *render;
        let limits = settings.limits;
        settings.time_budget.get_or_insert_with(|| Settings::time_budget_of(period));
        if limits.torque <= 0.0 {
            // A device without torque would saturate in every tick; show the torque instead.
            settings.saturation = Saturation::UnderActuated;
        }
        if self.mode == CouplingMode::Direct {
            return settings;
        }
        let tuned = VirtualCoupling::tuned(&limits, period, settings.contact_tolerance);
        settings.coupling = Some(VirtualCoupling {
            stiffness: self.stiffness.unwrap_or(tuned.stiffness),
            damping: self.damping.unwrap_or(tuned.damping),
            angular_stiffness: self.angular_stiffness.unwrap_or(tuned.angular_stiffness),
            angular_damping: self.angular_damping.unwrap_or(tuned.angular_damping),
            contact_offset: self.contact_offset.unwrap_or(tuned.contact_offset).min(settings.contact_tolerance),
            mass: self.mass.unwrap_or(tuned.mass),
        });
        let of_device = VirtualCoupling::contact_stiffness(&limits, settings.contact_tolerance);
        settings.stiffness = self.contact_stiffness.or(of_device).unwrap_or(settings.stiffness);
        if let Some(friction) = &mut settings.friction {
            friction.tangential_stiffness = self.friction_stiffness.unwrap_or(settings.stiffness);
        }
        settings
    }
}
