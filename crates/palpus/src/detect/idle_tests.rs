//! Tests queries with idle pairs. The contacts must equal those of queries without memory.

use std::sync::Arc;

use glam::{DQuat, DVec3, EulerRot};

use super::moved_tests::different;
use super::{Contact, ContactQuery, QuerySettings};
use crate::algebra::{NoClock, Pose, Random};
use crate::body::shapes::torus;
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};

const SEED: u64 = 0x1d1e;

/// A ring with a rough surface. Most of its pieces end at valleys.
fn rough_ring() -> Arc<Body> {
    let (smooth, mut random) = (torus(0.03, 0.01, 24, 16), Random::new(SEED));
    let vertices = smooth.vertices().iter().map(|&v| v + random.vector() * 5e-4).collect();
    let mesh = Mesh::from_soup(&PolygonSoup::from_triangles(vertices, smooth.triangles())).unwrap().0;
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

/// A tube beside another one, mostly apart. `phase` is in radians.
fn beside(phase: f64) -> Pose {
    let turn = DQuat::from_euler(EulerRot::XYZ, 1.2 + 0.3 * phase.sin(), 0.2 * phase.cos(), phase);
    Pose::new(turn, DVec3::new(0.0215 + 0.0015 * (1.7 * phase).sin(), 1e-3 * phase.cos(), 2e-3))
}

/// Queries two rough rings with these settings, along a motion of `pace` (rad) for each query.
/// Returns the number of contacts of pieces that are apart, the number of those that differ, and
/// how often a pair was idle.
fn compare(ring: &Arc<Body>, settings: &QuerySettings, pace: f64) -> [usize; 3] {
    let mut query = ContactQuery::new(ring.clone(), ring.clone(), *settings);
    let (mut contacts, mut others, mut idle) = (0, 0, 0);
    for tick in 0..400 {
        let pose = beside(pace * f64::from(tick));
        idle += query.run(&pose, &NoClock).traversal.idle as usize;
        let mut cold = ContactQuery::new(ring.clone(), ring.clone(), *settings);
        cold.run(&pose, &NoClock);
        // Overlapping pieces may be equally deep along two normals.
        let apart = |query: &ContactQuery| -> Vec<Contact> {
            query.found().iter().filter(|contact| contact.separation > 1e-9).copied().collect()
        };
        let (warm, cold) = (apart(&query), apart(&cold));
        contacts += cold.len();
        others += different(&cold, &warm);
    }
    [contacts, others, idle]
}

#[test]
fn idle_pairs_have_no_contacts() {
    let ring = rough_ring();
    let points = QuerySettings { tolerance: 2e-3, ..QuerySettings::default() };
    let patches = QuerySettings { patch_angle: Some(0.02), ..points };
    let turning = QuerySettings { turn: 5e-4, ..patches };
    for (name, settings) in [("points", points), ("patches", patches), ("turning", turning)] {
        for pace in [1e-4, 3e-4, 3e-3] {
            let [contacts, others, idle] = compare(&ring, &settings, pace);
            assert!(contacts > 400 && others == 0, "{name}, pace {pace}: {others} of {contacts} differ");
            assert!(pace > 1e-3 || idle > 100, "{name}, pace {pace}: {idle} idle");
        }
    }
}
