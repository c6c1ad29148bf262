//! The contacts of the last query for each pair, used for pairs that this query does not measure.
//!
//! A contact, or each corner of a patch, is kept as a [`PairMemory`] and extrapolated to the next
//! pose. So extrapolation never adds a contact that was not found before.

use super::Contact;
use super::apart::beside_valley_again;
use super::memory::PairMemory;
use super::query_input::QueryInput;
use crate::algebra::Placement;

/// The last contacts of the pairs of a front.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldContacts {
    entries: Vec<Entry>,
    /// Largest number of entries.
    places: usize,
    /// Contacts that were stored in the last tick.
    last: Vec<PairMemory>,
    /// Contacts that were stored in this tick.
    now: Vec<PairMemory>,
    /// Largest number of contacts in each list.
    capacity: usize,
    tick: u64,
}

/// The contacts of one pair.
#[derive(Clone, Copy, Debug)]
struct Entry {
    pieces: [u32; 2],
    /// The tick in which the entry was stored.
    tick: u64,
    /// Index of the first contact in that tick's list.
    first: u32,
    count: u32,
    beside_valley: bool,
}

impl Entry {
    /// The entry of a place without a pair.
    const NONE: Self = Self { pieces: [u32::MAX; 2], tick: 0, first: 0, count: 0, beside_valley: false };
}

impl HeldContacts {
    /// Allocates memory for `places` pairs with `capacity` contacts in total.
    pub(super) fn new(places: usize, capacity: usize) -> Self {
        let memories = || Vec::with_capacity(capacity);
        Self { entries: Vec::with_capacity(places), places, last: memories(), now: memories(), capacity, tick: 1 }
    }

    /// Writes to the memory of all places, so that the system provides all of it now.
    pub(super) fn use_all_places(&mut self) {
        self.entries.resize(self.places, Entry::NONE);
    }

    /// Starts a tick. Drops all contacts older than the last tick.
    pub(super) fn begin_tick(&mut self) {
        self.tick += 1;
        std::mem::swap(&mut self.last, &mut self.now);
        self.now.clear();
    }

    /// Drops all contacts.
    pub(super) fn clear(&mut self) {
        self.tick += 2;
    }

    /// Stores the contacts of the pair of pieces at `place`, which may be `beside_valley`. If there
    /// is not enough room, stores only the first contacts.
    pub(super) fn keep(
        &mut self,
        place: u32,
        pieces: [u32; 2],
        contacts: &[Contact],
        beside_valley: bool,
        pose_ba: &Placement,
    ) {
        let place = place as usize;
        if place >= self.places {
            return;
        }
        if place >= self.entries.len() {
            self.entries.resize(place + 1, Entry::NONE);
        }
        let entry = &mut self.entries[place];
        let contacts = &contacts[..contacts.len().min(self.capacity - self.now.len())];
        let (first, count) = (self.now.len() as u32, contacts.len() as u32);
        *entry = Entry { pieces, tick: self.tick, first, count, beside_valley };
        self.now.extend(contacts.iter().map(|contact| PairMemory::of(contact, pose_ba)));
    }

    /// Returns the contacts of the pair that were stored in the last tick; `None` if the pair is
    /// not stored.
    pub(super) fn known(&self, place: u32, pieces: [u32; 2]) -> Option<&[PairMemory]> {
        let entry = self.entries.get(place as usize)?;
        let is_known = entry.tick + 1 == self.tick && entry.pieces == pieces;
        is_known.then(|| &self.last[entry.first as usize..(entry.first + entry.count) as usize])
    }

    /// Extrapolates the pair's contacts of the last tick to this tick's pose. Adds the contacts
    /// within the tolerance to `found`, until `found` has `most` contacts. Stores all of the
    /// pair's contacts for this tick too. Returns the number of added contacts; `None` if the pair
    /// is not stored.
    pub(super) fn carry(
        &mut self,
        place: u32,
        pieces: [u32; 2],
        input: &QueryInput<'_>,
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
        let (known, is_near) = (&self.last[known], |contact: &Contact| contact.separation < input.tolerance);
        if entry.beside_valley {
            let contacts = known.iter().map(|memory| beside_valley_again(input, memory));
            found.extend(contacts.filter(is_near).take(room));
        } else {
            let contacts = known.iter().map(|memory| memory.extrapolate(&input.place));
            found.extend(contacts.filter(is_near).take(room));
        }
        Some((found.len() - before) as u32)
    }
}
