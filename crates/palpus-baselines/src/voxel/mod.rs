//! Voxel sampling after \[MPT99\], which is reference \[30\] of \[K02\]: a shell of points in a
//! map of voxels.
//!
//! 1. *Voxmap*: the environment is converted to voxels. Each voxel is free space, interior, surface
//!    or proximity (two bits in \[MPT99\]). Surface voxels are the voxels that a triangle meets.
//! 2. *Point shell*: the centres of the probe's surface voxels, at the same voxel size, each with
//!    the mean inward normal of the surface there.
//! 3. *Tangent-plane force*: for a point in a voxel of the force field, take the plane through the
//!    voxel's centre that is perpendicular to the *point's* normal. Here d is the depth of the
//!    point below the plane, towards the environment. The force is K d along the normal. So the
//!    force does not depend on the environment's normals.
//! 4. *Virtual stiffness*: all forces and torques are added up. If more than ten points are in
//!    contact, the sum is divided by a tenth of their number. So finer sampling does not make the
//!    contact stiffer.
//! 5. *Collision offset*: "a short-range force field surrounding the static objects, which repels
//!    the manipulated object and strives to maintain a voxel-scale minimum separation" (abstract).
//!    The field is a layer of proximity voxels outside the surface.
//! 6. *Pre-contact braking* (\[K02 §2.3\]: "braking forces \[30\], which have a viscous nature"): a
//!    force in the layer outside the field, against the approach velocity of the point.
//! 7. *Virtual coupling* ("force discontinuities arising from the use of a simple penalty force
//!    model are mitigated by a dynamic simulation based on virtual coupling", abstract):
//!    [`Coupled`](crate::Coupled) implements it. Without the coupling, this method renders
//!    directly, like the other methods.
//!
//! Our choices, since the full text was not at hand:
//!
//! * K is a tenth of the settings' k. So ten or more points are as stiff as one contact of the
//!   other methods, and a tip of one point is softer. If [`VoxelSettings::full`] is 1 instead of
//!   10, the forces of all points are averaged, and a tip is as stiff as a face.
//! * The default offset equals the contact tolerance t, within half a voxel. So forces begin at the
//!   same separation as in the other methods. This method has no other tolerance.
//! * Points behind the field use the plane of the nearest voxel of the field, at any depth
//!   ([`Beyond::Nearest`]). The abstract's "short-range" rather means a field of one layer
//!   ([`Beyond::Nothing`]). But in direct rendering, a hand would fall through such a field.
//! * Braking is off by default. Braking removes energy from a simulated mass, and direct rendering
//!   has no simulated mass.
//! * Voxels are stored in a dense block instead of a tree with 512 children per node. The results
//!   are equal, and the memory is bounded ([`VoxelSettings::memory`]).
//! * The winding number of the mesh decides whether a connected region is interior. This decision
//!   is used only to find the voxels behind the field.

mod grid;
mod map;

use std::sync::Arc;

use palpus::algebra::{Pose, Twist, Wrench};
use palpus::body::Body;

use self::map::{Kind, MOST_LAYERS, ShellPoint, Voxmap, point_shell};
use crate::{Baseline, BaselineError, Felt, Settings, positive};

/// Default number of voxels along the environment's longest side.
const ALONG: f64 = 100.0;
/// Default limit of the voxel size, m: the default contact tolerance.
const LARGEST: f64 = 1e-3;

/// Settings of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelSettings {
    /// Contact settings.
    pub contact: Settings,
    /// Edge length of a voxel, m; `None` for a hundredth of the environment's longest side, at most
    /// 1 mm.
    pub voxel: Option<f64>,
    /// Number of voxel layers from the surface out to the force field, 0 to 64; `None` for the
    /// contact tolerance divided by the voxel size, rounded.
    pub offset: Option<u32>,
    /// Number of points in contact beyond which the stiffness of the contact does not grow: 10 in
    /// \[MPT99\]. Each point has the stiffness k divided by this number.
    pub full: u32,
    /// Force on points behind the force field.
    pub beyond: Beyond,
    /// Damping of each point that approaches in the layer outside the field, N·s/m; 0 for no
    /// braking.
    pub braking: f64,
    /// Largest memory of a voxel map, bytes.
    pub memory: usize,
}

/// Force on points that have passed the force field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// No force.
    Nothing,
    /// The force of the nearest voxel of the field.
    Nearest,
}

impl Default for VoxelSettings {
    fn default() -> Self {
        Self {
            contact: Settings::default(),
            voxel: None,
            offset: None,
            full: 10,
            beyond: Beyond::Nearest,
            braking: 0.0,
            memory: 512 << 20,
        }
    }
}

/// The voxel method; the module describes its steps. Clones share the shell and the map.
#[derive(Clone, Debug)]
pub struct Voxel {
    shell: Arc<[ShellPoint]>,
    map: Arc<Voxmap>,
    settings: VoxelSettings,
}

impl Voxel {
    /// Creates the method for probe `a` and environment `b`.
    ///
    /// # Errors
    /// Fails if a setting is invalid, or if the voxels need more memory than allowed.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: VoxelSettings) -> Result<Self, BaselineError> {
        settings.contact.validate()?;
        let bounds = b.mesh().bounds();
        let size = settings.voxel.unwrap_or(((bounds.max - bounds.min).max_element() / ALONG).min(LARGEST));
        positive("voxel", size)?;
        if settings.braking != 0.0 {
            positive("braking", settings.braking)?;
        }
        positive("full", f64::from(settings.full))?;
        // Very large numbers saturate in the conversion, and are then refused.
        let offset = settings.offset.unwrap_or((settings.contact.tolerance / size).round() as u32);
        if offset > MOST_LAYERS {
            return Err(BaselineError::Setting { field: "offset", value: f64::from(offset), rule: "0 to 64" });
        }
        let map = Voxmap::new(&b, size, offset, settings.memory)?;
        let shell = point_shell(&a, size, settings.memory)?;
        Ok(Self { shell: shell.into(), map: Arc::new(map), settings })
    }

    /// Returns the number of points of the probe's shell.
    pub fn points(&self) -> usize {
        self.shell.len()
    }
}

impl Baseline for Voxel {
    fn name(&self) -> &'static str {
        "voxel"
    }

    fn step(&mut self, pose_ba: &Pose, twist: &Twist, _dt: f64) -> Felt {
        if !pose_ba.is_valid() {
            return Felt::NOTHING;
        }
        let place = pose_ba.placement();
        let grip = place.point(self.settings.contact.grip_a);
        let full = f64::from(self.settings.full);
        let stiffness = self.settings.contact.stiffness / full;
        let mut felt = Felt::NOTHING;
        let mut brake = Wrench::ZERO;
        for point in self.shell.iter() {
            let at = place.point(point.center);
            let (kind, center) = self.map.at(at);
            match kind {
                Kind::Force => {}
                Kind::Behind if self.settings.beyond == Beyond::Nearest => {}
                Kind::Braking if self.settings.braking > 0.0 => {
                    let inward = place.vector(point.inward);
                    let approach = -twist.at(at - grip).dot(inward);
                    let force = inward * (self.settings.braking * approach.max(0.0));
                    brake = brake + Wrench::of_force_at(force, at - grip);
                    continue;
                }
                _ => continue,
            }
            let inward = place.vector(point.inward);
            let depth = (center - at).dot(inward);
            if depth > 0.0 {
                felt.push(inward * (stiffness * depth), at, -depth, grip);
            }
        }
        let share = (full / felt.contacts as f64).min(1.0);
        felt.wrench = Wrench { torque: felt.wrench.torque * share, force: felt.wrench.force * share } + brake;
        felt
    }

    fn clear(&mut self) {}
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use palpus_scenes::shape;

    use super::*;
    use crate::testing;

    const VOXEL: f64 = 1e-3;

    fn with(a: Arc<Body>, b: Arc<Body>, change: impl Fn(&mut VoxelSettings)) -> Voxel {
        let mut settings = VoxelSettings {
            contact: testing::SETTINGS,
            voxel: Some(VOXEL),
            offset: Some(0),
            ..VoxelSettings::default()
        };
        change(&mut settings);
        Voxel::new(a, b, settings).expect("the settings are valid")
    }

    /// Half thickness of a small table, m. The poses below are relative to its top.
    const TOP: f64 = 0.005;

    fn slab() -> Arc<Body> {
        testing::body(&shape::cuboid(DVec3::new(0.090, 0.070, 2.0 * TOP)))
    }

    fn block() -> Arc<Body> {
        testing::body(&shape::cuboid(DVec3::new(0.060, 0.040, 0.030)))
    }

    /// Returns a pose above the slab, with the probe's centre at `height` (m) over its top.
    fn over(height: f64) -> Pose {
        Pose::from_translation(DVec3::new(0.0023, -0.0017, TOP + height))
    }

    fn make(a: Arc<Body>, b: Arc<Body>, contact: Settings) -> Box<dyn Baseline> {
        Box::new(with(a, b, |settings| settings.contact = contact))
    }

    /// Moves a body down onto the table. The force must agree with a spring of equal stiffness, if
    /// each surface is moved by at most half a voxel.
    fn down(a: Arc<Body>, lowest: f64, slack: f64) {
        let mut method = with(a, slab(), |_| ());
        for tick in 0..50 {
            let height = 2e-3 - 1e-4 * f64::from(tick);
            let felt = method.step(&over(height - lowest), &Twist::default(), 1e-3);
            assert!((felt.deepest - height).abs() < slack || felt.contacts == 0, "{felt:?} at {height}");
            assert!(height > -slack || felt.contacts > 0, "{felt:?} at {height}");
            assert!(height < slack || felt.contacts == 0, "{felt:?} at {height}");
            let most = testing::SETTINGS.stiffness * (slack - height).max(0.0);
            assert!(felt.wrench.force.z >= 0.0 && felt.wrench.force.z <= most, "{felt:?} at {height}");
        }
    }

    #[test]
    fn ball_and_box_on_a_table_are_pushed_up_within_a_voxel() {
        // The error is half a voxel for each flat surface, and half of the voxel's diagonal for
        // each round surface.
        down(block(), -0.015, VOXEL + 1e-9);
        down(testing::ball(), -0.012, 1.5 * VOXEL);
    }

    #[test]
    fn flat_box_has_the_stiffness_of_the_settings() {
        let mut method = with(block(), slab(), |_| ());
        let mut force = |height: f64| {
            let felt = method.step(&over(0.015 + height), &Twist::default(), 1e-3);
            assert!(felt.contacts > 2000, "the whole face must be in contact: {felt:?}");
            // Points on the box's sides are in contact too. They push sideways, depending on their
            // positions in the voxels.
            assert!(felt.wrench.force.truncate().length() < 0.02 * felt.wrench.force.z, "{felt:?}");
            felt.wrench.force.z
        };
        // The bottom layer has the stiffness of ten points, reduced a little by points on the
        // sides.
        let (less, more) = (force(-1.2e-3), force(-1.3e-3));
        let stiffness = (more - less) / 1e-4;
        assert!((stiffness / testing::SETTINGS.stiffness - 1.0).abs() < 0.08, "{stiffness}");
    }

    #[test]
    fn same_steps_give_identical_results() {
        testing::same_again(make);
    }

    #[test]
    fn field_of_one_layer_gives_no_force_behind_it() {
        let through = |beyond| {
            let mut method = with(block(), slab(), |settings| settings.beyond = beyond);
            method.step(&over(0.015 - 4e-3), &Twist::default(), 1e-3).wrench.force
        };
        let (nearest, nothing) = (through(Beyond::Nearest), through(Beyond::Nothing));
        assert!(nearest.z > 1.5, "{nearest}");
        assert!(nothing.z.abs() < 0.01 && nothing.length() < 0.2, "only the sides may give a small force: {nothing}");
    }

    #[test]
    fn offset_field_acts_outside_the_surface_and_brakes() {
        let speed = 0.1;
        let twist = Twist { angular: DVec3::ZERO, linear: DVec3::Z * -speed };
        let mut method = with(testing::ball(), slab(), |settings| {
            settings.offset = Some(2);
            settings.braking = 0.5;
        });
        let mut at = |height: f64, twist: &Twist| method.step(&over(0.012 + height), twist, 1e-3);
        assert!(at(0.5e-3, &twist).contacts > 0, "two layers must be thicker than 0.5 mm");
        assert_eq!(at(6e-3, &twist), Felt::NOTHING);
        let mut brakes = |twist: &Twist| {
            let felt: Vec<Felt> = (20..40).map(|k| at(1e-4 * f64::from(k), twist)).collect();
            felt.iter().filter(|felt| felt.contacts == 0 && felt.wrench.force.z > 0.0).count()
        };
        assert!(brakes(&twist) > 3, "an approaching ball must be braked before contact");
        assert_eq!(brakes(&Twist { linear: -twist.linear, ..twist }), 0, "a receding ball must not be braked");
    }

    #[test]
    fn invalid_setting_is_named() {
        let fails = |change: &dyn Fn(&mut VoxelSettings)| {
            let mut settings = VoxelSettings::default();
            change(&mut settings);
            Voxel::new(testing::ball(), slab(), settings).err()
        };
        let error = fails(&|settings| (settings.voxel, settings.offset) = (Some(1e-5), Some(0)))
            .expect("such small voxels are refused");
        assert!(matches!(error, BaselineError::TooLarge { .. }), "{error}");
        assert!(error.to_string().contains("MB"), "{error}");
        let error = fails(&|settings| settings.offset = Some(65));
        assert!(matches!(error, Some(BaselineError::Setting { field: "offset", .. })), "{error:?}");
        let error = fails(&|settings| settings.voxel = Some(f64::NAN));
        assert!(matches!(error, Some(BaselineError::Setting { field: "voxel", .. })), "{error:?}");
    }
}
