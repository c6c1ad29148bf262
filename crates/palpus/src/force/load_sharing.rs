//! Load sharing: computes the fraction of its force that a contact keeps if other contacts push in
//! the same direction.
//!
//! Single linkage ([`super::Linkage`]) gives a cluster the force of its deepest member. When two
//! clusters merge, one of the two forces disappears within one tick, and a hand feels this jump.
//! Also, the number of clusters depends on the distances between pieces, which are arbitrary. Load
//! sharing needs no clusters. Each contact pushes along its own direction. Contacts that push in
//! the same direction have together the force of the deepest contact:
//!
//! F = Σᵢ k αᵢ wᵢ · (maxⱼ κᵢⱼ wⱼ / Σⱼ κᵢⱼ αⱼ wⱼ) · nᵢ
//!
//! Here κᵢⱼ = (max(nᵢ·nⱼ, 0))². w is the engagement: t − d, or the contact offset of a tool minus
//! d; 0 if negative. α is the tilt share ([`TiltShares`]; 1 for a contact outside any patch).
//!
//! * κᵢᵢ = 1: a single contact keeps all of its force. Several contacts with one direction push
//!   like one contact: their force, direction and point are exactly those of eq. 3–5 of \[K02\] for
//!   a cluster.
//! * κ is 0 for directions that differ by 90° or more: each wall of a groove or slot pushes as if
//!   it were alone.
//! * Every term is continuous in every position, direction and engagement. A new contact with w = 0
//!   changes nothing.
//! * If κ ≥ c for each two contacts of a set, their total force is at most the deepest contact's
//!   force divided by c. Proof: each sum over j is at least c Σ αw, no maximum exceeds the deepest
//!   w, and Σ αw max w/(c Σ αw) = max w / c.
//! * So the stiffness of a surface does not depend on the number or the borders of its pieces and
//!   triangles. Two bodies resist with stiffness k in each independent direction. (Shallower
//!   contacts shift the point of action, and so still resist a tilt.)
//!
//! **Why κ ignores the distance of contacts.** Single linkage limits distances by δ, and an earlier
//! κ had a limited range too. But contacts represent pieces of a convex decomposition: a flat side
//! has one piece, and a rough side has dozens. With a limited range, each contact beyond the
//! range of the others adds its full stiffness. A ring of 50 pieces on a table was 48 times as
//! stiff as a disc. With four times the triangles it was 58 times as stiff, and no device is stable
//! at such a stiffness. `palpus-scenes/tests/area.rs` measures the force of one motion on meshes
//! with one, four and sixteen times the triangles.
//!
//! **The force has no potential.** Suppose that a potential E exists for two contacts of one
//! direction with engagements w ≥ v. Pushing contacts make E grow with v. A contact with v = 0 adds
//! nothing: E(w, 0) = E(w). Two equal contacts count as one: E(w, w) = E(w). So E(w, v) = E(w) for
//! all v, and E is ½ k w². The force of this potential acts at the deepest contact, and it jumps
//! when another contact becomes the deepest. The forces of load sharing are continuous instead, but
//! they can do work around a closed loop.
//!
//! 1. Compute the tilt share of each contact.
//! 2. Compare every contact with every other contact. If no contact of its direction pushes yet,
//!    compute its share as if the nearest contact of this direction pushed.
//!
//! The contacts come in canonical order, so sums do not depend on the order of the query's results.
//! [`LoadSharing::new`] allocates all memory.

use std::ops::Range;

use glam::DVec3;

use super::tilt::{TiltShares, Tilted};
use crate::algebra::tolerance::{SAMPLE_EXCESS, SAMPLE_FULL_EXCESS};
use crate::algebra::{Directions, LANES};

/// Shares of the last run, and the memory to compute them.
#[derive(Clone, Debug)]
pub struct LoadSharing {
    tilts: TiltShares,
    /// True if the tilt shares of the last run were given to it.
    given: bool,
    /// All contacts; those that push come first.
    seen: Vec<ContactLanes>,
    /// The contacts that push.
    pushing: Vec<ContactLanes>,
    /// For each contact, its share of the tilts times its count.
    counts: Vec<f64>,
    shares: Vec<f64>,
}

/// The properties of four contacts that enter the shares of others. Lanes without a contact count
/// 0.
#[derive(Clone, Copy, Debug)]
struct ContactLanes {
    directions: Directions,
    separation: [f64; LANES],
    engagement: [f64; LANES],
    /// See [`presence`].
    presence: [f64; LANES],
    count: [f64; LANES],
}

impl ContactLanes {
    /// A group without contacts.
    const NONE: Self = Self {
        directions: Directions::NONE,
        separation: [f64::INFINITY; LANES],
        engagement: [0.0; LANES],
        presence: [0.0; LANES],
        count: [0.0; LANES],
    };
}

/// Writes contacts with their counts to `groups`, which has room for them.
fn collect<'c>(groups: &mut Vec<ContactLanes>, contacts: impl Iterator<Item = (&'c Tilted, &'c f64)>) {
    groups.clear();
    for (k, (contact, &count)) in contacts.enumerate() {
        let lane = k % LANES;
        if lane == 0 {
            groups.push(ContactLanes::NONE);
        }
        let Some(four) = groups.last_mut() else { return };
        four.directions.set(lane, contact.direction);
        four.separation[lane] = contact.separation;
        four.engagement[lane] = contact.engagement;
        four.presence[lane] = presence(contact.count);
        four.count[lane] = count;
    }
}

impl LoadSharing {
    /// Allocates memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self {
            tilts: TiltShares::new(capacity),
            given: false,
            seen: Vec::with_capacity(capacity.div_ceil(LANES)),
            pushing: Vec::with_capacity(capacity.div_ceil(LANES)),
            counts: Vec::with_capacity(capacity),
            shares: Vec::with_capacity(capacity),
        }
    }

    /// Computes the share of its force that each contact keeps. The share is 0 for contacts that
    /// are surrounded by other contacts of their surface. If no contact of a direction pushes yet,
    /// a contact gets the share that it would have if all contacts up to `ahead` (m) beyond the
    /// nearest pushed.
    ///
    /// `known` are the tilt shares of the contacts; `None` if they are to be computed.
    ///
    /// The shares are in [`Self::shares`] until the next run.
    pub fn run(&mut self, contacts: &[Tilted], known: Option<&[f64]>, ahead: f64) -> &[f64] {
        self.given = known.is_some();
        self.counts.clear();
        match known {
            Some(tilts) => self.counts.extend_from_slice(tilts),
            None => {
                self.tilts.run(contacts);
                self.counts.extend((0..contacts.len()).map(|i| self.tilts.beside_rim(i, contacts)));
            }
        }
        self.counts.iter_mut().zip(contacts).for_each(|(count, contact)| *count *= contact.count);
        self.look(contacts);
        self.shares.clear();
        let mut share = OfDirection::new();
        for (one, &count) in contacts.iter().zip(&self.counts) {
            let whole =
                if count > 0.0 { share.of(one.direction, |direction| self.share(direction, ahead)) } else { 0.0 };
            self.shares.push(count * whole);
        }
        &self.shares
    }

    /// Returns the load of each contact of the last run, in the unit of `bears`. `bears` returns
    /// the load of a single contact from its engagement and separation (m). Contacts that push in
    /// the same direction have together the largest of their single loads.
    pub fn loads<'a>(
        &'a self,
        contacts: &'a [Tilted],
        bears: impl Fn(f64, f64) -> f64 + Copy + 'a,
    ) -> impl Iterator<Item = f64> + 'a {
        let mut share = OfDirection::new();
        contacts.iter().zip(&self.counts).map(move |(one, &count)| {
            let alone = bears(one.engagement, one.separation);
            if count <= 0.0 || alone <= 0.0 {
                return 0.0;
            }
            let share = share.of(one.direction, |direction| {
                let (most, sum) = felt(direction, &self.seen, |four, k| bears(four.engagement[k], four.separation[k]));
                most / sum
            });
            alone * count * share
        })
    }

    /// Returns the tilt shares of one patch of the last run, if the run has computed them and they
    /// are the shares that the patch would have without all other patches.
    pub(crate) fn tilts_of_patch(&self, patch: Range<usize>) -> Option<&[f64]> {
        if self.given { None } else { self.tilts.of_patch(patch) }
    }

    /// Returns the shares of the last run, parallel to its contacts.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// Collects the properties of all contacts; pushing contacts come first.
    fn look(&mut self, contacts: &[Tilted]) {
        let counted = || contacts.iter().zip(&self.counts);
        let pushing = || counted().filter(|(contact, _)| contact.engagement > 0.0);
        collect(&mut self.pushing, pushing());
        collect(&mut self.seen, pushing().chain(counted().filter(|(contact, _)| contact.engagement <= 0.0)));
    }

    /// Step 2: returns the greatest κ w of all contacts divided by the sum of κ α w, for the
    /// `direction` of a contact.
    fn share(&self, direction: DVec3, ahead: f64) -> f64 {
        let (most, sum) = felt(direction, &self.pushing, |four, k| four.engagement[k]);
        if most > 0.0 {
            // The sum is 0 only if no contact counts; then the contact keeps its own load.
            return if sum > 0.0 { most / sum } else { 1.0 };
        }
        let mut nearest = f64::INFINITY;
        for four in &self.seen {
            let alike = four.directions.alike(direction);
            for (alike, separation) in alike.into_iter().zip(four.separation) {
                nearest = if alike > 0.0 { nearest.min(separation) } else { nearest };
            }
        }
        let (most, sum) = felt(direction, &self.seen, |four, k| (nearest + ahead - four.separation[k]).max(0.0));
        if sum > 0.0 { most / sum } else { 1.0 }
    }
}

/// A result for a contact's direction. Contacts on one flat face have the same direction and follow
/// each other, so the result is computed once for all of them.
struct OfDirection {
    last: Option<(DVec3, f64)>,
}

impl OfDirection {
    fn new() -> Self {
        Self { last: None }
    }

    /// Returns the result of `compute` for `direction`.
    fn of(&mut self, direction: DVec3, compute: impl FnOnce(DVec3) -> f64) -> f64 {
        match self.last {
            Some((last, result)) if last == direction => result,
            _ => {
                let result = compute(direction);
                self.last = Some((direction, result));
                result
            }
        }
    }
}

/// Returns the greatest κ m w and the sum of κ α w of `others`, where m is [`presence`] and w is
/// `engagement` of a contact, given its group and its lane. κ is for `direction`.
#[inline]
fn felt(direction: DVec3, others: &[ContactLanes], engagement: impl Fn(&ContactLanes, usize) -> f64) -> (f64, f64) {
    // The order of the sum is always the same.
    let (mut sums, mut most) = ([0.0; LANES], [0.0; LANES]);
    for four in others {
        let alike = four.directions.alike(direction);
        for k in 0..LANES {
            let size = alike[k] * engagement(four, k);
            sums[k] += four.count[k] * size;
            let size = four.presence[k] * size;
            most[k] = if size > most[k] { size } else { most[k] };
        }
    }
    (most.into_iter().fold(0.0, f64::max), sums[0] + sums[1] + sums[2] + sums[3])
}

/// Returns the factor of a contact's engagement in the choice of the largest engagement. A
/// contact that appears beside a sample presses a little harder than the sample. With this factor
/// it begins at the engagement of the sample.
fn presence(count: f64) -> f64 {
    if count >= 1.0 {
        return 1.0;
    }
    let known = 1.0 / (1.0 + SAMPLE_EXCESS + SAMPLE_FULL_EXCESS * count);
    known + (1.0 - known) * count
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::testing::Random;
    use super::*;

    const SEED: u64 = 0xC20D;

    /// Returns κ of two directions.
    fn kernel(one: DVec3, other: DVec3) -> f64 {
        one.dot(other).max(0.0).powi(2)
    }

    /// Returns a contact outside any patch.
    fn single(direction: DVec3, engagement: f64) -> Tilted {
        Tilted {
            place: DVec3::ZERO,
            direction,
            separation: -engagement,
            engagement,
            slope: 0.0,
            count: 1.0,
            pieces: [0; 2],
            inside: false,
        }
    }

    fn some_contacts(random: &mut Random, n: usize) -> Vec<Tilted> {
        (0..n).map(|_| single(random.direction(), random.between(1e-5, 2e-3))).collect()
    }

    fn toward_z(random: &mut Random, n: usize, spread: f64) -> Vec<Tilted> {
        let mut contacts = some_contacts(random, n);
        for contact in &mut contacts {
            contact.direction = (DVec3::Z + spread * contact.direction).normalize();
        }
        contacts
    }

    /// Returns Σ wᵢ sᵢ nᵢ, the force for k = 1 N/m.
    fn push(contacts: &[Tilted]) -> DVec3 {
        let mut sharing = LoadSharing::new(contacts.len());
        contacts.iter().zip(sharing.run(contacts, None, 0.0)).map(|(c, share)| c.engagement * share * c.direction).sum()
    }

    #[test]
    fn shares_are_maximum_over_sum() {
        let mut random = Random::new(SEED);
        for round in 0..200 {
            let n = 1 + random.below(60);
            let contacts = some_contacts(&mut random, n);
            let mut sharing = LoadSharing::new(n);
            let shares = sharing.run(&contacts, None, 0.0);
            for (one, share) in contacts.iter().zip(shares) {
                let felt = |other: &Tilted| kernel(one.direction, other.direction) * other.engagement;
                let most = contacts.iter().map(felt).fold(one.engagement, f64::max);
                let expected = most / contacts.iter().map(felt).sum::<f64>();
                assert!((share - expected).abs() < 1e-9, "seed {SEED:#x}, round {round}");
                assert!(*share > 0.0 && *share <= 1.0);
            }
        }
    }

    #[test]
    fn parallel_contacts_push_like_the_deepest() {
        let mut random = Random::new(SEED ^ 4);
        for count in [1, 2, 7, 100, 600] {
            let contacts = toward_z(&mut random, count, 0.0);
            let deepest = contacts.iter().map(|contact| contact.engagement).fold(0.0, f64::max);
            assert!((push(&contacts) - DVec3::Z * deepest).length() < 1e-15, "seed {SEED:#x}, {count} contacts");
        }
    }

    #[test]
    fn new_contact_changes_the_force_continuously() {
        let mut random = Random::new(SEED ^ 1);
        for round in 0..200 {
            let mut contacts = some_contacts(&mut random, 20);
            let before = push(&contacts);
            for engagement in [1e-12, 1e-9, 1e-7] {
                contacts.push(single(random.direction(), engagement));
                // The contact reduces each neighbour by at most κ times its own engagement, and
                // there are twenty neighbours.
                assert!((push(&contacts) - before).length() <= 21.0 * engagement, "seed {SEED:#x}, round {round}");
                contacts.pop();
            }
        }
    }

    #[test]
    fn small_motion_changes_the_force_little() {
        // All engagements and directions change. In some rounds the deepest contact changes, or the
        // angle between two directions passes 90°.
        let mut random = Random::new(SEED ^ 5);
        for round in 0..200 {
            let contacts = some_contacts(&mut random, 12);
            let (motion, turn) = (1e-9, 1e-6);
            let moved: Vec<Tilted> = contacts
                .iter()
                .map(|c| {
                    let direction = (c.direction + turn * random.direction()).normalize();
                    single(direction, c.engagement + random.between(-motion, motion))
                })
                .collect();
            // The slope of each term w·max/Σ is at most 3 with respect to an engagement, and at
            // most 6 w with respect to a direction.
            let most = 12.0 * (3.0 * 12.0 * motion + 7.0 * 12.0 * turn * 2e-3);
            assert!((push(&moved) - push(&contacts)).length() <= most, "seed {SEED:#x}, round {round}");
        }
    }

    #[test]
    fn similar_contacts_push_little_more_than_the_deepest() {
        let mut random = Random::new(SEED ^ 2);
        for round in 0..500 {
            let contacts = toward_z(&mut random, 30, 0.3);
            let least = contacts
                .iter()
                .flat_map(|a| contacts.iter().map(|b| kernel(a.direction, b.direction)))
                .fold(1.0, f64::min);
            let deepest = contacts.iter().map(|contact| contact.engagement).fold(0.0, f64::max);
            let mut sharing = LoadSharing::new(30);
            let sizes: f64 =
                contacts.iter().zip(sharing.run(&contacts, None, 0.0)).map(|(c, share)| c.engagement * share).sum();
            assert!(sizes <= deepest / least * (1.0 + 1e-12), "seed {SEED:#x}, round {round}");
        }
    }

    #[test]
    fn opposed_and_perpendicular_walls_are_independent() {
        for other in [DVec3::NEG_Y, DVec3::X] {
            let wall = |direction| single(direction, 1e-3);
            assert_eq!(LoadSharing::new(2).run(&[wall(DVec3::Y), wall(other)], None, 0.0), [1.0, 1.0]);
        }
    }

    #[test]
    fn finer_mesh_is_not_stiffer() {
        // A dome of 20° is pressed at its middle, with one to 441 contacts.
        let dome = |rings: i32| -> f64 {
            let contacts: Vec<Tilted> = (0..rings * rings)
                .map(|k| {
                    let place = |k: i32| f64::from(2 * k - rings + 1) / f64::from(rings);
                    let slope = DVec3::new(place(k / rings), place(k % rings), 0.0) * 0.25;
                    let direction = (DVec3::Z + slope).normalize();
                    single(direction, 1e-3 * (1.0 - 4.0 * slope.length_squared()))
                })
                .collect();
            push(&contacts).z
        };
        let coarse = dome(1);
        for rings in [3, 9, 21] {
            assert!((dome(rings) / coarse - 1.0).abs() < 0.05, "{rings}: {} and {coarse}", dome(rings));
        }
    }
}
