//! Penetration depth by walking the surface of the Minkowski difference \[K02 §3.3, §3.4\].

mod answer;
mod antipodal;
mod gauss_map;
mod original;
mod overlay;
mod seed;
mod walk;
mod witness;

pub use answer::{Antipodal, Certainty, Depth, HubPair};
