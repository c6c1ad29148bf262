//! Counters of a query: its cost and its events.

use crate::algebra::tolerance::{WORK_PATCH, WORK_STEP, WORK_WALK};
use crate::collision::TraversalCounters;

/// Counters of a query: its cost and its events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryCounters {
    /// Counters of the descent, and of the search for the nearest pair if requested.
    pub traversal: TraversalCounters,
    /// Number of depth walks.
    pub walks: u32,
    /// Number of depths that needed no walk, because they were moved to a shared normal again.
    pub skipped_walks: u32,
    /// Number of moves of all walks.
    pub walk_steps: u32,
    /// Number of walks that ended without convergence.
    pub walk_stops: u32,
    /// Number of depths without a proof that they are globally least: all depths, unless the
    /// query's settings request proofs.
    pub unproven: u32,
    /// Number of depths that were moved to another normal, because the meshes of both pieces do not
    /// have the normal of the least depth.
    pub moved: u32,
    /// Number of depths that were left out because they contradict the surfaces of the solids, or,
    /// in open bodies, the motion since the last query.
    pub rejected: u32,
    /// Number of replacement contacts, from a witness point to the nearest surface, if the bodies
    /// overlap and no depth of pieces was accepted; 0 or 1.
    pub stood_in: u32,
    /// Number of overlaps that were left out because the two pieces share no surface normal.
    pub inadmissible: u32,
    /// Number of searches for an admissible depth that stopped before all edge pairs were examined.
    pub admissible_stops: u32,
    /// Number of pairs of closest points that are not contacts: a point is not on the mesh's
    /// surface, or the surface there does not face along the normal.
    pub virtual_closest: u32,
    /// Number of contacts that were extrapolated from the last tick because the quota was spent.
    pub held: u32,
    /// Number of overlapping pairs without any contact, because the quota was spent and no cached
    /// contact existed.
    pub unseen: u32,
    /// Number of pairs that became represented: the contacts of the sample account for their force
    /// until the bodies have moved some distance.
    pub represented: u32,
    /// Number of sub-steps into which a fast tick's motion was divided; 0 if it was not divided.
    pub sub_steps: u32,
    /// Number of contacts that are kept on the side from which the probe came, because their pair
    /// has tunnelled.
    pub kept_side: u32,
    /// Number of patches that were computed.
    pub patches: u32,
    /// Number of additional contacts at the other corners of patches.
    pub corners: u32,
    /// Number of contacts left out because one of their values was not a finite number.
    pub non_finite: u32,
    /// Time in the descent and the marches, ns.
    pub query_ns: u64,
    /// Time in the depth walks, ns.
    pub depth_ns: u64,
}

impl QueryCounters {
    /// Returns the cost in units of [`crate::algebra::Work`], without the cost of the returned
    /// contacts.
    pub(super) fn work(&self) -> u64 {
        self.traversal.work()
            + WORK_WALK * u64::from(self.walks + self.skipped_walks)
            + WORK_STEP * u64::from(self.walk_steps)
            + WORK_PATCH * u64::from(self.patches + self.corners)
    }
}

impl std::ops::AddAssign for QueryCounters {
    fn add_assign(&mut self, other: Self) {
        let Self {
            traversal,
            walks,
            skipped_walks,
            walk_steps,
            walk_stops,
            unproven,
            moved,
            rejected,
            stood_in,
            inadmissible,
            admissible_stops,
            virtual_closest,
            held,
            unseen,
            represented,
            sub_steps,
            kept_side,
            patches,
            corners,
            non_finite,
            query_ns,
            depth_ns,
        } = other;
        self.traversal += traversal;
        self.walks += walks;
        self.skipped_walks += skipped_walks;
        self.walk_steps += walk_steps;
        self.walk_stops += walk_stops;
        self.unproven += unproven;
        self.moved += moved;
        self.rejected += rejected;
        self.stood_in += stood_in;
        self.inadmissible += inadmissible;
        self.admissible_stops += admissible_stops;
        self.virtual_closest += virtual_closest;
        self.held += held;
        self.unseen += unseen;
        self.represented += represented;
        self.sub_steps += sub_steps;
        self.kept_side += kept_side;
        self.patches += patches;
        self.corners += corners;
        self.non_finite += non_finite;
        self.query_ns += query_ns;
        self.depth_ns += depth_ns;
    }
}
