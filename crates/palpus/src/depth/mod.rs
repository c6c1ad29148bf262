//! Penetration depth of convex pieces, by a walk over the surface of their Minkowski difference
//! \[K02 §3.3, §3.4\]. Also the penetration depth of whole bodies, with proven bounds.

mod admissible;
mod answer;
mod antipodal;
mod certificate;
mod clip;
mod cso;
mod gauss_map;
mod global;
mod inner;
#[cfg(test)]
pub(crate) mod oracle;
mod overlay;
mod patch;
mod query;
mod seed;
#[cfg(test)]
mod tests;
mod walk;
mod witness;

pub use admissible::{AdmissibleDepth, AdmissibleScratch, admissible_depth, is_admissible};
pub(crate) use admissible::{admissible_bound, inadmissible_angle, least_admissible_depth};
pub use answer::{Antipodal, Certainty, Depth, HubPair};
pub use certificate::CertificateMemory;
pub use global::{Containment, ContainmentQuery, DepthBracket, GlobalDepth, GlobalMemory, GlobalSettings, Interior};
pub(crate) use patch::{Corner, Patch, Touch};
pub use query::{DepthScratch, depth, depth_proven};
pub use seed::Seed;
