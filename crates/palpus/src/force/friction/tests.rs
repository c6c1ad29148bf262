//! Tests friction of blocks and of many contacts against known results.

use super::super::represent;
use super::super::testing::{Random, contact};
use super::*;
use crate::algebra::tolerance::{FRICTION_HEALS, FRICTION_WEAKENS};
use glam::DQuat;
use std::f64::consts::FRAC_PI_2;

const SEED: u64 = 0xF21C;
const T: f64 = 1e-3;
const SETTINGS: FrictionSettings =
    FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.3, tangential_stiffness: 1000.0 };
const NORMAL_FORCE: f64 = 2.0;

/// Runs one tick of one cluster in direct rendering. Returns the friction on a.
fn tick(tracker: &mut FrictionTracker, contacts: &[Contact], pose_ba: Pose, normal_force: f64) -> DVec3 {
    tick_behind(0.0, tracker, contacts, pose_ba, normal_force)
}

/// Runs one tick of one cluster behind a coupling of this `compliance` (m/N). Returns the friction
/// on a.
fn tick_behind(
    compliance: f64,
    tracker: &mut FrictionTracker,
    contacts: &[Contact],
    pose_ba: Pose,
    normal_force: f64,
) -> DVec3 {
    let members: Vec<u32> = (0..contacts.len() as u32).collect();
    let directions: Vec<DVec3> = contacts.iter().map(|contact| contact.normal).collect();
    let weights: Vec<f64> = contacts.iter().map(|contact| T - contact.separation).collect();
    let holds: Vec<DVec3> = contacts.iter().map(Contact::midpoint).collect();
    let input = FrictionInput {
        contacts,
        members: &members,
        weights: &weights,
        holds: &holds,
        clusters: &[represent(contacts, &members, &directions, &weights, 0, T)],
        loads: &[normal_force],
        most: normal_force,
        reach: 4e-3,
        compliance,
        elapsed: 1e-3,
        pose_ba,
    };
    tracker.update(&input, &SETTINGS);
    tracker.grips().iter().map(|grip| grip.force).sum()
}

/// Returns the contact at the lowest point of a block that stands at `x` on the plane z = 0, and
/// the block's pose.
fn block(x: DVec3) -> (Contact, Pose) {
    (contact((3, 8), x, DVec3::Z, 0.0), Pose::from_translation(x))
}

fn drag(tracker: &mut FrictionTracker, x: f64) -> f64 {
    let (contact, pose) = block(DVec3::X * x);
    tick(tracker, &[contact], pose, NORMAL_FORCE).x
}

#[test]
fn a_dragged_block_sticks_then_slides_then_sticks_again() {
    let mut tracker = FrictionTracker::new(8);
    assert_eq!(drag(&mut tracker, 0.02), 0.0);
    // The spring is elastic up to μ_s F_n / k_t = 1 mm.
    for k in 1..=9 {
        let z = 1e-4 * f64::from(k);
        assert!((drag(&mut tracker, 0.02 + z) + 1000.0 * z).abs() < 1e-9);
        assert!(!tracker.adhesions()[0].sliding);
    }
    // Beyond that the block slides: the force falls from μ_s F_n to μ_d F_n over the next
    // millimetre.
    let mut last = 1.0;
    for k in 11..=40 {
        let force = -drag(&mut tracker, 0.02 + 1e-4 * f64::from(k));
        assert!(force <= last && last - force < 0.08 && tracker.adhesions()[0].sliding, "{force} N after {last} N");
        last = force;
    }
    assert!((last - 0.6).abs() < 1e-9);
    // When the block stops, it sticks again. The static limit returns with time.
    assert!((drag(&mut tracker, 0.024) + 0.6).abs() < 1e-9);
    assert!(!tracker.adhesions()[0].sliding);
    let soon = -drag(&mut tracker.clone(), 0.0243);
    assert!(soon > 0.6 && soon < 0.62, "{soon} N");
    for _ in 0..(FRICTION_HEALS / 1e-3) as u32 {
        assert!((drag(&mut tracker, 0.024) + 0.6).abs() < 1e-9);
    }
    assert!((drag(&mut tracker, 0.0243) + 0.9).abs() < 1e-9);
    // Backward motion unloads the same spring, through zero.
    assert!((drag(&mut tracker, 0.0240) + 0.6).abs() < 1e-9);
    assert!((drag(&mut tracker, 0.0230) - 0.4).abs() < 1e-9);
    // If the load decreases, a sticking contact slides at once.
    let (contact, pose) = block(DVec3::X * 0.0230);
    for held in [0.05, 0.03] {
        assert!((tick(&mut tracker, &[contact], pose, 0.1).x - held).abs() < 1e-12);
    }
    assert_eq!(tick(&mut tracker, &[contact], pose, 0.0), DVec3::ZERO);
}

#[test]
fn friction_falls_over_a_longer_slip_behind_a_soft_coupling() {
    // Friction falls over the greatest elastic strain, 1 mm, and as much again for the coupling.
    let compliance = 1e-3 / FRICTION_WEAKENS;
    let mut tracker = FrictionTracker::new(8);
    for k in 0..=3200 {
        let moved = 1e-6 * f64::from(k);
        let (contact, pose) = block(DVec3::X * moved);
        let force = -tick_behind(compliance, &mut tracker, &[contact], pose, NORMAL_FORCE).x;
        // While friction falls from 1 to 0.6 N, the spring shortens by 0.4 mm. So the block moves
        // by 1.6 mm in these 2 mm of slip.
        let slip = (moved - 1e-3).max(0.0);
        let expected = if moved < 1e-3 { 1000.0 * moved } else { (1.0 - 0.25 * 1e3 * slip).max(0.6) };
        assert!((force - expected).abs() < 2e-3, "{force} N instead of {expected} N after {moved} m");
    }
}

#[test]
fn the_friction_cone_holds_for_any_stream_of_contacts() {
    let mut random = Random::new(SEED);
    let mut tracker = FrictionTracker::new(64);
    let mut pose = random.pose(0.1);
    for round in 0..4000 {
        let step = Pose::new(glam::DQuat::from_scaled_axis(random.point(0.05)), random.point(5e-4));
        pose = step * pose;
        let up = (DVec3::Z + random.point(0.3)).normalize();
        let contacts: Vec<_> = (0..1 + random.below(12))
            .map(|_| {
                let pieces = (random.below(4) as u32, random.below(4) as u32);
                let n = (up + random.point(0.5)).normalize();
                contact(pieces, pose.translation + random.point(4e-3), n, random.between(-1e-3, 9e-4))
            })
            .collect();
        let load = random.between(0.0, 5.0);
        let friction = tick(&mut tracker, &contacts, pose, load);
        let most = SETTINGS.static_coefficient * load;
        assert!(friction.length() <= most * (1.0 + 1e-12), "seed {SEED:#x}, round {round}");
        let normal = tracker.adhesions()[0].normal;
        assert!(friction.dot(normal).abs() <= 1e-12 * most.max(1.0), "seed {SEED:#x}, round {round}");
    }
}

#[test]
fn a_million_ticks_of_tremor_do_not_move_a_block() {
    let mut random = Random::new(SEED ^ 1);
    let mut tracker = FrictionTracker::new(8);
    drag(&mut tracker, 0.1);
    let pushed = drag(&mut tracker, 0.1005);
    for _ in 0..1_000_000 {
        // The block is pressed and released, tilted and moved, always below the static limit.
        let x = DVec3::new(0.1005, 0.0, 0.0) + random.point(3e-4) * DVec3::new(1.0, 1.0, 2.0);
        let (contact, pose) = block(x);
        tick(&mut tracker, &[contact], pose, NORMAL_FORCE);
        assert!(!tracker.adhesions()[0].sliding);
    }
    assert!((drag(&mut tracker, 0.1005) - pushed).abs() < 1e-8);
}

#[test]
fn a_cluster_is_as_stiff_and_as_strong_as_one_contact() {
    let shift = DVec3::X * 4e-4;
    let many = |x: DVec3| -> Vec<Contact> {
        (0..7u32)
            .map(|k| contact((k, 0), x + DVec3::Y * (1e-4 * f64::from(k)), DVec3::Z, 1e-4 * f64::from(k)))
            .collect()
    };
    let mut tracker = FrictionTracker::new(8);
    tick(&mut tracker, &many(DVec3::ZERO), Pose::IDENTITY, NORMAL_FORCE);
    let friction = tick(&mut tracker, &many(shift), Pose::from_translation(shift), NORMAL_FORCE);
    assert!((friction + DVec3::X * 0.4).length() < 1e-12);
    for (far, held) in [(3e-3, 1.0), (4e-3, 0.6)] {
        let far = DVec3::X * far;
        let friction = tick(&mut tracker, &many(far), Pose::from_translation(far), NORMAL_FORCE);
        assert!((friction + DVec3::X * held).length() < 1e-12);
    }
}

#[test]
fn next_piece_takes_over_the_strain() {
    let mut tracker = FrictionTracker::new(8);
    drag(&mut tracker, 0.0);
    let before = drag(&mut tracker, 5e-4);
    let (mut next, pose) = block(DVec3::X * 5e-4);
    next.piece_b = 9;
    assert!((tick(&mut tracker, &[next], pose, NORMAL_FORCE).x - before).abs() < 1e-12);
    // This contact is too far away, and its normal differs too much, to take over the strain.
    next.piece_b = 10;
    let far = Contact { point_a: next.point_a + DVec3::Y, point_b: next.point_b + DVec3::Y, ..next };
    assert_eq!(tick(&mut tracker.clone(), &[far], pose, NORMAL_FORCE), DVec3::ZERO);
    let opposed = Contact { normal: -DVec3::Z, ..next };
    assert_eq!(tick(&mut tracker.clone(), &[opposed], pose, NORMAL_FORCE), DVec3::ZERO);
    let input = FrictionInput {
        contacts: &[],
        members: &[],
        weights: &[],
        holds: &[],
        clusters: &[],
        loads: &[],
        most: 0.0,
        reach: 4e-3,
        compliance: 0.0,
        elapsed: 1e-3,
        pose_ba: pose,
    };
    tracker.update(&input, &SETTINGS);
    assert!(tracker.adhesions().is_empty());
    assert_eq!(tick(&mut tracker, &[next], pose, NORMAL_FORCE), DVec3::ZERO);
}

/// Moves a square patch by `along` and turns it by `angle` about its normal; its corners are at
/// distance `reach` from its middle. Returns the friction force on a and its torque about the
/// middle.
fn turn(tracker: &mut FrictionTracker, reach: f64, angle: f64, along: DVec3) -> (DVec3, f64) {
    let pose = Pose::new(DQuat::from_rotation_z(angle), along);
    let corners: Vec<Contact> = (0..4)
        .map(|k| {
            let corner = DQuat::from_rotation_z(f64::from(k) * FRAC_PI_2) * (DVec3::X * reach);
            contact((3, 8), pose.point(corner), DVec3::Z, 0.0)
        })
        .collect();
    let force = tick(tracker, &corners, pose, NORMAL_FORCE);
    (force, tracker.grips().iter().map(|grip| (grip.point - along).cross(grip.force).z).sum())
}

#[test]
fn corners_resist_twisting_up_to_their_load() {
    let reach = 0.05;
    let most = NORMAL_FORCE * reach;
    let mut tracker = FrictionTracker::new(8);
    assert_eq!(turn(&mut tracker, reach, 0.0, DVec3::ZERO), (DVec3::ZERO, 0.0));
    // The spring is elastic up to the static limit.
    let limit = SETTINGS.static_coefficient * NORMAL_FORCE / SETTINGS.tangential_stiffness / reach;
    let (_, torque) = turn(&mut tracker, reach, 0.9 * limit, DVec3::ZERO);
    assert!((torque / (0.9 * SETTINGS.static_coefficient * most) + 1.0).abs() < 1e-3, "{torque}");
    // Beyond this limit the patch slides around with the torque of the dynamic limit, for any
    // number of turns.
    for k in 2..200 {
        let (_, torque) = turn(&mut tracker, reach, limit * f64::from(k), DVec3::ZERO);
        if k > 4 {
            assert!((torque / (SETTINGS.dynamic_coefficient * most) + 1.0).abs() < 1e-3, "{k}: {torque}");
            assert!(tracker.adhesions()[0].sliding);
        }
    }
    // At rest the patch sticks where it stopped.
    let (_, held) = turn(&mut tracker, reach, limit * 199.0, DVec3::ZERO);
    assert!((held / (SETTINGS.dynamic_coefficient * most) + 1.0).abs() < 1e-3 && !tracker.adhesions()[0].sliding);
}

#[test]
fn sliding_patch_turns_easily() {
    // A patch that spins while it slides is braked less than a patch that spins in place.
    let (reach, slide) = (0.05, DVec3::X * 5e-5);
    let most = SETTINGS.dynamic_coefficient * NORMAL_FORCE;
    for turn_of_slide in [0.1, 1.0, 3.0] {
        let mut tracker = FrictionTracker::new(8);
        let angle = turn_of_slide * slide.x / reach;
        let mut last = (DVec3::ZERO, 0.0);
        for k in 0..300 {
            last = turn(&mut tracker, reach, angle * f64::from(k), slide * f64::from(k));
        }
        let (force, torque) = last;
        assert!(force.length() <= most * (1.0 + 1e-9) && torque.abs() <= most * reach * (1.0 + 1e-9));
        let [along, about] = [force.length() / most, torque.abs() / (most * reach)];
        assert!((0.9..=1.42).contains(&along.hypot(about)), "{turn_of_slide}: {along} {about}");
        assert!((along > about) == (turn_of_slide < 1.5), "{turn_of_slide}: {along} {about}");
    }
}

#[test]
fn load_share_sets_the_tangential_stiffness() {
    // With load sharing, the largest strain does not depend on the share. So k contacts at one
    // place hold the same force as one contact.
    let shift = DVec3::X * 4e-4;
    let held = |share: f64| {
        let mut tracker = FrictionTracker::new(8);
        let mut force = DVec3::ZERO;
        for x in [DVec3::ZERO, shift] {
            let (contact, pose_ba) = block(x);
            let cluster = represent(&[contact], &[0], &[contact.normal], &[T - contact.separation], 0, T);
            let input = FrictionInput {
                contacts: &[contact],
                members: &[0],
                weights: &[T - contact.separation],
                holds: &[contact.midpoint()],
                clusters: &[cluster],
                loads: &[share * NORMAL_FORCE],
                most: NORMAL_FORCE,
                reach: 4e-3,
                compliance: 0.0,
                elapsed: 1e-3,
                pose_ba,
            };
            tracker.update(&input, &SETTINGS);
            force = tracker.grips()[0].force;
        }
        force
    };
    assert!((held(0.25) - 0.25 * held(1.0)).length() < 1e-12 && held(1.0).x < -0.39);
    assert_eq!(held(0.0), DVec3::ZERO);
}

#[test]
fn rotating_the_scene_rotates_the_friction() {
    let mut random = Random::new(SEED ^ 2);
    for round in 0..20 {
        let scene = random.pose(0.5);
        let (mut here, mut there) = (FrictionTracker::new(8), FrictionTracker::new(8));
        for _ in 0..30 {
            let (contact, pose) = block(random.point(2e-3) * DVec3::new(1.0, 1.0, 0.1));
            let friction = tick(&mut here, &[contact], pose, NORMAL_FORCE);
            let contact = super::super::testing::moved(&contact, &scene);
            let turned = tick(&mut there, &[contact], scene * pose, NORMAL_FORCE);
            assert!((scene.vector(friction) - turned).length() < 1e-9, "seed {SEED:#x}, round {round}");
        }
    }
}

#[test]
fn corner_that_lands_later_has_friction_at_its_own_point() {
    let mut tracker = FrictionTracker::new(8);
    let at = |x: f64| contact((3, 8), DVec3::X * x, DVec3::Z, 0.0);
    // A block lands on one corner and is pulled aside by 0.1 mm. Then its other corner lands.
    tick(&mut tracker, &[at(0.0)], Pose::IDENTITY, NORMAL_FORCE);
    let pulled = Pose::from_translation(DVec3::Y * 1e-4);
    tick(&mut tracker, &[at(0.0)], pulled, NORMAL_FORCE);
    let force = tick(&mut tracker, &[at(0.0), at(0.02)], pulled, NORMAL_FORCE);
    let places = [0, 1].map(|k| tracker.grips()[k].point.x);
    assert!(places[0].abs() < 1e-12 && (places[1] - 0.02).abs() < 1e-12, "{places:?}");
    // The force does not jump, and no friction turns the block.
    assert!((force.y + 1e-4 * SETTINGS.tangential_stiffness).abs() < 1e-9, "{force}");
    let forces = [0, 1].map(|k| tracker.grips()[k].force.y);
    assert!((forces[0] - forces[1]).abs() < 1e-9, "{forces:?}");
}
