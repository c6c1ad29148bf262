//! Voxel sampling after \[MPT99\], reference \[30\] of \[K02\]: a shell of points in a map of
//! voxels.
//!
//! 1. *Voxmap*: the environment by scan conversion, each voxel one of free space, interior,
//!    surface, proximity (two bits in \[MPT99\]). Surface voxels are those that a triangle meets.
//! 2. *Point shell*: the centres of the surface voxels of the probe, at the same voxel size, each
//!    with the mean inward normal of the surface there.
//! 3. *Tangent-plane force*: a point in a voxel of the force field; through the voxel's centre the
//!    plane across the *point's* normal; d is how far the point lies below it; the force is K d
//!    along the normal. Below means towards the environment, so that force sets in and vanishes
//!    without knowing its surface.
//! 4. *Virtual stiffness*: all forces and torques are added up; of more than ten points in contact
//!    the sum is divided by a tenth of their number, so that the whole is not stiffer the finer it
//!    is sampled.
//! 5. *Collision offset*: "a short-range force field surrounding the static objects, which repels
//!    the manipulated object and strives to maintain a voxel-scale minimum separation" (abstract):
//!    the field is a layer of proximity voxels outside the surface.
//! 6. *Pre-contact braking* (\[K02 §2.3\]: "braking forces \[30\], which have a viscous nature"):
//!    in the layer outside the field, against the point's velocity of approach.
//! 7. *Virtual coupling* ("force discontinuities arising from the use of a simple penalty force
//!    model are mitigated by a dynamic simulation based on virtual coupling", abstract) is no part
//!    of the force model: [`Coupled`](crate::Coupled) has it. Without, this method is direct as the
//!    others are.
//!
//! Our choices, since the full text was not at hand:
//!
//! * K is a tenth of the settings' k: a contact of ten points or more then is as stiff as one
//!   contact of the other methods, and a tip of one point is softer. With [`VoxelSettings::full`] 1
//!   instead of ten the points' forces are averaged, and a tip is as stiff as a face.
//! * The offset makes the contact tolerance t, within half a voxel: objects then push each other
//!   from the same separation on as with the other methods. This model has no other tolerance.
//! * Points that have got behind the field feel the plane of the nearest voxel of the field, to
//!   unlimited depth ([`Beyond::Nearest`]): kinder than a field of one layer, through which a hand
//!   with nothing but direct forces falls ([`Beyond::Nothing`], which is as near to the abstract's
//!   "short-range" as we can tell).
//! * Braking is off by default: it takes the energy of a simulated mass, of which direct rendering
//!   has none.
//! * Voxels are a dense block, not a tree with 512 children a node: the answers are the same, the
//!   memory is capped ([`VoxelSettings::memory`]).
//! * Interior is what the mesh's winding number says of each part of the rest that hangs together;
//!   it only decides what is behind the field.

mod grid;
mod map;

use std::sync::Arc;

use palpus::algebra::{Pose, Twist, Wrench};
use palpus::body::Body;

use self::map::{Kind, MOST_LAYERS, ShellPoint, Voxmap, point_shell};
use crate::{Baseline, BaselineError, Felt, Settings, positive};

/// Voxels along the environment's longest side, unless it is said otherwise.
const ALONG: f64 = 100.0;
/// m: the largest voxel unless it is said otherwise; the usual contact tolerance.
const LARGEST: f64 = 1e-3;

/// Settings of the method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelSettings {
    /// Contact settings.
    pub contact: Settings,
    /// Side of a voxel, m; `None`: a hundredth of the environment's longest side, at most 1 mm.
    pub voxel: Option<f64>,
    /// Layers of voxels from the surface out to the force field, 0 to 64; `None`: as many as make
    /// the contact tolerance, rounded.
    pub offset: Option<u32>,
    /// Points in contact beyond which the sum of their forces grows no more: 10 \[MPT99\]. Each has
    /// this share of the stiffness.
    pub full: u32,
    /// Force on points behind the force field.
    pub beyond: Beyond,
    /// Damping of each point that approaches in the layer outside the field, N·s/m; 0 for none.
    pub braking: f64,
    /// The most that a map may take, bytes.
    pub memory: usize,
}

/// Treatment of points that have passed the force field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// Nothing more.
    Nothing,
    /// The plane of the nearest voxel of the field.
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

/// See the module's outline. Clones share the shell and the map.
#[derive(Clone, Debug)]
pub struct Voxel {
    shell: Arc<[ShellPoint]>,
    map: Arc<Voxmap>,
    settings: VoxelSettings,
}

impl Voxel {
    /// Fails if a setting is invalid, or if the voxels take more memory than allowed.
    pub fn new(a: Arc<Body>, b: Arc<Body>, settings: VoxelSettings) -> Result<Self, BaselineError> {
        settings.contact.validate()?;
        let bounds = b.mesh().bounds();
        let size = settings.voxel.unwrap_or(((bounds.max - bounds.min).max_element() / ALONG).min(LARGEST));
        positive("voxel", size)?;
        if settings.braking != 0.0 {
            positive("braking", settings.braking)?;
        }
        positive("full", f64::from(settings.full))?;
        // Too many layers saturate the conversion, and are rejected.
        let offset = settings.offset.unwrap_or((settings.contact.tolerance / size).round() as u32);
        if offset > MOST_LAYERS {
            return Err(BaselineError::Setting { field: "offset", value: f64::from(offset), rule: "0 to 64" });
        }
        let map = Voxmap::new(&b, size, offset, settings.memory)?;
        let shell = point_shell(&a, size, settings.memory)?;
        Ok(Self { shell: shell.into(), map: Arc::new(map), settings })
    }

    /// How many points the probe's shell has.
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
        Voxel::new(a, b, settings).expect("good settings")
    }

    /// A small table, its top in the plane z = 0 of the poses below.
    const TOP: f64 = 0.005;

    fn slab() -> Arc<Body> {
        testing::body(&shape::cuboid(DVec3::new(0.090, 0.070, 2.0 * TOP)))
    }

    fn block() -> Arc<Body> {
        testing::body(&shape::cuboid(DVec3::new(0.060, 0.040, 0.030)))
    }

    /// Somewhere on the slab, the probe's middle this high over its top.
    fn over(height: f64) -> Pose {
        Pose::from_translation(DVec3::new(0.0023, -0.0017, TOP + height))
    }

    fn make(a: Arc<Body>, b: Arc<Body>, contact: Settings) -> Box<dyn Baseline> {
        Box::new(with(a, b, |settings| settings.contact = contact))
    }

    /// Lets a body down onto the table, whose top the voxels know within a half, and holds what is
    /// felt against a spring of the same stiffness between two surfaces known within a voxel.
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
    fn a_ball_and_a_box_on_a_table_are_pushed_up_within_a_voxel() {
        // Half a voxel for either surface; for round ones by half its diagonal.
        down(block(), -0.015, VOXEL + 1e-9);
        down(testing::ball(), -0.012, 1.5 * VOXEL);
    }

    #[test]
    fn a_flat_box_feels_the_stiffness_of_the_settings() {
        let mut method = with(block(), slab(), |_| ());
        let mut force = |height: f64| {
            let felt = method.step(&over(0.015 + height), &Twist::default(), 1e-3);
            assert!(felt.contacts > 2000, "all of the face: {felt:?}");
            // The box's side points are in contact too, and push sideways by how they lie in their
            // voxels.
            assert!(felt.wrench.force.truncate().length() < 0.02 * felt.wrench.force.z, "{felt:?}");
            felt.wrench.force.z
        };
        // The bottom layer stands for ten points' worth of a tenth of the stiffness, thinned by
        // some points of the sides.
        let (less, more) = (force(-1.2e-3), force(-1.3e-3));
        let stiffness = (more - less) / 1e-4;
        assert!((stiffness / testing::SETTINGS.stiffness - 1.0).abs() < 0.08, "{stiffness}");
    }

    #[test]
    fn the_same_steps_feel_the_same() {
        testing::same_again(make);
    }

    #[test]
    fn behind_a_field_of_one_layer_there_is_nothing() {
        let through = |beyond| {
            let mut method = with(block(), slab(), |settings| settings.beyond = beyond);
            method.step(&over(0.015 - 4e-3), &Twist::default(), 1e-3).wrench.force
        };
        let (nearest, nothing) = (through(Beyond::Nearest), through(Beyond::Nothing));
        assert!(nearest.z > 1.5, "{nearest}");
        assert!(nothing.z.abs() < 0.01 && nothing.length() < 0.2, "only how the sides lie in their voxels: {nothing}");
    }

    #[test]
    fn an_offset_field_keeps_its_distance_and_brakes_outside() {
        let speed = 0.1;
        let twist = Twist { angular: DVec3::ZERO, linear: DVec3::Z * -speed };
        let mut method = with(testing::ball(), slab(), |settings| {
            settings.offset = Some(2);
            settings.braking = 0.5;
        });
        let mut at = |height: f64, twist: &Twist| method.step(&over(0.012 + height), twist, 1e-3);
        assert!(at(0.5e-3, &twist).contacts > 0, "two layers are thicker than 0.5 mm");
        assert_eq!(at(6e-3, &twist), Felt::NOTHING);
        let mut brakes = |twist: &Twist| {
            let felt: Vec<Felt> = (20..40).map(|k| at(1e-4 * f64::from(k), twist)).collect();
            felt.iter().filter(|felt| felt.contacts == 0 && felt.wrench.force.z > 0.0).count()
        };
        assert!(brakes(&twist) > 3, "on its way in the ball is braked before there is contact");
        assert_eq!(brakes(&Twist { linear: -twist.linear, ..twist }), 0, "on its way out it is not");
    }

    #[test]
    fn what_cannot_be_is_said() {
        let fails = |change: &dyn Fn(&mut VoxelSettings)| {
            let mut settings = VoxelSettings::default();
            change(&mut settings);
            Voxel::new(testing::ball(), slab(), settings).err()
        };
        let error = fails(&|settings| (settings.voxel, settings.offset) = (Some(1e-5), Some(0))).expect("too fine");
        assert!(matches!(error, BaselineError::TooLarge { .. }), "{error}");
        assert!(error.to_string().contains("MB"), "{error}");
        let error = fails(&|settings| settings.offset = Some(65));
        assert!(matches!(error, Some(BaselineError::Setting { field: "offset", .. })), "{error:?}");
        let error = fails(&|settings| settings.voxel = Some(f64::NAN));
        assert!(matches!(error, Some(BaselineError::Setting { field: "voxel", .. })), "{error:?}");
    }
}
