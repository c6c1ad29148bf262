//! Proof that a depth is globally the least: the certificate, which goes beyond \[K02 §3.3\].
//!
//! The walk ends in a direction n at a local minimum u = h(n). A proof that u is the global minimum
//! is a closed surface within the CSO, around the origin, that stays at least u away from the
//! origin (see the module on the inner surface). If a triangle comes nearer than u, compute the
//! CSO's support along the triangle's normal n':
//!
//! * h(n') is less than u: n' is a better direction, and u becomes h(n').
//! * Otherwise the support lies above the triangle, and the surface grows to it.
//!
//! This repeats, nearest triangle first, until no triangle is nearer than u. Every triangle that
//! grows was nearer than the depth, so no growth is wasted, even while u is only the h of the
//! seeds. Started from a tetrahedron, this is the expanding polytope algorithm (van den Bergen
//! 2001), which finds depth and proof at once; the facet in which its nearest triangle lies gives
//! the exact features. Along a motion the walk comes first, and the proof starts from the last tick's
//! surface. The corners of that surface are pairs of vertices of the bodies, so after a small
//! motion it is still a surface within the CSO. It is measured again, and repaired where it has
//! come too near.
//!
//! 1. Touching pairs: a depth of no more than rounding needs no proof.
//! 2. Most triangles of the kept surface are farther from the origin than u by more than any point
//!    has moved since they were measured; they need no test. Measure the others at the new pose. If
//!    none is too near, the proof is complete.
//! 3. Else measure the whole kept surface at the new pose and grow it where it is too near. If the
//!    repair takes too many growths, grow a new surface from a tetrahedron.
//! 4. Keep the surface. Drop it if it has many more triangles than when it was new: most of them
//!    served earlier poses.
//!
//! The skipped and the measured triangles together form a surface around the origin. It was one
//! when it was last measured as a whole. Since then no triangle has passed over the origin, as long
//! as each has moved less than its distance at its last measurement.
//!
//! Proven means: no direction has an h smaller than the depth by more than
//! [`PROOF_RELATIVE`](crate::algebra::tolerance::PROOF_RELATIVE) of it or by rounding.

mod memory;
mod search;

pub use memory::CertificateMemory;
pub(super) use search::Search;
