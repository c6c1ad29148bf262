//! Settings of tools and of contacts between objects.

use palpus::render::{Clustering, Material, Saturation};
use palpus::{FrictionSettings, Limits, Settings, ShadingSettings, VirtualCoupling};

use crate::body::flag;
use crate::pointer::Out;
use crate::result::{Fault, entry, palpus_result};

/// The most that a device may be asked for; infinite for no limit.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_limits {
    /// N.
    pub force: f64,
    /// N m about the grip.
    pub torque: f64,
}

/// A spring and damper between device and tool, and the tool's mass.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_coupling {
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
    /// N m/rad.
    pub angular_stiffness: f64,
    /// N m s/rad.
    pub angular_damping: f64,
    /// m, above 0 and at most the contact tolerance: contacts push from this separation on.
    pub skin: f64,
    /// kg; 0: the tool is where all forces balance.
    pub mass: f64,
}

/// Smoothed normals.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_shading {
    /// rad: edges where the mesh bends by more stay sharp.
    pub crease_angle: f64,
    /// rad: the farthest that shading may turn a force.
    pub most_turn: f64,
}

/// Stick-slip friction.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_friction {
    /// Coefficient of a contact that sticks; at least the dynamic one.
    pub static_coefficient: f64,
    /// Coefficient of a contact that slides.
    pub dynamic_coefficient: f64,
    /// N/m.
    pub tangential_stiffness: f64,
}

/// How a material rings when it is hit: a vibration that decays.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_material {
    /// Hz.
    pub frequency: f64,
    /// 1/s: it falls to 1/e in one over this.
    pub decay: f64,
    /// N for each m/s of approach.
    pub gain: f64,
}

/// How contact is rendered. Begin with palpus_settings_coupled or palpus_settings_default, and
/// change what you need.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct palpus_settings {
    /// m: contacts are looked for up to this separation. A hundredth of the smaller body suits.
    pub contact_tolerance: f64,
    /// m: with smooth_clusters 0, contacts nearer than this share one force.
    pub cluster_radius: f64,
    /// N/m, of each cluster of contacts.
    pub stiffness: f64,
    /// N s/m, of the normal motion of each cluster.
    pub damping: f64,
    /// rad, 60 to 170 degrees: opening of the cone that holds a cluster's normals. 0: no cut.
    pub split_angle: f64,
    /// rad, 0.1 to 20 degrees: flush pieces touch at the corners of their overlap, for tilts up to
    /// this. 0: one contact for each pair of pieces.
    pub patch_angle: f64,
    /// If has_coupling is 1.
    pub coupling: palpus_coupling,
    /// If has_shading is 1.
    pub shading: palpus_shading,
    /// If has_friction is 1.
    pub friction: palpus_friction,
    /// If has_material is 1. At first that of wood.
    pub material: palpus_material,
    /// Limits of the device.
    pub limits: palpus_limits,
    /// m: where the hand holds the tool, in the tool's frame.
    pub grip: [f64; 3],
    /// The most contacts of a step, 1 to 1048576; of more, the deepest are kept.
    pub capacity: u64,
    /// 1: contacts share force smoothly. 0: exact single linkage, which jumps.
    pub smooth_clusters: u32,
    /// 0: force and torque are limited each by itself. 1: by one factor. 2: the device gives no
    /// torque.
    pub saturation: u32,
    /// 1: a spring ties the tool to the device. 0: the tool is where the device is.
    pub has_coupling: u32,
    /// 1: forces follow smoothed normals.
    pub has_shading: u32,
    /// 1: contacts have friction.
    pub has_friction: u32,
    /// 1: impacts ring, as much as the device's limits leave room for.
    pub has_material: u32,
}

impl palpus_settings {
    /// The engine's settings, which it checks itself when it takes them up.
    pub(crate) fn read(&self) -> Result<Settings, Fault> {
        let palpus_coupling { stiffness, damping, angular_stiffness, angular_damping, skin, mass } = self.coupling;
        let coupling = VirtualCoupling { stiffness, damping, angular_stiffness, angular_damping, skin, mass };
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
            time_budget: None,
            material: flag("has_material", self.has_material)?.then_some(Material { frequency, decay, gain }),
        })
    }
}

impl From<&Settings> for palpus_settings {
    fn from(settings: &Settings) -> Self {
        // Options that are off get values that work once they are turned on.
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
                skin: coupling.skin,
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

/// Fills in direct rendering: 1 mm tolerance, 800 N/m, no coupling, friction or shading.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_settings_default(settings: *mut palpus_settings) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| settings.put((&Settings::default()).into()))
}

/// Fills in a tool that is coupled to a device, as hard as the device can show: `force` (N) and
/// `torque` (N m) are the device's limits, `period` (s) is the loop's, and contacts are looked for
/// within `tolerance` (m). Without friction; for that, set has_friction and the coefficients.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpus_settings_coupled(
    force: f64,
    torque: f64,
    period: f64,
    tolerance: f64,
    settings: *mut palpus_settings,
) -> palpus_result {
    // SAFETY: the caller keeps to the header.
    let settings = unsafe { Out::new(settings, "settings") };
    entry(|| {
        if !(period > 0.0 && period.is_finite()) {
            return Err(Fault::value(format!("period is {period}, but must be a time in s, more than 0")));
        }
        let coupled = Settings::coupled(Limits { force, torque }, period, tolerance);
        coupled.validate()?;
        settings.put((&coupled).into())
    })
}
