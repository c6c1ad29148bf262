//! Clusters of contacts: exact single linkage of midpoints, cut where normals oppose each other
//! \[K02 §4.2\].
//!
//! 1. *Admit* contacts that are finite and nearer than the tolerance. If there are more contacts
//!    than the capacity, keep the deepest and only count the others.
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

mod cut;
mod link;
mod validate;

use std::cmp::Ordering;

use glam::DVec3;

use super::tilt::{TiltShares, Tilted};
use crate::detect::Contact;
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
    /// If there are still more contacts, half of this number are the deepest contacts. The other
    /// half are the deepest contacts with clearly different normals, which stop the tool when it is
    /// thrown back, and then the contacts that represent most others.
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
    /// [`LinkageSettings::most`]. Contacts inside a flat face are not counted.
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
    /// Memory for the corners of one patch.
    corners: Vec<Tilted>,
    tilts: TiltShares,
    /// Contacts and their tilt shares, by contact, if contacts inside flat faces were left out.
    kept: Vec<(u32, f64)>,
    /// The tilt shares of the members, if contacts inside flat faces were left out.
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

/// Cosine of 60°: contacts whose directions differ by more have clearly different normals.
const ELSEWHERE: f64 = 0.5;

/// Moves the `count` deepest contacts of `order` to its front, unsorted.
fn deepest_first(order: &mut [u32], count: usize, contacts: &[Contact]) {
    if count < order.len() {
        order.select_nth_unstable_by(count, |&i, &j| deeper(&contacts[i as usize], &contacts[j as usize]));
    }
}

/// Moves the `count` contacts that represent most contacts to the front of `order`, unsorted. Of
/// equal ones, the deeper come first. So a sample, which is spread evenly over a face, is not
/// displaced by contacts that are hardly deeper and are all at one side.
fn most_first(order: &mut [u32], count: usize, contacts: &[Contact]) {
    if count < order.len() {
        order.select_nth_unstable_by(count, |&i, &j| {
            let (first, second) = (&contacts[i as usize], &contacts[j as usize]);
            second.count.total_cmp(&first.count).then_with(|| deeper(first, second))
        });
    }
}

/// Orders contacts by their separations.
fn deeper(first: &Contact, second: &Contact) -> Ordering {
    first.separation.total_cmp(&second.separation).then_with(|| canonical(first, second))
}

impl Linkage {
    /// Allocates memory for clusters of at most `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            capacity,
            order: Vec::with_capacity(2 * capacity + 1),
            points: Vec::with_capacity(capacity),
            normals: Vec::with_capacity(capacity),
            corners: Vec::with_capacity(capacity),
            tilts: TiltShares::new(capacity),
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

    /// Clusters `contacts`. `direction` returns the unit direction in which an admitted contact
    /// pushes a: its normal, or the shaded normal.
    pub fn run(
        &mut self,
        contacts: &[Contact],
        settings: &LinkageSettings,
        mut direction: impl FnMut(&Contact) -> DVec3,
    ) -> LinkageCounters {
        let mut counters = self.admit(contacts, settings);
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

    /// Returns the tilt shares of the members, parallel to [`Self::members`], if contacts inside
    /// flat faces were left out. The shares cannot be computed from the members alone.
    pub fn tilt_shares(&self) -> Option<&[f64]> {
        (!self.kept.is_empty()).then_some(&self.shares)
    }

    /// Step 1. Collects at most twice the capacity of contacts. When the list is full, keeps the
    /// deepest half, so the work stays linear.
    fn admit(&mut self, contacts: &[Contact], settings: &LinkageSettings) -> LinkageCounters {
        let mut counters = LinkageCounters::default();
        self.order.clear();
        for (i, contact) in contacts.iter().enumerate() {
            if !contact.is_finite() {
                counters.non_finite += 1;
            } else if contact.separation < settings.tolerance {
                if self.order.len() == 2 * self.capacity {
                    self.keep_deepest(contacts);
                }
                self.order.push(i as u32);
                counters.admitted += 1;
            }
        }
        self.keep_deepest(contacts);
        let admitted = self.order.len();
        self.leave_inner(contacts, settings);
        counters.admitted -= (admitted - self.order.len()) as u32;
        self.seat(contacts, settings.most);
        counters.dropped = counters.admitted - self.order.len() as u32;
        counters.admitted = self.order.len() as u32;
        counters
    }

    fn keep_deepest(&mut self, contacts: &[Contact]) {
        deepest_first(&mut self.order, self.capacity, contacts);
        self.order.truncate(self.capacity);
    }

    /// Leaves out contacts inside flat faces if there are more than [`LinkageSettings::most`].
    /// They bear no load, but among many equally deep contacts they would be chosen before the
    /// rim. The tilt shares of the other contacts are kept, because without the left out contacts
    /// they would differ.
    fn leave_inner(&mut self, contacts: &[Contact], settings: &LinkageSettings) {
        self.kept.clear();
        if self.order.len() <= settings.most || settings.radius > 0.0 {
            return;
        }
        // The corners of a patch must be adjacent.
        self.order.sort_unstable_by(|&i, &j| canonical(&contacts[i as usize], &contacts[j as usize]));
        self.corners.clear();
        let corner = |&i: &u32| Tilted::of(&contacts[i as usize], settings.contact_offset);
        self.corners.extend(self.order.iter().map(corner));
        let shares = self.tilts.run(&self.corners);
        self.kept.extend(self.order.iter().zip(shares).map(|(&i, &share)| (i, share)).filter(|kept| kept.1 > 0.0));
        self.order.clear();
        self.order.extend(self.kept.iter().map(|kept| kept.0));
        self.kept.sort_unstable_by_key(|kept| kept.0);
    }

    /// Reduces the number of contacts to `most`.
    fn seat(&mut self, contacts: &[Contact], most: usize) {
        if self.order.len() <= most {
            return;
        }
        let half = most.div_ceil(2);
        deepest_first(&mut self.order, half, contacts);
        let (deepest, others) = self.order.split_at_mut(half);
        let normal = |i: u32| contacts[i as usize].normal;
        let pushed = deepest.iter().map(|&i| normal(i)).sum::<DVec3>().normalize_or_zero();
        // Contacts with clearly different normals come before the rest.
        let mut turned = 0;
        for k in 0..others.len() {
            if normal(others[k]).dot(pushed) < ELSEWHERE {
                others.swap(k, turned);
                turned += 1;
            }
        }
        let seats = most - half;
        deepest_first(&mut others[..turned], seats, contacts);
        if turned < seats {
            most_first(&mut others[turned..], seats - turned, contacts);
        }
        self.order.truncate(most);
    }

    /// Step 2: sorts the contacts, and collects their midpoints and force directions.
    fn place_in_order(&mut self, contacts: &[Contact], direction: &mut impl FnMut(&Contact) -> DVec3) {
        self.order.sort_unstable_by(|&i, &j| canonical(&contacts[i as usize], &contacts[j as usize]));
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

/// Orders contacts by their values alone, not by their indices.
fn canonical(first: &Contact, second: &Contact) -> Ordering {
    let by_pieces = (first.piece_a, first.piece_b).cmp(&(second.piece_a, second.piece_b));
    by_pieces.then_with(|| first.separation.total_cmp(&second.separation)).then_with(|| {
        let numbers = |c: &Contact| [c.point_a, c.point_b, c.normal].map(|v| v.to_array());
        let (first, second) = (numbers(first), numbers(second));
        let pairs = first.as_flattened().iter().zip(second.as_flattened());
        pairs.map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    })
}
