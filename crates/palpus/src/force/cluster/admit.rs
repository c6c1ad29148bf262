//! Step 1 of clustering: which contacts are clustered, and their canonical order.
//!
//! If there are too many contacts, contacts inside flat faces are left out first. They bear no
//! load, but among many equally deep contacts they would be chosen before the rim. Whether a
//! contact is inside a face follows from its tilt share, which takes longer than anything else
//! here. So the share is computed only when a contact is about to be chosen.

use std::cmp::Ordering;

use glam::DVec3;

use super::super::tilt::Tilted;
use super::{Linkage, LinkageCounters, LinkageSettings};
use crate::detect::Contact;

/// Cosine of 60°: contacts whose directions differ by more have clearly different normals.
const ELSEWHERE: f64 = 0.5;

/// A contact in the canonical order: its pieces, its separation, and its index.
pub(super) type Key = (u64, f64, u32);

/// A contact that may be chosen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    separation: f64,
    /// [`Contact::count`].
    count: f64,
    /// The contact's place in the canonical order.
    rank: u32,
}

impl Linkage {
    /// Collects at most twice the capacity of contacts. When the list is full, keeps the deepest
    /// half, so the work stays linear.
    pub(super) fn admit(&mut self, contacts: &[Contact], settings: &LinkageSettings) -> LinkageCounters {
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
        let inside = self.choose(contacts, settings);
        let chosen = self.order.len() as u32;
        counters.dropped = counters.admitted - inside - chosen;
        counters.admitted = chosen;
        counters
    }

    fn keep_deepest(&mut self, contacts: &[Contact]) {
        if self.order.len() > self.capacity {
            self.order.select_nth_unstable_by(self.capacity, |&i, &j| {
                let (first, second) = (&contacts[i as usize], &contacts[j as usize]);
                let pieces = |contact: &Contact| (contact.piece_a, contact.piece_b);
                let by_depth = first.separation.total_cmp(&second.separation);
                by_depth.then(pieces(first).cmp(&pieces(second))).then_with(|| by_points(first, second))
            });
            self.order.truncate(self.capacity);
        }
    }

    /// Step 2: sorts the contacts.
    pub(super) fn sort(&mut self, contacts: &[Contact]) {
        let key = |&i: &u32| {
            let Contact { piece_a, piece_b, separation, .. } = contacts[i as usize];
            (u64::from(piece_a) << 32 | u64::from(piece_b), separation, i)
        };
        self.keys.clear();
        self.keys.extend(self.order.iter().map(key));
        self.keys.sort_unstable_by(|one, other| {
            let by_key = one.0.cmp(&other.0).then_with(|| one.1.total_cmp(&other.1));
            by_key.then_with(|| by_points(&contacts[one.2 as usize], &contacts[other.2 as usize]))
        });
        self.order.clear();
        self.order.extend(self.keys.iter().map(|key| key.2));
    }

    /// Reduces the number of contacts to [`LinkageSettings::most`]. Returns the number of contacts
    /// that were found to be inside flat faces. The tilt shares of the chosen contacts are kept,
    /// because without the other contacts they would differ.
    fn choose(&mut self, contacts: &[Contact], settings: &LinkageSettings) -> u32 {
        self.kept.clear();
        if self.order.len() <= settings.most {
            return 0;
        }
        // The corners of a patch must be adjacent.
        self.sort(contacts);
        let Self { order, corners, tilts, candidates, kept, .. } = self;
        let smooth = settings.radius <= 0.0;
        corners.clear();
        if smooth {
            corners.extend(order.iter().map(|&i| Tilted::of(&contacts[i as usize], settings.contact_offset)));
            tilts.prepare(corners);
        }
        let mut inside = 0;
        // Moves the first `count` candidates that are not inside a face to the front of the list,
        // and returns their number and the number of candidates that were looked at.
        let mut take = |list: &mut [Candidate], count: usize, before: fn(&Candidate, &Candidate) -> Ordering| {
            let (mut taken, mut seen) = (0, 0);
            while taken < count && seen < list.len() {
                let rest = &mut list[seen..];
                let need = (count - taken).min(rest.len());
                if need < rest.len() {
                    rest.select_nth_unstable_by(need, before);
                }
                for k in seen..seen + need {
                    let rank = list[k].rank as usize;
                    let share = if smooth { tilts.share_of(rank, corners) } else { 1.0 };
                    if share > 0.0 {
                        kept.push((order[rank], share));
                        list.swap(taken, k);
                        taken += 1;
                    } else {
                        inside += 1;
                    }
                }
                seen += need;
            }
            (taken, seen)
        };
        candidates.clear();
        candidates.extend(order.iter().enumerate().map(|(rank, &i)| {
            let Contact { separation, count, .. } = contacts[i as usize];
            Candidate { separation, count, rank: rank as u32 }
        }));
        let (half, seen) = take(candidates, settings.most.div_ceil(2), deeper);
        let normal = |one: &Candidate| contacts[order[one.rank as usize] as usize].normal;
        let pushed = candidates[..half].iter().map(normal).sum::<DVec3>().normalize_or_zero();
        // Contacts with clearly different normals come before the rest.
        let others = &mut candidates[seen..];
        let mut turned = 0;
        for k in 0..others.len() {
            if normal(&others[k]).dot(pushed) < ELSEWHERE {
                others.swap(k, turned);
                turned += 1;
            }
        }
        let (turned, rest) = others.split_at_mut(turned);
        let seats = settings.most - half;
        let (taken, _) = take(turned, seats, deeper);
        take(rest, seats - taken, represents_more);
        order.clear();
        order.extend(kept.iter().map(|kept| kept.0));
        if smooth {
            kept.sort_unstable_by_key(|kept| kept.0);
        } else {
            kept.clear();
        }
        inside
    }
}

/// Orders candidates by their separations.
fn deeper(first: &Candidate, second: &Candidate) -> Ordering {
    first.separation.total_cmp(&second.separation).then(first.rank.cmp(&second.rank))
}

/// Orders candidates by the number of contacts that they represent, then by their separations. So
/// a sample, which is spread evenly over a face, is not displaced by contacts that are hardly
/// deeper and are all at one side.
fn represents_more(first: &Candidate, second: &Candidate) -> Ordering {
    second.count.total_cmp(&first.count).then_with(|| deeper(first, second))
}

/// Orders contacts of equal pieces and separations.
fn by_points(first: &Contact, second: &Contact) -> Ordering {
    let numbers = |c: &Contact| [c.point_a, c.point_b, c.normal].map(|v| v.to_array());
    let (first, second) = (numbers(first), numbers(second));
    let pairs = first.as_flattened().iter().zip(second.as_flattened());
    pairs.map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
