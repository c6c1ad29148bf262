//! The contacts of the last tick, carried to this tick's pose: what is felt of a pair for which there was no time.
//!
//! 1. A contact is kept as two points, one in each body's frame, and its normal, in the frame of the body whose face it is
//!    (else b's).
//! 2. At the next pose the points and the normal go with their bodies, and the separation is measured anew: it is the gap between the two
//!    supports along the normal.
//!
//! No direction separates two convex pieces by more than their distance, and none needs less motion than their depth. So the separation is
//! never more than the true one: a contact may be felt a little too soon or too hard, by the square of how far its normal has turned.

use glam::DVec3;

use super::Contact;
use super::contact::points_about;
use crate::algebra::Placement;
use crate::body::{Feature, FeaturePair, Polytope};

/// What is known of a pair from the last tick.
#[derive(Clone, Copy, Debug)]
pub(super) enum Held {
    /// Nothing.
    Unknown,
    /// That it was no contact.
    NoContact,
    /// Where its contact is now.
    Contact(Contact),
}

/// The last contacts of the pairs at the places of a front.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldContacts {
    entries: Vec<Entry>,
    tick: u64,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    pieces: [u32; 2],
    tick: u64,
    contact: Option<Carried>,
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
    /// Vertices near the supports.
    hub: [u32; 2],
}

impl HeldContacts {
    /// Memory for pairs at `places` places.
    pub(super) fn new(places: usize) -> Self {
        let entry = Entry { pieces: [u32::MAX; 2], tick: 0, contact: None };
        Self { entries: vec![entry; places], tick: 1 }
    }

    /// True if it was made for any place at all.
    pub(super) fn has_memory(&self) -> bool {
        !self.entries.is_empty()
    }

    /// What was not kept in the last tick is forgotten.
    pub(super) fn begin_tick(&mut self) {
        self.tick += 1;
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.tick += 2;
    }

    /// Keeps what the pair of pieces at `place` was found to be.
    pub(super) fn keep(
        &mut self,
        place: u32,
        pieces: [u32; 2],
        contact: Option<&Contact>,
        (piece_a, piece_b): (&Polytope, &Polytope),
        pose_ba: &Placement,
    ) {
        let carried = contact.map(|contact| {
            let turns_with_a = matches!(contact.features.a, Feature::Face(_));
            Carried {
                features: contact.features,
                point_a: pose_ba.inverse_point(contact.point_a),
                point_b: contact.point_b,
                normal: if turns_with_a { pose_ba.inverse_vector(contact.normal) } else { contact.normal },
                turns_with_a,
                hub: [contact.features.a.some_vertex(piece_a), contact.features.b.some_vertex(piece_b)],
            }
        });
        if let Some(entry) = self.entries.get_mut(place as usize) {
            *entry = Entry { pieces, tick: self.tick, contact: carried };
        }
    }

    /// What was kept of the pair in the last tick, at this tick's pose; it counts as kept in this tick.
    pub(super) fn carry(
        &mut self,
        place: u32,
        pieces: [u32; 2],
        (piece_a, piece_b): (&Polytope, &Polytope),
        pose_ba: &Placement,
        tolerance: f64,
    ) -> Held {
        let tick = self.tick;
        let Some(entry) = self.entries.get_mut(place as usize) else { return Held::Unknown };
        if entry.tick + 1 < tick || entry.pieces != pieces {
            return Held::Unknown;
        }
        entry.tick = tick;
        let Some(carried) = &mut entry.contact else { return Held::NoContact };
        let normal = if carried.turns_with_a { pose_ba.vector(carried.normal) } else { carried.normal };
        let down = -pose_ba.inverse_vector(normal);
        let support_a = piece_a.support_from(carried.hub[0], down);
        let support_b = piece_b.support_from(carried.hub[1], normal);
        carried.hub = [support_a, support_b];
        let separation = normal.dot(pose_ba.point(piece_a.vertex(support_a)) - piece_b.vertex(support_b));
        if separation >= tolerance {
            return Held::NoContact;
        }
        let midpoint = pose_ba.point(carried.point_a).midpoint(carried.point_b);
        let [point_a, point_b] = points_about(midpoint, normal, separation);
        Held::Contact(Contact {
            piece_a: pieces[0],
            piece_b: pieces[1],
            features: carried.features,
            point_a,
            point_b,
            normal,
            separation,
            slope: 0.0,
        })
    }
}
