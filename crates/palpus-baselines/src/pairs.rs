//! The pairs of convex pieces that are near each other, found by palpus's own query.

use palpus::algebra::Placement;
use palpus::body::Body;
use palpus::collision::{Front, LeafPair, LeafPairs, PlacedPair, Side};

/// Largest number of pairs in one step, as in `palpus::render::Settings::default`. If there are
/// more, the deepest are kept.
const CAPACITY: usize = 4096;
/// Number of node pairs that the query stores, as in `palpus::detect::ContactQuery`.
const NODE_PAIRS: usize = 1 << 15;

/// The query for near pairs, with its memory.
#[derive(Clone, Debug)]
pub(crate) struct Pairs {
    front: Front,
    found: LeafPairs,
}

impl Pairs {
    pub(crate) fn new(a: &Body, b: &Body) -> Self {
        Self { front: Front::new(side(a), side(b), NODE_PAIRS), found: LeafPairs::new(CAPACITY) }
    }

    /// Returns all pairs that overlap or are nearer than `distance`, m.
    pub(crate) fn within(&mut self, a: &Body, b: &Body, pose_ba: &Placement, distance: f64) -> &[LeafPair] {
        self.front.within(&PlacedPair::new(side(a), side(b), pose_ba, distance), &mut self.found);
        self.found.as_slice()
    }

    pub(crate) fn clear(&mut self) {
        self.front.clear();
    }
}

fn side(body: &Body) -> Side<'_> {
    Side { hierarchy: body.hierarchy(), pieces: body.polytopes() }
}
