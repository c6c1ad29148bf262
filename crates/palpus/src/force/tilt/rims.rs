//! The contacts that bear the load of other contacts inside flat faces.
//!
//! A contact inside a flat face ([`Contact::inside`]) bears no load if contacts at the rim of the
//! face press as hard. Let m be the largest engagement of the contacts that are not inside, times
//! max(1 − (1 − κ)/r², 0). κ is the squared cosine between the two directions and r the slope of
//! the patch, so contacts of other surfaces do not count. Then the contact inside keeps the part
//! (max(1 − m/w, 0))³ of its share, and at least [`TILT_INSIDE`]. So its load changes continuously
//! when the contacts at the rim begin to press. If the query was cut off and has not found them,
//! the contact keeps its load.
//!
//! [`Contact::inside`]: crate::detect::Contact::inside

use super::Tilted;
use crate::algebra::tolerance::TILT_INSIDE;
use crate::algebra::{Directions, LANES};

/// The contacts that press and are not inside flat faces.
#[derive(Clone, Debug)]
pub(super) struct Rims {
    groups: Vec<Group>,
    /// The group that had the largest engagement beside the last contact inside.
    last: usize,
}

/// Four contacts. Lanes without a contact have no engagement.
#[derive(Clone, Copy, Debug)]
struct Group {
    directions: Directions,
    engagement: [f64; LANES],
    /// The largest of the engagements.
    most: f64,
}

impl Rims {
    /// Allocates memory for `capacity` contacts.
    pub(super) fn new(capacity: usize) -> Self {
        Self { groups: Vec::with_capacity(capacity.div_ceil(LANES)), last: 0 }
    }

    /// Stores the contacts at rims, if any contact is inside a flat face.
    pub(super) fn prepare(&mut self, contacts: &[Tilted]) {
        self.groups.clear();
        self.last = 0;
        if !contacts.iter().any(|contact| contact.inside) {
            return;
        }
        let pressing = contacts.iter().filter(|contact| !contact.inside && contact.engagement > 0.0);
        for (k, contact) in pressing.enumerate() {
            let lane = k % LANES;
            if lane == 0 {
                self.groups.push(Group { directions: Directions::NONE, engagement: [0.0; LANES], most: 0.0 });
            }
            let Some(group) = self.groups.last_mut() else { return };
            group.directions.set(lane, contact.direction);
            group.engagement[lane] = contact.engagement;
            group.most = group.most.max(contact.engagement);
        }
    }

    /// Returns the part of its share that a contact inside a flat face keeps.
    pub(super) fn part(&mut self, one: &Tilted) -> f64 {
        let scale = 1.0 / (one.slope * one.slope);
        let of_group = |group: &Group| {
            let alike = group.directions.alike(one.direction);
            let mut most = 0.0;
            for (engagement, alike) in group.engagement.into_iter().zip(alike) {
                let load = engagement * (1.0 - (1.0 - alike) * scale);
                most = if load > most { load } else { most };
            }
            most
        };
        let mut most = self.groups.get(self.last).map_or(0.0, of_group);
        for (k, group) in self.groups.iter().enumerate() {
            if most >= one.engagement {
                break;
            }
            if group.most <= most {
                continue;
            }
            let load = of_group(group);
            (most, self.last) = if load > most { (load, k) } else { (most, self.last) };
        }
        if most >= one.engagement {
            return TILT_INSIDE;
        }
        let lighter = 1.0 - most / one.engagement;
        (lighter * lighter * lighter).max(TILT_INSIDE)
    }
}
