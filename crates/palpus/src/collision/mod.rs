//! Distance between convex pieces by Voronoi marching, and the descent through two hierarchies
//! \[K02 §3.2\].

mod bounds;
mod clip;
mod counters;
mod front;
mod gjk;
mod leaf_pairs;
mod march;
mod motion_bound;
#[cfg(test)]
mod oracle;
mod proximity;
mod scale;
mod side;
mod step;
mod support;
#[cfg(test)]
mod sweeps;
mod thickness;
mod voronoi;
mod wakes;
mod warm_start;

pub use counters::TraversalCounters;
pub use front::Front;
pub(crate) use front::{IdleLimit, IdleReason, Pace, Represented};
pub use gjk::gjk;
pub use leaf_pairs::{LeafPair, LeafPairs};
pub use march::{initial_features, march};
pub use proximity::{Closest, March, Overlap, Proximity, StopReason};
pub use side::{PlacedPair, Side};
pub(crate) use support::support_gap;
pub(crate) use thickness::Thickness;
pub use warm_start::WarmStart;
