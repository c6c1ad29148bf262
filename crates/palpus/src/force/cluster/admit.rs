//! Step 1 of clustering: which contacts are clustered, and their canonical order.

use std::cmp::Ordering;

use super::{Linkage, LinkageCounters, LinkageSettings};
use crate::detect::Contact;

/// A contact in the canonical order: its pieces, its separation, and its index.
pub(super) type Key = (u64, f64, u32);

impl Linkage {
    /// Collects at most twice the capacity of contacts. When the list is full, keeps the deepest
    /// half, so the work stays linear.
    pub(super) fn admit(
        &mut self,
        contacts: &[Contact],
        settings: &LinkageSettings,
        expected: impl Fn(&Contact) -> f64,
    ) -> LinkageCounters {
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
        let inside = self.choose(contacts, settings, expected);
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
}

/// Orders contacts of equal pieces and separations.
fn by_points(first: &Contact, second: &Contact) -> Ordering {
    let numbers = |c: &Contact| [c.point_a, c.point_b, c.normal].map(|v| v.to_array());
    let (first, second) = (numbers(first), numbers(second));
    let pairs = first.as_flattened().iter().zip(second.as_flattened());
    pairs.map(|(x, y)| x.total_cmp(y)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}
