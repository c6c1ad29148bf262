//! The contacts of the last query by pair, for pairs that this query does not measure again.
//!
//! A contact, or each corner of a patch, is kept as a [`PairMemory`] and extrapolated to the next
//! pose. So extrapolation never adds a contact that was not found before.

use super::Contact;
use super::memory::PairMemory;
use crate::algebra::Placement;

/// The last contacts of the pairs at the places of a front.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldContacts {
    entries: Vec<Entry>,
    /// Contacts that were kept in the last tick, and in this one.
    last: Vec<PairMemory>,
    now: Vec<PairMemory>,
    /// The most of them.
    capacity: usize,
    tick: u64,
}

/// The contacts of the pair at a place.
#[derive(Clone, Copy, Debug)]
struct Entry {
    pieces: [u32; 2],
    /// The tick in which it was kept.
    tick: u64,
    /// Its contacts among those of that tick.
    first: u32,
    count: u32,
}

impl HeldContacts {
    /// Memory for pairs at `places` places, with `capacity` contacts in all.
    pub(super) fn new(places: usize, capacity: usize) -> Self {
        let entry = Entry { pieces: [u32::MAX; 2], tick: 0, first: 0, count: 0 };
        let memories = || Vec::with_capacity(capacity);
        Self { entries: vec![entry; places], last: memories(), now: memories(), capacity, tick: 1 }
    }

    /// Starts a tick; drops the contacts that were not kept in the last one.
    pub(super) fn begin_tick(&mut self) {
        self.tick += 1;
        std::mem::swap(&mut self.last, &mut self.now);
        self.now.clear();
    }

    /// Drops all contacts.
    pub(super) fn clear(&mut self) {
        self.tick += 2;
    }

    /// Stores the contacts of the pair of pieces at `place`; if there is not enough room, the first
    /// ones.
    pub(super) fn keep(&mut self, place: u32, pieces: [u32; 2], contacts: &[Contact], pose_ba: &Placement) {
        let Some(entry) = self.entries.get_mut(place as usize) else { return };
        let contacts = &contacts[..contacts.len().min(self.capacity - self.now.len())];
        *entry = Entry { pieces, tick: self.tick, first: self.now.len() as u32, count: contacts.len() as u32 };
        self.now.extend(contacts.iter().map(|contact| PairMemory::of(contact, pose_ba)));
    }

    /// The contacts of the pair that were kept in the last tick; `None` if the pair is not stored.
    pub(super) fn known(&self, place: u32, pieces: [u32; 2]) -> Option<&[PairMemory]> {
        let entry = self.entries.get(place as usize)?;
        let is_known = entry.tick + 1 == self.tick && entry.pieces == pieces;
        is_known.then(|| &self.last[entry.first as usize..(entry.first + entry.count) as usize])
    }

    /// Extrapolates the pair's contacts of the last tick to this tick's pose, and adds those nearer
    /// than `tolerance` to `found`, until `found` has `most` contacts. Keeps them in this tick as
    /// well. Returns how many it added; `None` if the pair is not stored.
    pub(super) fn carry(
        &mut self,
        place: u32,
        pieces: [u32; 2],
        pose_ba: &Placement,
        tolerance: f64,
        most: usize,
        found: &mut Vec<Contact>,
    ) -> Option<u32> {
        let entry = self.entries.get_mut(place as usize)?;
        if entry.tick + 1 != self.tick || entry.pieces != pieces {
            return None;
        }
        let room = (self.capacity - self.now.len()) as u32;
        let count = entry.count.min(room);
        let known = entry.first as usize..(entry.first + count) as usize;
        *entry = Entry { tick: self.tick, first: self.now.len() as u32, count, ..*entry };
        self.now.extend_from_slice(&self.last[known.clone()]);
        let before = found.len();
        let room = most.saturating_sub(before);
        let contacts = self.last[known].iter().map(|memory| memory.extrapolate(pose_ba));
        found.extend(contacts.filter(|contact| contact.separation < tolerance).take(room));
        Some((found.len() - before) as u32)
    }
}
