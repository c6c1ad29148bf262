//! Settings of tools and of contacts between objects.

use palpus::render::{Clustering, Material, Saturation};
use palpus::{FrictionSettings, Limits, Settings, ShadingSettings, VirtualCoupling, contact_tolerance};

use crate::body::{body_of, flag, palpus_body};
use crate::pointer::{In, Out};
use crate::result::{Fault, entry, palpus_result};
use crate::value::palpus_pose;

/// Limits of the force and torque that are sent to a device. Infinite means no limit.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_limits {
    /// Maximum force, N.
    pub force: f64,
    /// Maximum torque about the grip, N m.
    pub torque: f64,
}

/// A spring and a damper between the device and the tool, and the tool's mass.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_coupling {
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
    /// Angular stiffness, N m/rad.
    pub angular_stiffness: f64,
    /// Angular damping, N m s/rad.
    pub angular_damping: f64,
    /// Contact offset, m, above 0 and at most the contact tolerance: contacts push below this
    /// separation.
    pub contact_offset: f64,
    /// Mass of the tool, kg. 0: the tool is at the pose where all forces balance.
    pub mass: f64,
}

/// Smoothed normals.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_shading {
    /// Edges where the mesh bends by more than this angle (rad) stay sharp.
    pub crease_angle: f64,
    /// Largest angle by which shading may turn a force, rad.
    pub most_turn: f64,
}

/// Stick-slip friction.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_friction {
    /// Friction coefficient of a contact that sticks. At least the dynamic coefficient.
    pub static_coefficient: f64,
    /// Friction coefficient of a contact that slides.
    pub dynamic_coefficient: f64,
    /// Tangential stiffness, N/m.
    pub tangential_stiffness: f64,
}

/// A decaying vibration that a material makes when it is hit.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_material {
    /// Frequency, Hz.
    pub frequency: f64,
    /// Decay rate, 1/s: the amplitude falls to 1/e in the time 1/decay.
    pub decay: f64,
    /// Amplitude of the force per approach speed, N/(m/s).
    pub gain: f64,
}

/// How contact is rendered. Start with palpus_settings_coupled or palpus_settings_default, and
/// change what you need.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_settings {
    /// Contacts are found up to this separation, m. palpus_contact_tolerance returns a value that
    /// suits two bodies.
    pub contact_tolerance: f64,
    /// If smooth_clusters is 0, contacts closer together than this form one cluster, m.
    pub cluster_radius: f64,
    /// Stiffness of each cluster of contacts, N/m.
    pub stiffness: f64,
    /// Damping of the normal motion of each cluster, N s/m.
    pub damping: f64,
    /// Opening angle of the cone that contains a cluster's normals, rad, 60 to 170 degrees. 0:
    /// clusters are not split.
    pub split_angle: f64,
    /// Flush pieces touch at the corners of their overlap, for tilts up to this angle (rad, 0.1 to
    /// 20 degrees). 0: one contact for each pair of pieces.
    pub patch_angle: f64,
    /// Used if has_coupling is 1.
    pub coupling: palpus_coupling,
    /// Used if has_shading is 1.
    pub shading: palpus_shading,
    /// Used if has_friction is 1.
    pub friction: palpus_friction,
    /// Used if has_material is 1. The default is wood.
    pub material: palpus_material,
    /// Force and torque limits of the device.
    pub limits: palpus_limits,
    /// Point where the tool is held, in the tool's frame, m.
    pub grip: [f64; 3],
    /// Maximum number of contacts of a step, 1 to 1048576. If there are more, the deepest are kept.
    pub capacity: u64,
    /// Time that a step should take at most, s. Each step limits its work to what it can do in this
    /// time, as the time of earlier steps shows. palpus_settings_coupled sets 0.6 of the period. 0:
    /// any time; equal calls then give equal bits.
    pub time_budget: f64,
    /// 1: contacts share force smoothly. 0: exact single linkage, whose clusters change abruptly.
    pub smooth_clusters: u32,
    /// 0: force and torque are limited separately. 1: both are scaled by one factor. 2: the device
    /// has no torque output.
    pub saturation: u32,
    /// 1: a spring couples the tool to the device. 0: the tool is at the device's pose.
    pub has_coupling: u32,
    /// 1: forces follow smoothed normals.
    pub has_shading: u32,
    /// 1: contacts have friction.
    pub has_friction: u32,
    /// 1: impacts cause vibration, as far as the device's limits allow.
    pub has_material: u32,
}

impl palpus_settings {
    /// Returns the engine's settings. The engine checks the values later.
    pub(crate) fn read(&self) -> Result<Settings, Fault> {
        let palpus_coupling { stiffness, damping, angular_stiffness, angular_damping, contact_offset, mass } =
            self.coupling;
        let coupling = VirtualCoupling { stiffness, damping, angular_stiffness, angular_damping, contact_offset, mass };
        let palpus_shading { crease_angle, most_turn } = self.shading;
        let palpus_friction { static_coefficient, dynamic_coefficient, tangential_stiffness } = self.friction;
        let friction = FrictionSettings { static_coefficient, dynamic_coefficient, tangential_stiffness };
        let palpus_material { frequency, decay, gain } = self.material;
        Ok(Settings {
            contact_tolerance: self.contact_tolerance,
            cluster_radius: self.cluster_radius,
            clustering: match flag("smooth_clusters", self.smooth_clusters)? {
                true => Clustering::Smooth,
                false => Clustering::Linkage,
            },
            split_angle: (self.split_angle != 0.0).then_some(self.split_angle),
            stiffness: self.stiffness,
            damping: self.damping,
            patch_angle: (self.patch_angle != 0.0).then_some(self.patch_angle),
            shading: flag("has_shading", self.has_shading)?.then_some(ShadingSettings { crease_angle, most_turn }),
            friction: flag("has_friction", self.has_friction)?.then_some(friction),
            coupling: flag("has_coupling", self.has_coupling)?.then_some(coupling),
            limits: Limits { force: self.limits.force, torque: self.limits.torque },
            saturation: match self.saturation {
                0 => Saturation::Separate,
                1 => Saturation::Joint,
                2 => Saturation::UnderActuated,
                other => return Err(Fault::value(format!("saturation is {other}, but must be 0, 1 or 2"))),
            },
            grip_a: self.grip.into(),
            capacity: usize::try_from(self.capacity).unwrap_or(usize::MAX),
            time_budget: self.time_budget()?,
            material: flag("has_material", self.has_material)?.then_some(Material { frequency, decay, gain }),
        })
    }

    /// Returns the time budget in ns. The engine's text for a wrong value would name ns, too.
    fn time_budget(&self) -> Result<Option<u64>, Fault> {
        let least = Settings::LEAST_TIME_BUDGET as f64 / 1e9;
        match self.time_budget {
            0.0 => Ok(None),
            seconds if seconds >= least => Ok(Some((seconds * 1e9).round() as u64)),
            other => Err(Fault::value(format!("time_budget is {other}, but must be 0 or at least {least} s"))),
        }
    }
}

impl From<&Settings> for palpus_settings {
    fn from(settings: &Settings) -> Self {
        // Options that are off get values that are usable when they are turned on.
        let tuned = || VirtualCoupling::tuned(&settings.limits, 1e-3, settings.contact_tolerance);
        let coupling = settings.coupling.unwrap_or_else(tuned);
        let shading = settings.shading.unwrap_or(ShadingSettings { crease_angle: 0.6, most_turn: 0.5 });
        let friction = settings.friction.unwrap_or(FrictionSettings {
            static_coefficient: 0.0,
            dynamic_coefficient: 0.0,
            tangential_stiffness: settings.stiffness,
        });
        let material = settings.material.unwrap_or(Material::WOOD);
        Self {
            contact_tolerance: settings.contact_tolerance,
            cluster_radius: settings.cluster_radius,
            stiffness: settings.stiffness,
            damping: settings.damping,
            split_angle: settings.split_angle.unwrap_or(0.0),
            patch_angle: settings.patch_angle.unwrap_or(0.0),
            coupling: palpus_coupling {
                stiffness: coupling.stiffness,
                damping: coupling.damping,
                angular_stiffness: coupling.angular_stiffness,
                angular_damping: coupling.angular_damping,
                contact_offset: coupling.contact_offset,
                mass: coupling.mass,
            },
            shading: palpus_shading { crease_angle: shading.crease_angle, most_turn: shading.most_turn },
            friction: palpus_friction {
                static_coefficient: friction.static_coefficient,
                dynamic_coefficient: friction.dynamic_coefficient,
                tangential_stiffness: friction.tangential_stiffness,
            },
            material: palpus_material { frequency: material.frequency, decay: material.decay, gain: material.gain },
            limits: palpus_limits { force: settings.limits.force, torque: settings.limits.torque },
            grip: settings.grip_a.to_array(),
            capacity: settings.capacity as u64,
            time_budget: settings.time_budget.map_or(0.0, |ns| ns as f64 * 1e-9),
            smooth_clusters: (settings.clustering == Clustering::Smooth).into(),
            saturation: match settings.saturation {
                Saturation::Separate => 0,
                Saturation::Joint => 1,
                Saturation::UnderActuated => 2,
            },
            has_coupling: settings.coupling.is_some().into(),
            has_shading: settings.shading.is_some().into(),
            has_friction: settings.friction.is_some().into(),
            has_material: settings.material.is_some().into(),
        }
    }
}

/// Fills in direct rendering: tolerance 1 mm, stiffness 800 N/m, no coupling, shading or friction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_settings_default(settings: *mut palpus_settings) -> palpus_result {
    // SAFETY: the caller follows the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| settings.put((&Settings::default()).into()))
}

/// Fills in a tool that is coupled to a device, as stiff as the device can render stably. `force`
/// (N) and `torque` (N m) are the device's limits, `period` (s) is the period of the haptic loop,
/// and contacts are found within `tolerance` (m), see palpus_contact_tolerance. There is no
/// friction; to add it, set has_friction and the coefficients.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_settings_coupled(
    force: f64,
    torque: f64,
    period: f64,
    tolerance: f64,
    settings: *mut palpus_settings,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| {
        if !(period > 0.0 && period.is_finite()) {
            return Err(Fault::value(format!("period is {period}, but must be a time above 0 s")));
        }
        let coupled = Settings::coupled(Limits { force, torque }, period, tolerance);
        coupled.validate()?;
        settings.put((&coupled).into())
    })
}

/// Returns a contact tolerance (m) that suits two bodies: the smallest of 1 mm, a hundredth of the
/// smaller body's size, and half of the play of parts that fit into each other. `pose_ba` is the
/// pose of a in b's frame. Parts with play must fit into each other there; the search for their
/// play takes up to a second. If more than two bodies can touch each other, take the smallest value
/// of all pairs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_contact_tolerance(
    a: palpus_body,
    b: palpus_body,
    pose_ba: *const palpus_pose,
    tolerance: *mut f64,
) -> palpus_result {
    // SAFETY: the caller follows the header.
    let (pose, tolerance) = unsafe { (In::new(pose_ba, "pose_ba"), Out::new(tolerance, "tolerance")) };
    entry(|| {
        tolerance.check()?;
        let pose = pose.get()?.checked().map_err(|fault| fault.of("pose_ba"))?;
        let [a, b] = [body_of(a)?, body_of(b)?];
        tolerance.put(contact_tolerance(&a.body, &b.body, &pose))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_the_engine_come_back() {
        let limits = Limits { force: 8.5, torque: 0.19 };
        for period in [1e-3, 2.5e-4, 1.0 / 3000.0] {
            let settings = Settings::coupled(limits, period, 2e-4).with_friction(0.4, 0.3);
            assert_eq!(palpus_settings::from(&settings).read().ok(), Some(settings));
        }
        assert_eq!(palpus_settings::from(&Settings::default()).read().ok(), Some(Settings::default()));
        for time_budget in [f64::NAN, -1.0, 0.9e-6] {
            let bad = palpus_settings { time_budget, ..(&Settings::default()).into() };
            assert!(bad.read().is_err(), "{time_budget}");
        }
    }
}
