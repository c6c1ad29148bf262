//! Tests queries that skip depth walks. The contacts must equal those of queries without memory.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::{Contact, ContactQuery, QuerySettings};
use crate::algebra::{NoClock, Pose};
use crate::body::shapes::torus;
use crate::body::{Body, BodySettings};

/// Returns how many of the contacts differ from all `expected` ones, and by how many their numbers
/// differ.
pub(super) fn different(contacts: &[Contact], expected: &[Contact]) -> usize {
    let is_expected = |contact: &&Contact| {
        expected.iter().any(|other| {
            (other.piece_a, other.piece_b) == (contact.piece_a, contact.piece_b)
                && (other.separation - contact.separation).abs() < 1e-9
                && other.normal.distance(contact.normal) < 1e-6
        })
    };
    let same = contacts.iter().filter(is_expected).count();
    contacts.len() - same + contacts.len().abs_diff(expected.len())
}

#[test]
fn skipped_walks_do_not_change_contacts() {
    let ring = Arc::new(Body::build(torus(0.03, 0.01, 24, 16), &BodySettings::default(), &mut |_| ()).unwrap());
    let settings = QuerySettings { tolerance: 5e-4, ..QuerySettings::default() };
    let mut query = ContactQuery::new(ring.clone(), ring.clone(), settings);
    let (mut walks, mut skipped, mut contacts, mut others) = (0, 0, 0, 0);
    for tick in 0..400 {
        let phase = f64::from(tick) * 0.01;
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 1.2 + 0.3 * phase.sin(), 0.2 * phase.cos(), phase);
        // The tubes overlap by up to 2 mm.
        let pose = Pose::new(turn, DVec3::new(0.019 + 0.001 * (1.7 * phase).sin(), 1e-3 * phase.cos(), 2e-3));
        let counters = *query.run(&pose, &NoClock);
        (walks, skipped) = (walks + counters.walks, skipped + counters.skipped_walks);
        let mut cold = ContactQuery::new(ring.clone(), ring.clone(), settings);
        cold.run(&pose, &NoClock);
        contacts += cold.found().len();
        others += different(query.found(), cold.found());
    }
    assert!(skipped > 1000 && contacts > 2000, "{skipped} skipped, {walks} walks, {contacts} contacts");
    assert!(200 * others < contacts, "{others} of {contacts} contacts differ");
}
