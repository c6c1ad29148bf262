//! Smooth clustering: how much of its own force a contact keeps among its neighbours.
//!
//! Single linkage ([`super::Linkage`]) gives a cluster the force of its deepest member. When two clusters meet, one of their
//! forces is gone from one tick to the next, and a hand feels a tick. Here there is no cluster and no event: every contact
//! pushes along its own direction, with the share of its own force that the crowd around it leaves to it,
//!
//! F = Σᵢ k wᵢ · (wᵢ / Σⱼ κᵢⱼ wⱼ) · nᵢ, with w the engagements t − d, and
//! κᵢⱼ = (1 − |pᵢ − pⱼ|²/δ²)²₊ · (nᵢ·nⱼ)²₊.
//!
//! * κᵢᵢ = 1: a contact alone keeps all of its force. k contacts at one place with one direction push as one.
//! * κ is 0 from the distance δ on, and for directions at a right angle or more: the walls of a groove and of a slot push as
//!   if each were alone.
//! * Every term is continuous in every position, direction and engagement, and a contact that enters at w = 0 changes
//!   nothing. No share exceeds 1.
//! * Contacts of which every two have κ ≥ c push together with at most the deepest one's force over c: each sum over j is at
//!   least c Σ w, and Σ w²/(c Σ w) ≤ max w / c.
//! * Many contacts on a surface larger than δ push by area: sums over a dense crowd are integrals over the kernel, whatever
//!   the mesh's fineness.
//!
//! 1. *Line up* the contacts along the widest axis of their bounding box.
//! 2. *Sweep*: every contact meets those less than δ ahead of it; each pair is weighed once, for both.
//!
//! The contacts come in canonical order, and ties in the line are broken by it, so that sums do not depend on how the query
//! found the contacts. All memory is obtained by [`Crowding::new`].

use glam::DVec3;

/// What one contact brings into the crowd.
#[derive(Clone, Copy, Debug)]
pub struct Crowded {
    /// p̂, in b's frame.
    pub midpoint: DVec3,
    /// Unit: where it pushes a.
    pub direction: DVec3,
    /// w = t − d > 0, m.
    pub engagement: f64,
}

/// Shares of the last run, and the memory to find them.
#[derive(Clone, Debug)]
pub struct Crowding {
    /// Places along the sweep, with the contact that stands there.
    line: Vec<(f64, u32)>,
    /// Σⱼ κᵢⱼ wⱼ, then the share.
    shares: Vec<f64>,
}

impl Crowding {
    /// Memory for `capacity` contacts.
    pub fn new(capacity: usize) -> Self {
        Self { line: Vec::with_capacity(capacity), shares: Vec::with_capacity(capacity) }
    }

    /// The share of its own force that each contact keeps, from 0 (excluded) to 1. `radius` is δ, m; with 0 all keep all.
    ///
    /// They stand in [`Self::shares`] until the next run.
    pub fn run(&mut self, crowd: &[Crowded], radius: f64) -> &[f64] {
        self.line_up(crowd);
        self.shares.clear();
        self.shares.extend(crowd.iter().map(|contact| contact.engagement));
        for k in 0..self.line.len() {
            let (place, i) = self.line[k];
            let one = &crowd[i as usize];
            for &(other_place, j) in self.line[k + 1..].iter().take_while(|other| other.0 - place < radius) {
                debug_assert!(other_place >= place);
                let other = &crowd[j as usize];
                let kernel = kernel(one, other, radius);
                self.shares[i as usize] += kernel * other.engagement;
                self.shares[j as usize] += kernel * one.engagement;
            }
        }
        for (share, contact) in self.shares.iter_mut().zip(crowd) {
            *share = contact.engagement / *share;
        }
        &self.shares
    }

    /// The shares of the last run, parallel to its crowd.
    pub fn shares(&self) -> &[f64] {
        &self.shares
    }

    /// Step 1.
    fn line_up(&mut self, crowd: &[Crowded]) {
        let (low, high) = crowd.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), contact| {
            (low.min(contact.midpoint), high.max(contact.midpoint))
        });
        let axis = (high - low).max_position();
        self.line.clear();
        self.line.extend(crowd.iter().enumerate().map(|(i, contact)| (contact.midpoint[axis], i as u32)));
        self.line.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
    }
}

/// κ of two contacts, from 0 to 1.
fn kernel(one: &Crowded, other: &Crowded, radius: f64) -> f64 {
    let near = 1.0 - one.midpoint.distance_squared(other.midpoint) / (radius * radius);
    let alike = one.direction.dot(other.direction);
    if near <= 0.0 || alike <= 0.0 {
        return 0.0;
    }
    near * near * alike * alike
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    const SEED: u64 = 0xC20D;
    const RADIUS: f64 = 4e-3;

    fn crowd(random: &mut Random, n: usize, spread: f64) -> Vec<Crowded> {
        (0..n)
            .map(|_| Crowded {
                midpoint: random.point(spread),
                direction: random.direction(),
                engagement: random.between(1e-5, 2e-3),
            })
            .collect()
    }

    /// Σ wᵢ sᵢ nᵢ: the force for k = 1 N/m.
    fn push(crowd: &[Crowded]) -> DVec3 {
        let mut crowding = Crowding::new(crowd.len());
        crowd.iter().zip(crowding.run(crowd, RADIUS)).map(|(c, share)| c.engagement * share * c.direction).sum()
    }

    #[test]
    fn the_sweep_is_the_double_sum() {
        let mut random = Random(SEED);
        for round in 0..200 {
            let n = 1 + random.below(60);
            let crowd = crowd(&mut random, n, 0.01);
            let mut crowding = Crowding::new(n);
            let shares = crowding.run(&crowd, RADIUS);
            for (i, one) in crowd.iter().enumerate() {
                let others = crowd.iter().enumerate().filter(|(j, _)| *j != i);
                let sum: f64 = others.map(|(_, other)| kernel(one, other, RADIUS) * other.engagement).sum();
                let expected = one.engagement / (one.engagement + sum);
                assert!((shares[i] - expected).abs() < 1e-12, "seed {SEED:#x}, round {round}");
                assert!(shares[i] > 0.0 && shares[i] <= 1.0);
            }
        }
    }

    #[test]
    fn contacts_at_one_place_push_as_one() {
        let one = Crowded { midpoint: DVec3::splat(0.1), direction: DVec3::Y, engagement: 1e-3 };
        for count in [1, 2, 7, 100] {
            assert!((push(&vec![one; count]) - DVec3::Y * 1e-3).length() < 1e-15, "{count} contacts");
        }
    }

    #[test]
    fn a_contact_that_enters_changes_nothing_and_then_little() {
        let mut random = Random(SEED ^ 1);
        for round in 0..200 {
            let mut crowd = crowd(&mut random, 20, 3e-3);
            let before = push(&crowd);
            for engagement in [1e-12, 1e-9, 1e-7] {
                crowd.push(Crowded { engagement, midpoint: random.point(3e-3), direction: random.direction() });
                // It takes from each neighbour at most κ of its own engagement, and there are twenty of them.
                assert!((push(&crowd) - before).length() <= 21.0 * engagement, "seed {SEED:#x}, round {round}");
                crowd.pop();
            }
        }
    }

    #[test]
    fn close_contacts_push_no_more_than_the_deepest() {
        let mut random = Random(SEED ^ 2);
        for round in 0..500 {
            let mut crowd = crowd(&mut random, 30, 1e-3);
            for contact in &mut crowd {
                contact.direction = (DVec3::Z + 0.3 * contact.direction).normalize();
            }
            let least = crowd.iter().flat_map(|a| crowd.iter().map(|b| kernel(a, b, RADIUS))).fold(1.0, f64::min);
            let deepest = crowd.iter().map(|contact| contact.engagement).fold(0.0, f64::max);
            let mut crowding = Crowding::new(30);
            let sizes: f64 =
                crowd.iter().zip(crowding.run(&crowd, RADIUS)).map(|(c, share)| c.engagement * share).sum();
            assert!(sizes <= deepest / least * (1.0 + 1e-12), "seed {SEED:#x}, round {round}");
        }
    }

    #[test]
    fn opposed_and_square_walls_do_not_know_of_each_other() {
        let at = |x: f64, direction| Crowded { midpoint: DVec3::X * x, direction, engagement: 1e-3 };
        for other in [DVec3::NEG_Y, DVec3::X] {
            let walls = [at(0.0, DVec3::Y), at(1e-4, other)];
            assert_eq!(Crowding::new(2).run(&walls, RADIUS), [1.0, 1.0]);
        }
    }

    #[test]
    fn approaching_contacts_merge_without_a_step() {
        // Two contacts drift together through δ and on until they are one: the force falls from two to one, evenly.
        let steps = 4000;
        let mut last: Option<f64> = None;
        let mut largest = 0.0_f64;
        for k in 0..=steps {
            let gap = 1.2 * RADIUS * (1.0 - f64::from(k) / f64::from(steps));
            let one = Crowded { midpoint: DVec3::ZERO, direction: DVec3::Z, engagement: 1e-3 };
            let force = push(&[one, Crowded { midpoint: DVec3::X * gap, ..one }]).z;
            largest = largest.max(last.map_or(0.0, |last| (force - last).abs()));
            last = Some(force);
        }
        assert!(last.is_some_and(|force| (force - 1e-3).abs() < 1e-15));
        // Linkage would lose 1e-3 in one step.
        assert!(largest < 1e-6, "{largest}");
    }

    #[test]
    fn a_finer_mesh_is_not_a_stiffer_one() {
        // A plate of 40 mm, pressed evenly, as a grid of contacts 1 mm and 0.5 mm apart: four times the contacts.
        let plate = |spacing: f64| -> f64 {
            let n = (0.04 / spacing) as i32;
            let place = |k: i32| (f64::from(k) + 0.5) * spacing;
            let crowd: Vec<Crowded> = (0..n * n)
                .map(|k| Crowded {
                    midpoint: DVec3::new(place(k / n), place(k % n), 0.0),
                    direction: DVec3::Z,
                    engagement: 1e-3,
                })
                .collect();
            push(&crowd).z
        };
        let (coarse, fine) = (plate(1e-3), plate(5e-4));
        assert!((fine / coarse - 1.0).abs() < 0.05, "{coarse} and {fine}");
    }
}
