//! Settings of a renderer, which can change between steps.

use glam::DVec3;

use super::{Limits, Material, Saturation, VirtualCoupling};
use crate::algebra::tolerance::{DEFAULT_TOLERANCE, PACE_SHARE, SMOOTH_CONTACTS, TOOL_SINKS};
use crate::force::{FrictionSettings, LinkageSettings, PenaltySettings, ShadingSettings};

/// All settings of rendering. [`Settings::validate`] checks them before use.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Settings {
    /// t of \[K02\], m: contacts are found, and push, below this separation. With a coupling,
    /// contacts push below the coupling's contact offset ([`VirtualCoupling::contact_offset`]), and
    /// are found as far as the tool can move in the next step.
    pub contact_tolerance: f64,
    /// δ of \[K02\], m: contacts nearer to each other than this share one force. 0: every contact
    /// has its own force.
    pub cluster_radius: f64,
    /// How contacts share their force.
    ///
    /// With serde, a missing value means linkage, because recordings without this field were made
    /// before other values existed.
    #[cfg_attr(feature = "serde", serde(default = "Clustering::linkage"))]
    pub clustering: Clustering,
    /// Largest opening of the cone that contains the normals of a cluster (rad), 60° to 170°.
    /// `None`: clusters are not cut, as in the paper.
    pub split_angle: Option<f64>,
    /// k, the stiffness of each cluster, N/m. With a coupling, this is the stiffness of a contact
    /// in series with the coupling.
    pub stiffness: f64,
    /// Damping of the normal motion of each cluster, N·s/m; 0 for no damping.
    pub damping: f64,
    /// Pieces that are flush, or tilted by less than this angle (rad), touch at the corners of
    /// their overlap, whose loads fade out toward this angle. A tool near an edge where a surface
    /// bends inward touches both sides. `None`: each pair of pieces has at most one contact, at its
    /// exact witness points, which jump when flush pieces tilt.
    #[cfg_attr(feature = "serde", serde(alias = "blend_angle"))]
    pub patch_angle: Option<f64>,
    /// Force shading: force directions from smoothed normals. `None`: the directions are the
    /// contact normals.
    pub shading: Option<ShadingSettings>,
    /// Stick–slip friction; `None`: no friction.
    pub friction: Option<FrictionSettings>,
    /// Vibration of impacts; `None`: no vibration.
    pub material: Option<Material>,
    /// Coupling between tool and device. `None`: direct rendering, as in the paper; the probe has
    /// the device's pose.
    pub coupling: Option<VirtualCoupling>,
    /// Limits of the commanded force and torque.
    pub limits: Limits,
    /// How a wrench that exceeds the limits is reduced.
    pub saturation: Saturation,
    /// Point at which the hand holds the probe, m, in the probe's frame; by default the origin. The
    /// device's pose ([`super::ProbeState::of_grip`]), its torque and the linear part of its twist
    /// are taken at this point.
    pub grip_a: DVec3,
    /// Largest number of contacts in a tick. If there are more, the deepest are kept.
    pub capacity: usize,
    /// Time that a step should take at most, ns; `None`: any time. A step with a running clock
    /// limits the work of its queries to what it can do in this time ([`super::WorkLimit`]).
    pub time_budget: Option<u64>,
}

impl Default for Settings {
    /// Returns settings for a hand-sized probe on a Phantom Premium 1.5/6DOF: a tolerance of 1 mm,
    /// clusters of 4 mm, and 800 N/m.
    fn default() -> Self {
        Self {
            contact_tolerance: DEFAULT_TOLERANCE,
            cluster_radius: 4e-3,
            clustering: Clustering::default(),
            split_angle: Some(130f64.to_radians()),
            stiffness: 800.0,
            damping: 0.0,
            patch_angle: Some(5f64.to_radians()),
            shading: None,
            friction: None,
            material: None,
            coupling: None,
            limits: Limits { force: 8.5, torque: 0.188 },
            saturation: Saturation::Separate,
            grip_a: DVec3::ZERO,
            capacity: 8192,
            time_budget: None,
        }
    }
}

/// How contacts share their force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Clustering {
    /// The paper's rule: exact single linkage, where each cluster has the force of its deepest
    /// member. The force jumps when clusters merge or split.
    Linkage,
    /// Every contact pushes along its own direction. Contacts that push in the same direction share
    /// one load, at any distance from each other. The force is continuous, and its stiffness does
    /// not depend on the mesh of a surface ([`crate::force::LoadSharing`]).
    ///
    /// This rule is the default: in `docs/feel.md`, it measures better wherever both rules differ.
    #[default]
    Smooth,
}

#[cfg(feature = "serde")]
impl Clustering {
    fn linkage() -> Self {
        Self::Linkage
    }
}

/// An invalid setting.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("setting `{field}` is {value}, but must be {rule}")]
pub struct SettingsError {
    /// Name of the field. A nested field follows its parent after a dot.
    pub field: &'static str,
    /// The invalid value.
    pub value: f64,
    /// The rule for valid values.
    pub rule: &'static str,
}

/// Upper limit of the contact capacity: memory for all contacts is allocated at the start.
const MOST_CONTACTS: usize = 1 << 20;

impl Settings {
    /// Least time budget, ns; smaller values are probably in a wrong unit.
    pub const LEAST_TIME_BUDGET: u64 = 1000;

    /// Settings for a tool with a coupling, as stiff as a device with these limits can display.
    /// `period` is the period of the loop (s), and `contact_tolerance` is in m. A scene that
    /// contains only two meshes gets these settings. The time budget is that of
    /// [`Self::time_budget_of`].
    ///
    /// [`contact_tolerance`](super::contact_tolerance) chooses a tolerance that suits the bodies.
    #[must_use]
    pub fn coupled(limits: Limits, period: f64, contact_tolerance: f64) -> Self {
        let default = Self::default();
        let stiffness = VirtualCoupling::contact_stiffness(&limits, contact_tolerance).unwrap_or(default.stiffness);
        let coupling = Some(VirtualCoupling::tuned(&limits, period, contact_tolerance));
        // A device without torque would saturate in every tick, so the torque is only displayed.
        let saturation = if limits.torque > 0.0 { default.saturation } else { Saturation::UnderActuated };
        let time_budget = Some(Self::time_budget_of(period));
        Self { contact_tolerance, stiffness, coupling, limits, saturation, time_budget, ..default }
    }

    /// Returns the time that a step should take at most in a loop with a period of `period`
    /// seconds, ns: 0.6 of the period, but at least 1000.
    pub fn time_budget_of(period: f64) -> u64 {
        ((PACE_SHARE * 1e9 * period) as u64).max(Self::LEAST_TIME_BUDGET)
    }

    /// Returns these settings with friction of these coefficients. The tangential stiffness equals
    /// the normal stiffness.
    #[must_use]
    pub fn with_friction(self, static_coefficient: f64, dynamic_coefficient: f64) -> Self {
        let tangential_stiffness = self.stiffness;
        let friction = FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness };
        Self { friction: Some(friction), ..self }
    }

    /// Returns the settings for contacts in the implicit step. With a coupling, the largest force
    /// moves the tool by at most half the contact offset, in normal and tangential directions. The
    /// coupling is softened to compensate ([`VirtualCoupling::softened`]).
    pub(super) fn held(&self) -> Self {
        let hard = self.coupling.map_or(0.0, |coupling| self.limits.force / (TOOL_SINKS * coupling.contact_offset));
        if !(hard.is_finite() && hard > self.stiffness) {
            return *self;
        }
        let mut held = Self { stiffness: hard, ..*self };
        if let Some(friction) = &mut held.friction {
            let left = 1.0 / friction.tangential_stiffness - 1.0 / self.stiffness;
            friction.tangential_stiffness = 1.0 / (left.max(0.0) + 1.0 / hard);
        }
        held
    }

    /// Fails with the first invalid setting.
    pub fn validate(&self) -> Result<(), SettingsError> {
        positive("contact_tolerance", self.contact_tolerance)?;
        not_negative("cluster_radius", self.cluster_radius)?;
        if let Some(angle) = self.split_angle {
            between("split_angle", angle, 60.0, 170.0, "an angle from 60° to 170°")?;
        }
        positive("stiffness", self.stiffness)?;
        not_negative("damping", self.damping)?;
        if let Some(angle) = self.patch_angle {
            between("patch_angle", angle, 0.1, 20.0, "an angle from 0.1° to 20°")?;
        }
        if let Some(shading) = &self.shading {
            between("shading.crease_angle", shading.crease_angle, 0.0, 180.0, "an angle from 0° to 180°")?;
            between("shading.most_turn", shading.most_turn, 0.0, 89.0, "an angle from 0° to 89°")?;
        }
        if let Some(friction) = &self.friction {
            not_negative("friction.dynamic_coefficient", friction.dynamic_coefficient)?;
            not_negative("friction.static_coefficient", friction.static_coefficient)?;
            let rule = "at least friction.dynamic_coefficient";
            let gap = friction.static_coefficient - friction.dynamic_coefficient;
            check(gap >= 0.0, "friction.static_coefficient", friction.static_coefficient, rule)?;
            positive("friction.tangential_stiffness", friction.tangential_stiffness)?;
        }
        if let Some(material) = &self.material {
            let Material { frequency, decay, gain } = *material;
            check((1.0..=1e3).contains(&frequency), "material.frequency", frequency, "from 1 to 1000 Hz")?;
            check((1.0..=1e4).contains(&decay), "material.decay", decay, "from 1 to 10000 1/s")?;
            check((0.0..=1e3).contains(&gain), "material.gain", gain, "from 0 to 1000 N·s/m")?;
        }
        if let Some(coupling) = &self.coupling {
            positive("coupling.stiffness", coupling.stiffness)?;
            not_negative("coupling.damping", coupling.damping)?;
            positive("coupling.angular_stiffness", coupling.angular_stiffness)?;
            not_negative("coupling.angular_damping", coupling.angular_damping)?;
            let within = coupling.contact_offset > 0.0 && coupling.contact_offset <= self.contact_tolerance;
            check(
                within,
                "coupling.contact_offset",
                coupling.contact_offset,
                "greater than 0 and at most contact_tolerance",
            )?;
            not_negative("coupling.mass", coupling.mass)?;
        }
        check(self.limits.force >= 0.0, "limits.force", self.limits.force, "0 or more (infinite for none)")?;
        check(self.limits.torque >= 0.0, "limits.torque", self.limits.torque, "0 or more (infinite for none)")?;
        check(self.grip_a.is_finite(), "grip_a", self.grip_a.length(), "a finite point")?;
        let capacity = self.capacity;
        check((1..=MOST_CONTACTS).contains(&capacity), "capacity", capacity as f64, "from 1 to 1048576")?;
        let budget = self.time_budget.unwrap_or(Self::LEAST_TIME_BUDGET);
        check(budget >= Self::LEAST_TIME_BUDGET, "time_budget", budget as f64, "at least 1000 ns")
    }

    /// Returns the settings of the clustering.
    pub fn linkage(&self) -> LinkageSettings {
        let (radius, most) = match self.clustering {
            Clustering::Linkage => (self.cluster_radius, usize::MAX),
            // With radius 0, every contact is a separate cluster.
            Clustering::Smooth => (0.0, SMOOTH_CONTACTS),
        };
        let (tolerance, contact_offset) = (self.contact_tolerance, self.contact_offset());
        LinkageSettings { tolerance, radius, split_angle: self.split_angle, most, contact_offset }
    }

    /// Returns the separation below which contacts push, m.
    pub fn contact_offset(&self) -> f64 {
        self.coupling.map_or(self.contact_tolerance, |coupling| coupling.contact_offset)
    }

    /// Returns the settings of the penalty force.
    pub fn penalty(&self) -> PenaltySettings {
        PenaltySettings { stiffness: self.stiffness, damping: self.damping }
    }
}

fn check(holds: bool, field: &'static str, value: f64, rule: &'static str) -> Result<(), SettingsError> {
    if holds { Ok(()) } else { Err(SettingsError { field, value, rule }) }
}

fn positive(field: &'static str, value: f64) -> Result<(), SettingsError> {
    check(value.is_finite() && value > 0.0, field, value, "finite and greater than 0")
}

fn not_negative(field: &'static str, value: f64) -> Result<(), SettingsError> {
    check(value.is_finite() && value >= 0.0, field, value, "finite and not negative")
}

fn between(field: &'static str, angle: f64, least: f64, most: f64, rule: &'static str) -> Result<(), SettingsError> {
    check(angle >= least.to_radians() && angle <= most.to_radians(), field, angle, rule)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_setting_is_named() {
        let good = Settings::default();
        assert_eq!(good.validate(), Ok(()));
        let friction = |static_coefficient, dynamic_coefficient, tangential_stiffness| Settings {
            friction: Some(FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness }),
            ..good
        };
        assert_eq!(friction(0.4, 0.3, 500.0).validate(), Ok(()));
        for (settings, field) in [
            (Settings { contact_tolerance: 0.0, ..good }, "contact_tolerance"),
            (Settings { contact_tolerance: f64::NAN, ..good }, "contact_tolerance"),
            (Settings { cluster_radius: -1e-3, ..good }, "cluster_radius"),
            (Settings { split_angle: Some(0.1), ..good }, "split_angle"),
            (Settings { patch_angle: Some(0.0), ..good }, "patch_angle"),
            (Settings { stiffness: f64::INFINITY, ..good }, "stiffness"),
            (Settings { damping: -1.0, ..good }, "damping"),
            (friction(0.3, 0.4, 500.0), "friction.static_coefficient"),
            (friction(0.4, 0.3, 0.0), "friction.tangential_stiffness"),
            (Settings { limits: Limits { force: f64::NAN, torque: 0.0 }, ..good }, "limits.force"),
            (Settings { limits: Limits { force: 1.0, torque: -0.1 }, ..good }, "limits.torque"),
            (Settings { grip_a: DVec3::NAN, ..good }, "grip_a"),
            (Settings { capacity: 0, ..good }, "capacity"),
            (Settings { time_budget: Some(20), ..good }, "time_budget"),
        ] {
            let error = settings.validate().expect_err(field);
            assert_eq!(error.field, field);
            assert!(error.to_string().contains(field));
        }
    }
}
