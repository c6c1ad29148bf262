//! The certificate: a proof that a depth is the global minimum. \[K02 §3.3\] has no such proof.
//!
//! The walk ends in a direction n at a local minimum u = h(n). To prove that u is the global
//! minimum, the certificate uses a closed surface inside the CSO and around the origin. If every
//! triangle of the surface is at least u away from the origin, u is the global minimum (see the
//! module `inner`). If a triangle is nearer than u, compute the CSO's support along the triangle's
//! normal n':
//!
//! * If h(n') is less than u, n' is a better direction, and u becomes h(n').
//! * Otherwise the support lies above the triangle, and the surface grows to the support.
//!
//! Repeat these steps for the nearest triangle until no triangle is nearer than u. The surface
//! grows only at triangles that are nearer than the depth, so no growth is wasted. This is true
//! even at the start, when u is only the least h of the seeds.
//!
//! If the surface starts as a tetrahedron, the method is the expanding polytope algorithm (van den
//! Bergen 2001), which finds depth and proof together. The nearest triangle lies in a facet of the
//! CSO, and this facet gives the exact features. In coherent motion, a walk comes first, and the
//! proof starts from the surface of the previous tick. The corners of that surface are pairs of
//! vertices of the bodies, so the surface still lies inside the CSO after a small motion. The
//! surface is measured again, and repaired where it is too near to the origin.
//!
//! 1. Touching pairs: a depth within rounding of zero needs no proof.
//! 2. A triangle of the kept surface needs no test if its measured distance exceeds u by more than
//!    any point has moved since. Measure the other triangles at the new pose. If no triangle is too
//!    near, the proof is complete.
//! 3. Otherwise measure the whole kept surface at the new pose, and grow it at triangles that are
//!    too near. If the repair takes too many growth steps, grow a new surface from a tetrahedron.
//! 4. Keep the surface. Drop it if it has many more triangles than when it was new, because only
//!    earlier poses needed most of them.
//!
//! The skipped and the measured triangles together still form a surface around the origin. When the
//! whole surface was last measured, the origin was inside. Since then no triangle has passed over
//! the origin, because each triangle has moved less than its distance at its last measurement.
//!
//! If a depth is proven, no direction has an h that is smaller than the depth by more than the
//! tolerance. The tolerance is the rounding plus the fraction
//! [`PROOF_RELATIVE`](crate::algebra::tolerance::PROOF_RELATIVE) of the depth.

mod memory;
mod search;

pub use memory::CertificateMemory;
pub(super) use search::Search;
