//! The paper's scenes and scripted hands as code: what you watch is what is tested is what is timed.
//!
//! * [`shape`] — meshes as code, in metres: closed, outward, manifold, free of self-intersection, the same on every call.

pub mod shape;
