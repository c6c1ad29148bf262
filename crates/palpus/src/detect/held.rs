//! The contacts of the last tick, carried to this tick's pose: what is felt of a pair that was not
//! looked at anew.
//!
//! 1. A contact, or each corner of a patch, is kept as two points, one in each body's frame, and its
//!    normal, in the frame of the body whose face it is (else b's).
//! 2. At the next pose the points and the normal go with their bodies, and the separation is the
//!    distance of the two points along the normal.
//!
//! A distance changes as its witness points move apart along its normal, and so does a depth: the
//! separation is right to first order in the motion. All that it says is what was true of this pair,
//! so no contact pushes that was not there.

use glam::DVec3;

use super::Contact;
use super::contact::points_about;
use crate::algebra::Placement;
use crate::body::{Feature, FeaturePair};

/// The last contacts of the pairs at the places of a front.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldContacts {
    entries: Vec<Entry>,
    /// Contacts that were kept in the last tick, and in this one.
    last: Vec<Carried>,
    now: Vec<Carried>,
    /// The most of them.
    capacity: usize,
    tick: u64,
}

/// What is known of the pair at a place.
#[derive(Clone, Copy, Debug)]
struct Entry {
    pieces: [u32; 2],
    /// In which it was kept.
    tick: u64,
    /// Its contacts among those of that tick.
    first: u32,
    count: u32,
}

#[derive(Clone, Copy, Debug)]
struct Carried {
    features: FeaturePair,
    /// In a's frame.
    point_a: DVec3,
    /// In b's frame.
    point_b: DVec3,
    normal: DVec3,
    turns_with_a: bool,
    slope: f64,
}

impl HeldContacts {
    /// Memory for pairs at `places` places, with `capacity` contacts in all.
    pub(super) fn new(places: usize, capacity: usize) -> Self {
        let entry = Entry { pieces: [u32::MAX; 2], tick: 0, first: 0, count: 0 };
        let carried = || Vec::with_capacity(capacity);
        Self { entries: vec![entry; places], last: carried(), now: carried(), capacity, tick: 1 }
    }

    /// What was not kept in the last tick is forgotten.
    pub(super) fn begin_tick(&mut self) {
        self.tick += 1;
        std::mem::swap(&mut self.last, &mut self.now);
        self.now.clear();
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.tick += 2;
    }

    /// Keeps which contacts the pair of pieces at `place` has; of more than there is room for, the first.
    pub(super) fn keep(&mut self, place: u32, pieces: [u32; 2], contacts: &[Contact], pose_ba: &Placement) {
        let Some(entry) = self.entries.get_mut(place as usize) else { return };
        let contacts = &contacts[..contacts.len().min(self.capacity - self.now.len())];
        *entry = Entry { pieces, tick: self.tick, first: self.now.len() as u32, count: contacts.len() as u32 };
        self.now.extend(contacts.iter().map(|contact| Carried::of(contact, pose_ba)));
    }

    /// Adds to `found` the contacts nearer than `tolerance` that were kept of the pair in the last tick, at this tick's pose, until `found`
    /// has `most` of them, and keeps them in this tick as well. Returns how many it added; `None` if nothing is known of the pair.
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
        let contacts = self.last[known].iter().map(|carried| carried.at(pieces, pose_ba));
        found.extend(contacts.filter(|contact| contact.separation < tolerance).take(room));
        Some((found.len() - before) as u32)
    }
}

impl Carried {
    fn of(contact: &Contact, pose_ba: &Placement) -> Self {
        let turns_with_a = matches!(contact.features.a, Feature::Face(_));
        Self {
            features: contact.features,
            point_a: pose_ba.inverse_point(contact.point_a),
            point_b: contact.point_b,
            normal: if turns_with_a { pose_ba.inverse_vector(contact.normal) } else { contact.normal },
            turns_with_a,
            slope: contact.slope,
        }
    }

    /// The contact where the bodies are now.
    fn at(&self, pieces: [u32; 2], pose_ba: &Placement) -> Contact {
        let normal = if self.turns_with_a { pose_ba.vector(self.normal) } else { self.normal };
        let point_a = pose_ba.point(self.point_a);
        let separation = normal.dot(point_a - self.point_b);
        let [point_a, point_b] = points_about(point_a.midpoint(self.point_b), normal, separation);
        Contact {
            piece_a: pieces[0],
            piece_b: pieces[1],
            features: self.features,
            point_a,
            point_b,
            normal,
            separation,
            slope: self.slope,
        }
    }
}
