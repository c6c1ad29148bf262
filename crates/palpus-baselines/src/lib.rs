//! Other ways to feel the same contact, built from their papers, so that palpus can be measured
//! against them. Bench-only: nothing of the product depends on this crate.
//!
//! * [`Epa`], after Coal, FCL and most physics engines: a contact is one witness of each
//!   overlapping pair of convex pieces, from the expanding polytope algorithm.
//! * [`Predicted`], after \[GME00\], reference \[16\] of \[K02\]: a contact is the last closest
//!   features of each pair, and how far the motion has taken them past each other.
//! * [`Voxel`], after \[MPT99\], reference \[30\] of \[K02\]: a contact is each point of the
//!   probe's shell that lies in the environment's force field of voxels.
//!
//! All of them render directly, as the paper does: relative pose in, wrench on the probe out.
//! [`Coupled`] puts \[MPT99\]'s virtual coupling around any of them. A [`Baseline`] remembers what
//! its method remembers, and nothing else; it may allocate, and has no deadline. The same calls
//! give the same answers to the last bit.
//!
//! Sources. \[GME00\]: Gregory, Mascarenhas, Ehmann, Lin, Manocha, *Six Degree-of-Freedom Haptic
//! Display of Polygonal Models*, IEEE Visualization 2000. \[MPT99\]: McNeely, Puterbaugh, Troy,
//! *Six Degree-of-Freedom Haptic Rendering Using Voxel Sampling*, SIGGRAPH 1999. \[K02\]: Kim,
//! Otaduy, Lin, Manocha 2002, the paper that palpus starts from.
//!
//! We had the abstracts of \[GME00\] and \[MPT99\], and the description of the two in \[K02\], but
//! not their full texts. Passages in quotation marks were looked up; the other steps are as the two
//! methods are generally described, from memory, without section numbers. Each method's page lists
//! our own choices.
//!
//! Numbers that decide something stand as named constants where they are used: the register in
//! `palpus::algebra::tolerance` is the engine's.

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

/// Contact settings of every method; the names are those of `palpus::render::Settings`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// t, m: bodies push each other from this separation on.
    pub tolerance: f64,
    /// k, N/m.
    pub stiffness: f64,
    /// Grip, in the probe's frame, m.
    pub grip_a: DVec3,
}

impl Default for Settings {
    /// The values of `palpus::render::Settings::default`.
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

/// Answer of a method in one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// On the probe, in b's frame, about the grip.
    pub wrench: Wrench,
    /// Separation of the deepest contact as the method sees it, m, negative when inside; infinite
    /// without contacts.
    pub deepest: f64,
    /// How many contacts push.
    pub contacts: usize,
}

impl Felt {
    /// Nothing within reach.
    pub const NOTHING: Self = Self { wrench: Wrench::ZERO, deepest: f64::INFINITY, contacts: 0 };

    /// Adds a force on the probe at `point`, both in b's frame.
    fn push(&mut self, force: DVec3, point: DVec3, separation: f64, grip: DVec3) {
        self.wrench = self.wrench + Wrench::of_force_at(force, point - grip);
        self.deepest = self.deepest.min(separation);
        self.contacts += 1;
    }
}

/// A way to feel contact.
pub trait Baseline {
    /// One word for a table.
    fn name(&self) -> &'static str;

    /// Computes the wrench at a pose. `pose_ba` places the probe in b's frame; `twist` is the
    /// probe's velocity against b, of the grip and in b's frame; `dt` is the time since the last
    /// step, s. An invalid pose gives zero.
    fn step(&mut self, pose_ba: &Pose, twist: &Twist, dt: f64) -> Felt;

    /// Forgets the past.
    fn clear(&mut self);
}

/// Why a method cannot be set up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BaselineError {
    /// A setting that cannot be.
    #[error("setting `{field}` is {value}, but must be {rule}")]
    Setting {
        /// Its name.
        field: &'static str,
        /// The value.
        value: f64,
        /// The rule that it breaks.
        rule: &'static str,
    },
    /// Voxels that take more memory than allowed.
    #[error("voxels of {} mm take {megabytes:.0} MB, but only {allowed:.0} MB are allowed: take larger ones", voxel * 1e3)]
    TooLarge {
        /// Side of a voxel, m.
        voxel: f64,
        /// Memory that is needed, MB.
        megabytes: f64,
        /// Memory that is allowed, MB.
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
