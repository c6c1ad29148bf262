//! Clusters of contacts: exact single linkage of midpoints, cut where normals oppose each other
//! \[K02 §4.2\].
//!
//! 1. *Admit* contacts that are finite and nearer than the tolerance. If there are more contacts
//!    than the capacity, keep the deepest and only count the others. If there are more than
//!    [`LinkageSettings::most`], choose some that represent all.
//! 2. *Order* the contacts by their values (piece indices first). Then a permutation of the input
//!    changes no bit of a later sum.
//! 3. *Link* every two contacts whose midpoints are strictly nearer than the radius δ (eq. 2). A
//!    group is a connected component of these links. A grid of cells with diagonal δ saves work.
//!    All midpoints in one cell are linked to the cell's first midpoint, and each cell is compared
//!    only with cells nearer than δ. The corners of one patch belong to one pair of pieces, so each
//!    corner is linked as if it were in the patch's middle.
//! 4. *Cut* a group whose normals do not fit into one cone of opening `split_angle`. The normal of
//!    the deepest contact is the axis of the first cone. The cone takes all members whose normals
//!    are within half the opening of the axis. The axis of the next cone is the remaining
//!    normal that is farthest from all axes, and so on. This choice puts the cones around a peg
//!    opposite each other.
//! 5. *Link again* inside each cone, because contacts of another cone may have been the only
//!    connection between two parts of a group.
//!
//! Deviations. In the paper, the cells of an octree *are* the clusters. There, two very close
//! contacts on the two sides of a cell's wall are in different clusters, which contradicts eq. 2.
//! The cut (steps 4 and 5) is ours. Eq. 3 has no solution if the normals of a cluster cancel.
//! Examples are a slot narrower than δ, and a peg in a hole, where a chain of neighbours joins
//! opposed normals. After the cut, each normal of a cluster differs from the cone's axis by at most
//! half of `split_angle`. So the length of their weighted sum is at least `cos(split_angle / 2)` of
//! the sum of the weights. `split_angle: None` gives the paper's eq. 2 alone.
//!
//! [`Linkage::new`] allocates all memory.

mod admit;
mod choose;
mod cut;
mod link;
mod validate;

use glam::DVec3;

use super::tilt::{TiltShares, Tilted};
use crate::detect::Contact;
use admit::Key;
use choose::Candidate;
use link::{Cell, Run};

/// Parameters of clustering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkageSettings {
    /// t of \[K02\], m: contacts at this separation or farther are ignored.
    pub tolerance: f64,
    /// δ of \[K02\], m: midpoints nearer than this are linked. With 0, no contacts are linked.
    pub radius: f64,
    /// Largest opening of the cone that contains the normals of a cluster (rad, at most π). `None`:
    /// groups are never cut.
    pub split_angle: Option<f64>,
    /// Largest number of clustered contacts. If there are more contacts and no contacts are
    /// linked, contacts with a tilt share of 0 are left out first: contacts inside a flat face.
    /// If there are still more contacts, a quarter of this number are the deepest contacts, and up
    /// to a quarter are the deepest contacts with clearly different normals, which stop the tool
    /// when it is thrown back. The rest is a random sample of the other contacts, which represents
    /// all of them ([`Linkage::tilt_shares`]).
    pub most: usize,
    /// Contacts push below this separation, m. It enters the tilt shares ([`TiltShares`]).
    pub contact_offset: f64,
}

/// Counts of one run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkageCounters {
    /// Number of contacts that are in a cluster.
    pub admitted: u32,
    /// Number of contacts left out because their number exceeded the capacity or
    /// [`LinkageSettings::most`]. Contacts that were found to be inside a flat face are not
    /// counted.
    pub dropped: u32,
    /// Number of contacts left out because one of their numbers was not finite.
    pub non_finite: u32,
    /// Number of groups of eq. 2 that were cut because their normals opposed each other.
    pub cut_groups: u32,
}

impl std::ops::AddAssign for LinkageCounters {
    fn add_assign(&mut self, other: Self) {
        let Self { admitted, dropped, non_finite, cut_groups } = other;
        self.admitted += admitted;
        self.dropped += dropped;
        self.non_finite += non_finite;
        self.cut_groups += cut_groups;
    }
}

/// Clusters of the last run, and the memory to find them.
#[derive(Clone, Debug)]
pub struct Linkage {
    capacity: usize,
    /// Admitted contacts in canonical order; a contact's index in this list is its *rank*.
    order: Vec<u32>,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    /// Memory to sort the contacts.
    keys: Vec<Key>,
    /// Memory for the corners of one patch, or of all patches.
    corners: Vec<Tilted>,
    tilts: TiltShares,
    /// Memory to choose contacts.
    candidates: Vec<Candidate>,
    /// Contacts and their tilt shares, by contact, if contacts were left out.
    kept: Vec<(u32, f64)>,
    /// The tilt shares of the members, if contacts were left out.
    shares: Vec<f64>,
    /// Label of each rank; contacts with different labels are never linked.
    labels: Vec<u32>,
    /// Union–find over ranks; the root of a component is its smallest rank.
    parents: Vec<u32>,
    cells: Vec<Cell>,
    runs: Vec<Run>,
    /// Ranks, group after group.
    ranks: Vec<u32>,
    /// Contact indices, in the order of `ranks`.
    members: Vec<u32>,
    directions: Vec<DVec3>,
    starts: Vec<u32>,
    group_of: Vec<u32>,
    /// For each rank of the group that is being cut: cosine of the angle to the nearest cone axis.
    to_leader: Vec<f64>,
}

impl Linkage {
    /// Allocates memory for clusters of at most `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            order: Vec::with_capacity(2 * capacity + 1),
            points: Vec::with_capacity(capacity),
            normals: Vec::with_capacity(capacity),
            keys: Vec::with_capacity(capacity),
            corners: Vec::with_capacity(capacity),
            tilts: TiltShares::new(capacity),
            candidates: Vec::with_capacity(capacity),
            kept: Vec::with_capacity(capacity),
            shares: Vec::with_capacity(capacity),
            labels: Vec::with_capacity(capacity),
            parents: Vec::with_capacity(capacity),
            cells: Vec::with_capacity(capacity),
            runs: Vec::with_capacity(capacity),
            ranks: Vec::with_capacity(capacity),
            members: Vec::with_capacity(capacity),
            directions: Vec::with_capacity(capacity),
            starts: Vec::with_capacity(capacity + 1),
            group_of: Vec::with_capacity(capacity),
            to_leader: Vec::with_capacity(capacity),
        }
    }

    /// Clusters `contacts`. `expected` returns the separation (m) that a contact will have when its
    /// force acts; if there are too many contacts, the choice depends on it. `direction` returns
    /// the unit direction in which an admitted contact pushes a: its normal, or the shaded normal.
    pub fn run(
        &mut self,
        contacts: &[Contact],
        settings: &LinkageSettings,
        expected: impl Fn(&Contact) -> f64,
        mut direction: impl FnMut(&Contact) -> DVec3,
    ) -> LinkageCounters {
        let mut counters = self.admit(contacts, settings, expected);
        self.place_in_order(contacts, &mut direction);
        if settings.radius > 0.0 {
            self.draw_together(contacts);
        }
        self.link(settings.radius);
        self.gather();
        // A single contact fits into any cone.
        if let Some(angle) = settings.split_angle
            && self.len() < self.order.len()
        {
            counters.cut_groups = self.cut(contacts, (0.5 * angle).cos());
            if counters.cut_groups > 0 {
                self.link(settings.radius);
                self.gather();
            }
        }
        self.members.clear();
        self.members.extend(self.ranks.iter().map(|&rank| self.order[rank as usize]));
        self.directions.clear();
        self.directions.extend(self.ranks.iter().map(|&rank| self.normals[rank as usize]));
        self.shares.clear();
        if !self.kept.is_empty() {
            let share = |i: &u32| self.kept.binary_search_by_key(i, |kept| kept.0).map_or(0.0, |k| self.kept[k].1);
            self.shares.extend(self.members.iter().map(share));
        }
        debug_assert_eq!(self.validate(settings), Ok(()));
        counters
    }

    /// Returns the number of clusters.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Returns true if there is no cluster.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the range of the members of cluster `k` in [`Self::members`] and
    /// [`Self::directions`].
    pub fn range(&self, k: usize) -> std::ops::Range<usize> {
        self.starts[k] as usize..self.starts[k + 1] as usize
    }

    /// Indices into the contacts, cluster after cluster, each in canonical order.
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// Returns the force directions of the members (unit, in b's frame), parallel to
    /// [`Self::members`].
    pub fn directions(&self) -> &[DVec3] {
        &self.directions
    }

    /// Returns the tilt shares of the members, parallel to [`Self::members`], if contacts were left
    /// out. The shares cannot be computed from the members alone. Each share is multiplied by the
    /// number of contacts that the member represents, so a share may exceed 1.
    pub fn tilt_shares(&self) -> Option<&[f64]> {
        (!self.kept.is_empty()).then_some(&self.shares)
    }

    /// Step 2: sorts the contacts, and collects their midpoints and force directions.
    fn place_in_order(&mut self, contacts: &[Contact], direction: &mut impl FnMut(&Contact) -> DVec3) {
        self.sort(contacts);
        self.points.clear();
        self.points.extend(self.order.iter().map(|&i| contacts[i as usize].midpoint()));
        self.normals.clear();
        self.normals.extend(self.order.iter().map(|&i| direction(&contacts[i as usize])));
        self.labels.clear();
        self.labels.resize(self.order.len(), 0);
        self.to_leader.clear();
        self.to_leader.resize(self.order.len(), 0.0);
    }

    /// Moves the corners of each patch to its middle. In the canonical order they are adjacent.
    fn draw_together(&mut self, contacts: &[Contact]) {
        let mut first = 0;
        for patch in self.order.chunk_by(|&i, &j| contacts[i as usize].shares_patch(&contacts[j as usize])) {
            let ranks = first..first + patch.len();
            first = ranks.end;
            if patch.len() > 1 {
                self.corners.clear();
                self.corners.extend(patch.iter().map(|&i| Tilted::unloaded(&contacts[i as usize])));
                let shares = self.tilts.run(&self.corners);
                let middle: DVec3 = self.corners.iter().zip(shares).map(|(corner, share)| corner.place * *share).sum();
                self.points[ranks].fill(middle);
            }
        }
    }

    /// Lists the members of all components. Components are ordered by their first members, and
    /// members are in canonical order.
    fn gather(&mut self) {
        let n = self.order.len();
        self.group_of.clear();
        self.starts.clear();
        self.starts.push(0);
        for rank in 0..n as u32 {
            let root = self.root(rank);
            let group = if root == rank {
                self.starts.push(0);
                self.starts.len() as u32 - 2
            } else {
                self.group_of[root as usize]
            };
            self.group_of.push(group);
            self.starts[group as usize + 1] += 1;
        }
        for group in 1..self.starts.len() {
            self.starts[group] += self.starts[group - 1];
        }
        self.ranks.clear();
        self.ranks.resize(n, 0);
        // At first, `starts[group + 1]` is the end of the group. Filling from the back moves it to
        // the group's begin.
        for rank in (0..n).rev() {
            let end = &mut self.starts[self.group_of[rank] as usize + 1];
            *end -= 1;
            self.ranks[*end as usize] = rank as u32;
        }
        self.starts.rotate_left(1);
        if let Some(last) = self.starts.last_mut() {
            *last = n as u32;
        }
    }
}
