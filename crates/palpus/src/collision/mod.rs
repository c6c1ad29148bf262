//! Distance between convex pieces by Voronoi marching, and the descent through two hierarchies \[K02 §3.2\].

mod bounds;
mod clip;
mod coherence;
mod gjk;
mod march;
#[cfg(test)]
mod oracle;
mod proximity;
mod step;
#[cfg(test)]
mod sweeps;
mod traverse;
mod voronoi;

pub use coherence::Memory;
pub use gjk::gjk;
pub use march::{Bounded, March, initial_features, march, march_within};
pub use proximity::{Closest, Overlap, Proximity, StopReason};
pub use traverse::{LeafPair, Side, Traversal, TraversalCounters};
