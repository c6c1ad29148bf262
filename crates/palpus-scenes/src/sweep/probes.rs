//! Small octahedra, one for each requested size.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};
use palpus::body::Body;
use palpus::detect::{Contact, ContactQuery, QuerySettings};

use super::deepest;

/// Maximum number of contacts of one query. A small probe touches only a few pieces.
const CAPACITY: usize = 1024;
/// Number of probe sizes. Each size is half of the previous one, starting at the body's size.
const HALVINGS: usize = 40;

/// Probes of different sizes, created on demand.
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

    /// Returns a probe whose radius is at most `radius` and at least half of it.
    pub(super) fn of_size(&mut self, body: &Arc<Body>, radius: f64) -> &mut Probe {
        let halvings = (self.size / radius).log2().ceil().clamp(0.0, (HALVINGS - 1) as f64);
        let (turn, radius) = (self.turn, self.size * 0.5_f64.powf(halvings));
        self.made[halvings as usize].get_or_insert_with(|| {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis * radius);
            let corners: Vec<DVec3> = axes.iter().flat_map(|&axis| [axis, -axis]).collect();
            #[expect(clippy::expect_used, reason = "an octahedron of positive size is a body")]
            let probe = Body::from_convex(&corners).expect("an octahedron is a valid body");
            let settings = QuerySettings { tolerance: 0.0, capacity: CAPACITY, ..QuerySettings::default() };
            Box::new(Probe { query: ContactQuery::new(Arc::new(probe), body.clone(), settings) })
        })
    }
}

impl Probe {
    /// Returns the deepest contact of the probe at `place`. `None` if it does not overlap the body.
    pub(super) fn deepest(&mut self, place: &Pose) -> Option<Contact> {
        deepest(self.query.contacts(place))
    }

    /// Returns the depth of a contact minus the probe's extent along the normal.
    pub(super) fn depth_at_centre(&self, contact: &Contact) -> f64 {
        let heights = self.query.a().mesh().vertices().iter().map(|v| -contact.normal.dot(*v));
        -contact.separation - heights.fold(0.0, f64::max)
    }
}
