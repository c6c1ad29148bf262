//! Clusters, penalty force, shading, friction \[K02 §4\].

mod cluster;
#[cfg(test)]
mod cluster_tests;
mod friction;
mod load_sharing;
mod penalty;
mod representative;
mod shading;
mod smooth_body;
mod smooth_surface;
#[cfg(test)]
pub(crate) mod testing;
mod tilt;

pub use cluster::{Linkage, LinkageCounters, LinkageSettings};
pub use friction::{Adhesion, FrictionCounters, FrictionInput, FrictionSettings, FrictionTracker, Grip};
pub use load_sharing::LoadSharing;
pub use penalty::{Centers, NetWrench, PenaltySettings, normal_force};
pub use representative::{Cluster, represent};
pub use shading::{ShadingSettings, SmoothNormal, shade};
pub use smooth_body::SmoothBody;
pub use tilt::{TiltShares, Tilted};
