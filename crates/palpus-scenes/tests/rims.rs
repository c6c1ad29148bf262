//! Tests contacts along a curved rim that tilts onto a flat face. The rim touches with its lowest
//! point only. If the body turns a little, other parts of the rim touch, even on the far side.

mod bodies;

use std::f64::consts::TAU;
use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Random, Twist};
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus::render::{Limits, Object, Settings, World};
use palpus_scenes::shape::{TORUS_MAJOR_RADIUS, cuboid, torus};

const SEED: u64 = 0x41b5_0001;
const DT: f64 = 1e-3;
const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };
/// Contacts are searched within this distance, m.
const TOLERANCE: f64 = 3e-4;
/// Largest overlap when a ring lands, m. The contacts of a rim share one stiffness. So the few
/// contacts that stop a part of the ring yield, and the bar is larger than for a tool.
const BAR: f64 = 1.5e-4;

/// Returns a table whose upper face is at z = 0, and its pose.
fn table() -> (Arc<Body>, Pose) {
    (body(&cuboid(DVec3::new(0.5, 0.5, 0.02))), Pose::from_translation(DVec3::Z * -0.01))
}

/// Returns the height of the lowest vertex, m.
fn lowest(body: &Body, pose: &Pose) -> f64 {
    body.mesh().vertices().iter().map(|&vertex| pose.point(vertex).z).fold(f64::INFINITY, f64::min)
}

#[test]
fn query_finds_the_parts_of_a_rim_that_a_turn_brings_into_contact() {
    let ((table, at), ring) = (table(), body(&torus()));
    // The slope of the rim at an angle φ from its lowest point is tilt · sin φ.
    for (tilt, turn, expected) in [(0.02, 0.0, 0.1), (0.02, 0.025, 1.0), (0.05, 0.025, 0.4), (0.02, 1e-3, 0.1)] {
        let settings = QuerySettings {
            tolerance: 2.5 * tilt * TORUS_MAJOR_RADIUS,
            patch_angle: Some(0.1),
            turn,
            ..QuerySettings::default()
        };
        let rotation = DQuat::from_rotation_x(tilt);
        let height = 1e-5 - lowest(&ring, &Pose::new(rotation, DVec3::ZERO));
        let ring_at = Pose::new(rotation, DVec3::Z * height);
        let mut query = ContactQuery::new(ring.clone(), table.clone(), settings);
        let contacts = query.contacts(&(at.inverse() * ring_at));
        // The sectors of the rim, 10° each, in which contacts lie.
        let mut sectors = [false; 36];
        for contact in contacts {
            assert!(contact.separation >= 0.0 && contact.normal.z > 0.999, "{contact:?}");
            let point = contact.midpoint();
            sectors[(point.y.atan2(point.x).rem_euclid(TAU) / TAU * 36.0) as usize % 36] = true;
        }
        let part = sectors.iter().filter(|&&seen| seen).count() as f64 / 36.0;
        assert!((part - expected).abs() < 0.15, "tilt {tilt}, turn {turn}: contacts on {part} of the rim");
    }
}

/// Drops a ring from a little above a table, tilted and turning. Returns its largest overlap with
/// the table, m.
fn overlap_of_a_landing(ring: &Arc<Body>, random: &mut Random) -> f64 {
    let mut world = World::new(Settings::coupled(LIMITS, DT, TOLERANCE)).expect("valid settings");
    world.set_gravity(DVec3::Z * -9.81);
    let (table, at) = table();
    world.add(Object::fixed(table, at)).expect("a valid pose");
    let across = DVec3::new(random.signed(), random.signed(), 0.0).normalize_or(DVec3::X);
    let rotation = DQuat::from_axis_angle(across, random.between(0.05, 0.4));
    let height = random.between(0.002, 0.02) - lowest(ring, &Pose::new(rotation, DVec3::ZERO));
    let object = Object::free(ring.clone(), Pose::new(rotation, DVec3::Z * height), 1000.0);
    let id = world.add(object).expect("a valid object");
    assert!(world.throw(id, Twist { linear: DVec3::ZERO, angular: random.vector() * 5.0 }));
    let mut deepest: f64 = 0.0;
    for _ in 0..300 {
        world.step(&[], DT, &NoClock);
        deepest = deepest.max(-lowest(ring, &world.pose(id)));
    }
    deepest
}

#[test]
fn rings_land_flat() {
    let (ring, mut random) = (body(&torus()), Random::new(SEED));
    for landing in 0..40 {
        let overlap = overlap_of_a_landing(&ring, &mut random);
        assert!(overlap <= BAR, "landing {landing} of seed {SEED:#x}: {overlap} m");
    }
}
