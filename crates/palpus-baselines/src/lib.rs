//! Other haptic rendering methods, implemented from their papers for comparison with palpus. Only
//! benchmarks use these methods: no part of the product depends on this crate.
//!
//! * [`Epa`] follows Coal, FCL and most physics engines: each overlapping pair of convex pieces
//!   gives one contact, with a witness from the expanding polytope algorithm.
//! * [`Predicted`] follows \[GME00\], which is reference \[16\] of \[K02\]: a contact consists of
//!   the last closest features of a pair, and the depth follows from the motion since then.
//! * [`Voxel`] follows \[MPT99\], which is reference \[30\] of \[K02\]: each point of the probe's
//!   shell inside the environment's force field of voxels is a contact.
//!
//! All these methods render directly, like the paper: they take the relative pose and return the
//! wrench on the probe. [`Coupled`] adds the virtual coupling of \[MPT99\] to any of them. A
//! [`Baseline`] stores only the data that its method stores. It may allocate memory, and it has no
//! deadline. Equal sequences of calls give identical results.
//!
//! Sources. \[GME00\]: Gregory, Mascarenhas, Ehmann, Lin, Manocha, *Six Degree-of-Freedom Haptic
//! Display of Polygonal Models*, IEEE Visualization 2000. \[MPT99\]: McNeely, Puterbaugh, Troy,
//! *Six Degree-of-Freedom Haptic Rendering Using Voxel Sampling*, SIGGRAPH 1999. \[K02\]: Kim,
//! Otaduy, Lin, Manocha 2002, the paper that palpus starts from.
//!
//! We had the abstracts of \[GME00\] and \[MPT99\], and the descriptions of both methods in
//! \[K02\], but not the full texts. Quotations were checked. The other steps follow general
//! knowledge of the two methods, so they have no section numbers. The documentation of each method
//! lists our own choices.
//!
//! Each number that affects a result is a named constant in its file. The register in
//! `palpus::algebra::tolerance` is for the engine only.

mod coupled;
mod epa;
mod expand;
mod pairs;
mod predicted;
#[cfg(test)]
mod testing;
mod voxel;

use glam::DVec3;
use palpus::algebra::{Pose, Twist, Wrench};

pub use coupled::{Coupled, CouplingSettings};
pub use epa::Epa;
pub use expand::{Penetration, penetration};
pub use predicted::{Change, Predicted, PredictedSettings};
pub use voxel::{Beyond, Voxel, VoxelSettings};

/// Contact settings of every method, with the names of `palpus::render::Settings`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// t, m: a contact exists below this separation.
    pub tolerance: f64,
    /// k, N/m: stiffness of each contact.
    pub stiffness: f64,
    /// Grip in the probe's frame, m.
    pub grip_a: DVec3,
}

impl Default for Settings {
    /// Returns the values of `palpus::render::Settings::default`.
    fn default() -> Self {
        Self { tolerance: 1e-3, stiffness: 800.0, grip_a: DVec3::ZERO }
    }
}

impl Settings {
    fn validate(&self) -> Result<(), BaselineError> {
        positive("tolerance", self.tolerance)?;
        positive("stiffness", self.stiffness)?;
        if self.grip_a.is_finite() {
            Ok(())
        } else {
            Err(BaselineError::Setting { field: "grip_a", value: self.grip_a.length(), rule: "a finite point" })
        }
    }
}

/// Result of a method in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// Wrench on the probe, in b's frame, about the grip.
    pub wrench: Wrench,
    /// Separation of the deepest contact according to the method, m; negative when overlapping,
    /// infinite without contacts.
    pub deepest: f64,
    /// Number of contacts that give force.
    pub contacts: usize,
}

impl Felt {
    /// Result without contacts.
    pub const NOTHING: Self = Self { wrench: Wrench::ZERO, deepest: f64::INFINITY, contacts: 0 };

    /// Adds a force on the probe at `point`, both in b's frame.
    fn push(&mut self, force: DVec3, point: DVec3, separation: f64, grip: DVec3) {
        self.wrench = self.wrench + Wrench::of_force_at(force, point - grip);
        self.deepest = self.deepest.min(separation);
        self.contacts += 1;
    }
}

/// A haptic rendering method.
pub trait Baseline {
    /// Returns the name of the method, one word for a table.
    fn name(&self) -> &'static str;

    /// Computes the wrench at a pose. `pose_ba` places the probe in b's frame. `twist` is the
    /// velocity of the grip relative to b (m/s and rad/s), in b's frame. `dt` is the time since the
    /// last step, s. An invalid pose gives a zero wrench.
    fn step(&mut self, pose_ba: &Pose, twist: &Twist, dt: f64) -> Felt;

    /// Discards the state of earlier steps.
    fn clear(&mut self);
}

/// The reason why a method cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BaselineError {
    /// A setting is out of range.
    #[error("setting `{field}` is {value}, but must be {rule}")]
    Setting {
        /// Name of the setting.
        field: &'static str,
        /// The value.
        value: f64,
        /// The rule for valid values.
        rule: &'static str,
    },
    /// The voxels take more memory than allowed.
    #[error("voxels of {} mm take {megabytes:.0} MB, but only {allowed:.0} MB are allowed: use larger voxels", voxel * 1e3)]
    TooLarge {
        /// Edge length of a voxel, m.
        voxel: f64,
        /// Required memory, MB.
        megabytes: f64,
        /// Allowed memory, MB.
        allowed: f64,
    },
}

fn positive(field: &'static str, value: f64) -> Result<(), BaselineError> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(BaselineError::Setting { field, value, rule: "finite and greater than 0" })
    }
}
