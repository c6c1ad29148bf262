//! Tests the contact tolerance that is chosen for two bodies.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::tolerance::LEAST_BY_PLAY;
use palpus::algebra::{NoClock, Pose};
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus::render::{Object, ProbeState, Settings, World, contact_tolerance, tolerance_by_play, tolerance_by_size};
use palpus_scenes::shape::{PEG_RADIUS, cuboid, disc, hole_block, sphere, v_groove};

/// Clearance of the peg in its hole, m.
const CLEARANCE: f64 = 2e-4;

fn peg_and_hole() -> [Arc<Body>; 2] {
    [body(&disc(PEG_RADIUS, 0.02, 32)), body(&hole_block(CLEARANCE))]
}

/// The peg in its hole, moved aside by `aside` (m).
fn in_hole(aside: f64) -> Pose {
    Pose::new(DQuat::IDENTITY, DVec3::new(aside, 0.0, -0.0125))
}

#[test]
fn tolerance_is_half_of_the_play_of_a_peg() {
    let [peg, hole] = peg_and_hole();
    assert_eq!(tolerance_by_size(&peg, &hole), 0.01 * peg.size().min(hole.size()));
    // The result does not depend on where in the hole the peg is, even if it overlaps a little.
    for aside in [0.0, 0.4 * CLEARANCE, 0.6 * CLEARANCE] {
        let play = 2.0 * contact_tolerance(&peg, &hole, &in_hole(aside));
        // The peg has flat sides, so its play across them is a little larger.
        assert!((0.95..1.25).contains(&(play / CLEARANCE)), "{play} at {aside}");
    }
    let above = Pose::from_translation(DVec3::Z * 0.1);
    assert_eq!(contact_tolerance(&peg, &hole, &above), tolerance_by_size(&peg, &hole));
    let least = tolerance_by_play(1.0, [(&peg, &hole, in_hole(0.0))]);
    assert_eq!(least, LEAST_BY_PLAY, "the play is far below the tolerance of 1 m");
}

#[test]
fn peg_in_the_middle_of_its_hole_touches_nothing() {
    let [peg, hole] = peg_and_hole();
    let pressed_on = |contact_tolerance| {
        let settings = Settings { contact_tolerance, ..Settings::default() };
        let mut world = World::new(settings).expect("valid settings");
        let block = world.add(Object::fixed(hole.clone(), Pose::IDENTITY)).expect("a valid pose");
        let tool = world.add_tool(peg.clone(), settings).expect("valid settings");
        world.step(&[ProbeState::at(in_hole(0.0))], 1e-3, &NoClock);
        world.contacts(world.body_of(tool), block).filter(|contact| contact.separation < contact_tolerance).count()
    };
    assert_eq!(pressed_on(contact_tolerance(&peg, &hole, &in_hole(0.0))), 0);
    assert!(pressed_on(tolerance_by_size(&peg, &hole)) > 0);
}

#[test]
fn ball_in_a_groove_has_no_play() {
    let (ball, groove) = (body(&sphere(0.01, 3)), body(&v_groove()));
    let mut rest = DVec3::Z * 0.05;
    let mut query = ContactQuery::new(ball.clone(), groove.clone(), QuerySettings::default());
    for _ in 0..50 {
        rest.z -= query.nearest(&Pose::from_translation(rest)).map_or(0.0, |near| near.separation);
    }
    let chosen = contact_tolerance(&ball, &groove, &Pose::from_translation(rest));
    assert_eq!(chosen, tolerance_by_size(&ball, &groove));
}

#[test]
fn parts_that_only_overlap_have_no_play() {
    let cube = body(&cuboid(DVec3::splat(0.02)));
    for height in [0.0, 0.01, 0.0199] {
        let chosen = contact_tolerance(&cube, &cube, &Pose::from_translation(DVec3::Z * height));
        assert_eq!(chosen, tolerance_by_size(&cube, &cube), "{height}");
    }
}
