//! Proof that a depth is the global minimum (the certificate). It goes beyond \[K02 §3.3\].
//!
//! The walk ends in a direction n at a local minimum u = h(n). To prove that u is the global
//! minimum, the certificate uses a closed surface inside the CSO and around the origin. If every
//! triangle of the surface is at least u away from the origin, u is the global minimum (see the
//! module on the inner surface). If a triangle comes nearer than u, compute the CSO's support along
//! the triangle's normal n':
//!
//! * If h(n') is less than u, n' is a better direction, and u becomes h(n').
//! * Otherwise the support lies above the triangle, and the surface grows to the support.
//!
//! This repeats, nearest triangle first, until no triangle is nearer than u. Every triangle that
//! grows was nearer than the depth, so no growth is wasted, even while u is only the h of the
//! seeds.
//!
//! If the surface starts as a tetrahedron, this is the expanding polytope algorithm (van den Bergen
//! 2001), which finds depth and proof together. The facet in which its nearest triangle lies gives
//! the exact features. Along a motion the walk comes first, and the proof starts from the surface of the
//! previous tick. The corners of that surface are pairs of vertices of the bodies, so after a small
//! motion it still lies inside the CSO. It is measured again, and repaired where it has come too
//! near.
//!
//! 1. Touching pairs: a depth within rounding of zero needs no proof.
//! 2. Most triangles of the kept surface are farther from the origin than u, by more than any point
//!    has moved since they were measured. They need no test. Measure the other triangles at the new
//!    pose. If none is too near, the proof is complete.
//! 3. Otherwise measure the whole kept surface at the new pose, and grow it where it is too near.
//!    If the repair takes too many growths, grow a new surface from a tetrahedron.
//! 4. Keep the surface. Drop it if it has many more triangles than when it was new, because most of
//!    them served earlier poses.
//!
//! The skipped and the measured triangles together still form a surface around the origin. It was
//! one when it was last measured as a whole. Since then no triangle has passed over the origin,
//! because each has moved less than its distance at its last measurement.
//!
//! A proven depth means: no direction has an h that is smaller by more than rounding and a fraction
//! [`PROOF_RELATIVE`](crate::algebra::tolerance::PROOF_RELATIVE) of the depth.

mod memory;
mod search;

pub use memory::CertificateMemory;
pub(super) use search::Search;
