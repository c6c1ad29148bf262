//! The end of step 1 of clustering: the choice of contacts, if there are more than
//! [`LinkageSettings::most`].
//!
//! 1. A quarter are the deepest contacts, which stop the bodies.
//! 2. Up to a quarter are the deepest contacts with clearly different normals, which stop a tool
//!    that is thrown back.
//! 3. The rest is *drawn* from all other contacts. Each drawn contact counts as several. If it did
//!    not, the deepest contacts would outweigh the others. When a flat face lands flush, they are
//!    all at one side, so the wrench would act there and tilt the face to the other side, in each
//!    tick anew.
//!
//! *Deepest* refers to the separations that are expected at the end of the step.
//!
//! The draw is priority sampling [Duffield, Lund, Thorup 2007]. Each contact has a *size* s, which
//! is mainly its load, and each pair of pieces has a random number u from 0 to 1, always the same.
//! The *priority* of a contact is s/u. The contacts with the largest priorities are drawn. If τ is
//! the largest priority of all others, a contact is drawn with the probability min(1, s/τ), and
//! stands for max(1, τ/s) contacts. Our addition: a drawn contact fades in between the priorities τ
//! and (1 + [`DRAW_FADE`]) τ, so the wrench does not jump when it is drawn. Its number is divided
//! by the mean of the faded count over all u, so sums over the drawn contacts have no bias.
//!
//! Contacts inside flat faces bear no load, but among many equally deep contacts they would be
//! chosen before the rim. They are left out. Whether a contact is inside a face follows from its
//! tilt share, which takes longer than anything else here. So the share is computed only when a
//! contact is about to be chosen.

use std::cmp::Ordering;

use glam::DVec3;

use super::super::tilt::Tilted;
use super::{Linkage, LinkageSettings};
use crate::algebra::Random;
use crate::algebra::tolerance::{DRAW_EVEN, DRAW_FADE};
use crate::detect::Contact;

/// Cosine of 60°: contacts whose directions differ by more have clearly different normals.
const ELSEWHERE: f64 = 0.5;

/// A contact that may be chosen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Expected separation, m.
    separation: f64,
    /// The contact's place in the canonical order.
    rank: u32,
    /// s of the module's description, m.
    size: f64,
    /// s/u of the module's description, m.
    priority: f64,
}

impl Candidate {
    /// Returns the engagement (m) that the contact will have, if it pushes below a separation of
    /// `contact_offset` (m).
    fn engagement(&self, contact_offset: f64) -> f64 {
        (contact_offset - self.separation).max(0.0)
    }

    /// Returns the number of contacts that this drawn contact represents, if contacts are drawn
    /// above the priority `limit`.
    fn represents(&self, limit: f64) -> f64 {
        let chance = self.size / limit;
        let fade = ((self.priority / limit - 1.0) / DRAW_FADE).clamp(0.0, 1.0);
        // Random numbers u up to `full` give the full count, and those up to `last` a faded count.
        let full = chance / (1.0 + DRAW_FADE);
        if full >= 1.0 {
            return 1.0;
        }
        let last = chance.min(1.0);
        let mean = full + (chance * (last / full).ln() - (last - full)) / DRAW_FADE;
        fade / mean
    }
}

impl Linkage {
    /// Reduces the number of contacts to [`LinkageSettings::most`]. Returns the number of contacts
    /// that were found to be inside flat faces.
    ///
    /// The tilt shares of the chosen contacts are kept, because without the other contacts they
    /// would differ. They are multiplied by the number of contacts that each contact represents.
    pub(super) fn choose(
        &mut self,
        contacts: &[Contact],
        settings: &LinkageSettings,
        expected: impl Fn(&Contact) -> f64,
    ) -> u32 {
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
        candidates.clear();
        for (rank, one) in order.iter().map(|&i| &contacts[i as usize]).enumerate() {
            if smooth && one.inside && tilts.is_borne(rank, corners) {
                continue;
            }
            candidates.push(Candidate { separation: expected(one), rank: rank as u32, size: 0.0, priority: 0.0 });
        }
        let mut inside = (order.len() - candidates.len()) as u32;
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
        let contact = |one: &Candidate| &contacts[order[one.rank as usize] as usize];
        let quarter = settings.most.div_ceil(4);
        let (deepest, seen) = take(candidates, quarter, deeper);
        let pushed = candidates[..deepest].iter().map(|one| contact(one).normal).sum::<DVec3>().normalize_or_zero();
        let others = &mut candidates[seen..];
        let turned = partition(others, |one| contact(one).normal.dot(pushed) < ELSEWHERE);
        let (turned, seen) = take(&mut others[..turned], quarter.min(settings.most - deepest), deeper);
        let others = &mut others[seen..];
        give_lots(others, settings, contact);
        let (drawn, seen) = take(others, settings.most - deepest - turned, by_priority);
        let (drawn, unseen) = (&others[..drawn], &others[seen..]);
        let limit = unseen.iter().map(|one| one.priority).fold(0.0, f64::max);
        // While only a few contacts are left out, the drawn ones hardly represent them.
        let limit = limit * (unseen.len() as f64 / quarter as f64).min(1.0);
        if limit > 0.0 {
            let first = kept.len() - drawn.len();
            kept[first..].iter_mut().zip(drawn).for_each(|(kept, one)| kept.1 *= one.represents(limit));
        }
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

/// Moves the chosen candidates to the front of the list, and returns their number.
fn partition(list: &mut [Candidate], is_chosen: impl Fn(&Candidate) -> bool) -> usize {
    let mut count = 0;
    for k in 0..list.len() {
        if is_chosen(&list[k]) {
            list.swap(k, count);
            count += 1;
        }
    }
    count
}

/// Sets the sizes and priorities of the candidates.
fn give_lots<'c>(list: &mut [Candidate], settings: &LinkageSettings, contact: impl Fn(&Candidate) -> &'c Contact) {
    let sum: f64 = list.iter().map(|one| one.engagement(settings.contact_offset)).sum();
    // A part of the mean load is added, so that no contact represents very many others.
    let even = if sum > 0.0 { DRAW_EVEN * sum / list.len() as f64 } else { settings.contact_offset };
    for one in list {
        let contact = contact(one);
        one.size = contact.count * (one.engagement(settings.contact_offset) + even);
        one.priority = one.size / lot([contact.piece_a, contact.piece_b]);
    }
}

/// Returns u of the module's description for a pair of pieces.
fn lot(pieces: [u32; 2]) -> f64 {
    1.0 - Random::new(u64::from(pieces[0]) << 32 | u64::from(pieces[1])).unit()
}

/// Orders candidates by their separations.
fn deeper(first: &Candidate, second: &Candidate) -> Ordering {
    first.separation.total_cmp(&second.separation).then(first.rank.cmp(&second.rank))
}

/// Orders candidates by their priorities, the largest first.
fn by_priority(first: &Candidate, second: &Candidate) -> Ordering {
    second.priority.total_cmp(&first.priority).then_with(|| deeper(first, second))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_contacts_fade_in_and_count_as_one_in_the_mean() {
        const LIMIT: f64 = 2.0;
        let drawn = |size: f64, priority: f64| Candidate { separation: 0.0, rank: 0, size, priority };
        for size in [0.01, 0.5, 1.9, 2.0, 2.1, 2.9, 3.1, 50.0] {
            let number = |u: f64| {
                let one = drawn(size, size / u);
                if one.priority > LIMIT { one.represents(LIMIT) } else { 0.0 }
            };
            let steps = 1_000_000;
            let mean =
                (0..steps).map(|k| number((f64::from(k) + 0.5) / f64::from(steps))).sum::<f64>() / f64::from(steps);
            assert!((mean - 1.0).abs() < 1e-3, "size {size}: the mean is {mean}");
            if size < LIMIT {
                // The contact counts nothing where it is drawn.
                assert!(drawn(size, LIMIT * (1.0 + 1e-9)).represents(LIMIT) < 1e-5, "size {size}");
            }
        }
    }
}
