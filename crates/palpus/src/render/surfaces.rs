//! Directions of contact forces with force shading: the smooth surfaces of two bodies.

use glam::DVec3;

use crate::algebra::Pose;
use crate::body::Body;
use crate::detect::Contact;
use crate::force::{SmoothBody, shade};

/// The smooth surfaces of both bodies of a pair.
#[derive(Clone, Debug)]
pub(super) struct Surfaces {
    a: SmoothBody,
    b: SmoothBody,
}

impl Surfaces {
    pub(super) fn new(a: &Body, b: &Body, crease_angle: f64) -> Self {
        let smooth = |body: &Body| SmoothBody::new(body, crease_angle);
        Self { a: smooth(a), b: smooth(b) }
    }

    /// Returns the direction in which `contact` pushes a, in b's frame.
    pub(super) fn direction(&self, contact: &Contact, [a, b]: [&Body; 2], pose_ba: &Pose, most_turn: f64) -> DVec3 {
        let point_a = pose_ba.inverse().point(contact.point_a);
        let mut side_a = self.a.at(a, contact.piece_a, contact.features.a, point_a);
        if let Some(side) = &mut side_a {
            side.normal = pose_ba.vector(side.normal);
        }
        let side_b = self.b.at(b, contact.piece_b, contact.features.b, contact.point_b);
        let mut direction = shade(contact.normal, side_a, side_b, most_turn);
        if side_a.is_none() {
            let local = |v: DVec3| pose_ba.inverse().vector(-v);
            let (normal, goal) = (local(contact.normal), local(direction));
            direction = -pose_ba.vector(SmoothBody::confine(a, contact.piece_a, contact.features.a, normal, goal));
        }
        if side_b.is_none() {
            direction = SmoothBody::confine(b, contact.piece_b, contact.features.b, contact.normal, direction);
        }
        direction
    }
}
