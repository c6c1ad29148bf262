//! Small octahedra, one for each size that is asked for.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};
use palpus::body::Body;
use palpus::detect::{Contact, ContactQuery, QuerySettings};

use super::deepest;

/// Contacts of one query: a small probe touches a handful of pieces.
const CAPACITY: usize = 1024;
/// The sizes halve from the body's own.
const HALVINGS: usize = 40;

/// Probes of sizes that halve, made when first asked for.
pub(super) struct Probes {
    turn: DQuat,
    size: f64,
    made: Vec<Option<Box<Probe>>>,
}

/// A probe and its query against one body.
pub(super) struct Probe {
    pub(super) query: ContactQuery,
}

impl Probes {
    pub(super) fn new(body: &Body, random: &mut Random) -> Self {
        let axis = random.vector().normalize_or(DVec3::Z);
        let turn = DQuat::from_axis_angle(axis, std::f64::consts::TAU * random.unit());
        Self { turn, size: body.size(), made: (0..HALVINGS).map(|_| None).collect() }
    }

    /// A probe of at most this radius, and at least half of it.
    pub(super) fn of_size(&mut self, body: &Arc<Body>, radius: f64) -> &mut Probe {
        let halvings = (self.size / radius).log2().ceil().clamp(0.0, (HALVINGS - 1) as f64);
        let (turn, radius) = (self.turn, self.size * 0.5_f64.powf(halvings));
        self.made[halvings as usize].get_or_insert_with(|| {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis * radius);
            let corners: Vec<DVec3> = axes.iter().flat_map(|&axis| [axis, -axis]).collect();
            #[expect(clippy::expect_used, reason = "an octahedron of positive size is a body")]
            let probe = Body::from_convex(&corners).expect("an octahedron");
            let settings = QuerySettings { tolerance: 0.0, capacity: CAPACITY, ..QuerySettings::default() };
            Box::new(Probe { query: ContactQuery::new(Arc::new(probe), body.clone(), settings) })
        })
    }
}

impl Probe {
    /// The deepest contact of the probe at `place`, if it overlaps the body.
    pub(super) fn deepest(&mut self, place: &Pose) -> Option<Contact> {
        deepest(self.query.contacts(place))
    }

    /// A contact's depth less what of it is the probe's own extent.
    pub(super) fn depth_at_centre(&self, contact: &Contact) -> f64 {
        let heights = self.query.a().mesh().vertices().iter().map(|v| -contact.normal.dot(*v));
        -contact.separation - heights.fold(0.0, f64::max)
    }
}
