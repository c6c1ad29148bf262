//! Tests symmetries and bounds of the whole force stage on random contacts.

use glam::DVec3;

use super::{Clustering, Forces, Motion, Scratch, Settings, force};
use crate::algebra::{Pose, Twist};
use crate::detect::Contact;
use crate::force::testing::{Random, contact, moved};
use crate::force::{Centers, FrictionSettings};

const SEED: u64 = 0x5EED_F02C;
const CAPACITY: usize = 256;

fn linkage() -> Settings {
    Settings { clustering: Clustering::Linkage, ..settings() }
}

fn settings() -> Settings {
    Settings {
        damping: 3.0,
        friction: Some(FrictionSettings {
            static_coefficient: 0.5,
            dynamic_coefficient: 0.4,
            tangential_stiffness: 600.0,
        }),
        capacity: CAPACITY,
        ..Settings::default()
    }
}

/// Returns the rounds of a test; every second round has smooth clustering.
fn turns(rounds: usize) -> impl Iterator<Item = (usize, Settings)> {
    let clustering = |round: usize| [Clustering::Linkage, Clustering::Smooth][round % 2];
    (0..rounds).map(move |round| (round, Settings { clustering: clustering(round), ..settings() }))
}

fn contacts(random: &mut Random, n: usize) -> Vec<Contact> {
    (0..n)
        .map(|k| {
            let normal = random.direction();
            contact((k as u32, 0), random.point(0.01), normal, random.between(-2e-3, 1.2e-3))
        })
        .collect()
}

fn motion(random: &mut Random) -> Motion {
    Motion {
        pose_ba: random.pose(0.02),
        centers: Centers { a: random.point(0.05), b: random.point(0.05) },
        twist: Twist { angular: random.point(3.0), linear: random.point(0.2) },
        pressed: 0.0,
        step: 0.0,
        elapsed: 1e-3,
    }
}

/// Runs two ticks of the force stage, so that friction has a strain.
fn two_ticks(first: &[Contact], second: &[Contact], motions: &[Motion; 2], settings: &Settings) -> Forces {
    let mut scratch = Scratch::new(settings.capacity);
    let mut forces = Forces::new(settings.capacity);
    for (contacts, motion) in [first, second].iter().zip(motions) {
        force(contacts, motion, settings, |contact| contact.normal, &mut scratch, &mut forces);
    }
    forces
}

/// Returns two ticks of a random scene, between which the probe moves a little.
fn scene(random: &mut Random) -> (Vec<Contact>, Vec<Contact>, [Motion; 2]) {
    let n = 1 + random.below(60);
    let first = contacts(random, n);
    let start = motion(random);
    let step = Pose::new(glam::DQuat::from_scaled_axis(random.point(0.02)), random.point(3e-4));
    let second: Vec<_> = first.iter().map(|contact| moved(contact, &step)).collect();
    let end = Motion { pose_ba: step * start.pose_ba, ..start };
    (first, second, [start, end])
}

#[test]
fn permuting_contacts_changes_no_bit_of_the_wrench() {
    let mut random = Random::new(SEED);
    for (round, settings) in turns(50) {
        let (first, second, motions) = scene(&mut random);
        let answer = two_ticks(&first, &second, &motions, &settings);
        let (mut p, mut q) = (first.clone(), second.clone());
        random.shuffle(&mut p);
        random.shuffle(&mut q);
        let shuffled = two_ticks(&p, &q, &motions, &settings);
        assert_eq!(answer.net, shuffled.net, "seed {SEED:#x}, round {round}");
        assert_eq!(answer.grips, shuffled.grips);
        assert!(answer.grips.iter().any(|grip| grip.force != DVec3::ZERO));
    }
}

#[test]
fn moving_the_whole_scene_moves_the_wrench() {
    let mut random = Random::new(SEED ^ 1);
    for (round, settings) in turns(50) {
        let (first, second, motions) = scene(&mut random);
        let answer = two_ticks(&first, &second, &motions, &settings);
        let pose = random.pose(0.1);
        let shift = |contacts: &[Contact]| contacts.iter().map(|c| moved(c, &pose)).collect::<Vec<_>>();
        let turned = motions.map(|m| Motion {
            pose_ba: pose * m.pose_ba,
            centers: Centers { a: pose.point(m.centers.a), b: pose.point(m.centers.b) },
            twist: Twist { angular: pose.vector(m.twist.angular), linear: pose.vector(m.twist.linear) },
            pressed: m.pressed,
            step: m.step,
            elapsed: m.elapsed,
        });
        let moved = two_ticks(&shift(&first), &shift(&second), &turned, &settings);
        for (here, there) in [(answer.net.on_a, moved.net.on_a), (answer.net.on_b, moved.net.on_b)] {
            let here = here.rotated(&pose);
            assert!((here.force - there.force).length() < 1e-8, "seed {SEED:#x}, round {round}");
            assert!((here.torque - there.torque).length() < 1e-9, "seed {SEED:#x}, round {round}");
        }
    }
}

#[test]
fn forces_are_opposite_and_friction_is_in_its_cone() {
    let mut random = Random::new(SEED ^ 2);
    for (round, settings) in turns(100) {
        let (first, second, motions) = scene(&mut random);
        let forces = two_ticks(&first, &second, &motions, &settings);
        assert_eq!(forces.net.on_a.force, -forces.net.on_b.force);
        let Centers { a, b } = motions[1].centers;
        let torque = forces.net.on_a.torque + forces.net.on_b.about(a - b).torque;
        assert!(torque.length() < 1e-10, "seed {SEED:#x}, round {round}");
        let mut sum = DVec3::ZERO;
        for (cluster, &load) in forces.clusters.iter().zip(&forces.normal_forces) {
            let friction: DVec3 = forces.grips[cluster.members()].iter().map(|grip| grip.force).sum();
            assert!(load >= 0.0 && friction.length() <= 0.5 * load * (1.0 + 1e-12), "seed {SEED:#x}, round {round}");
            sum += load * cluster.normal + friction;
        }
        assert!((sum - forces.net.on_a.force).length() < 1e-9);
    }
}

#[test]
fn more_contacts_are_not_stiffer() {
    // 200 contacts on a patch smaller than δ push like one contact.
    let mut random = Random::new(SEED ^ 3);
    let patch: Vec<_> =
        (0..200).map(|k| contact((k, 0), random.point(1e-3) * DVec3::new(1.0, 1.0, 0.0), DVec3::Z, -1e-3)).collect();
    let still = Motion {
        pose_ba: Pose::IDENTITY,
        centers: Centers { a: DVec3::Z, b: DVec3::ZERO },
        twist: Twist::default(),
        pressed: 0.0,
        step: 0.0,
        elapsed: 1e-3,
    };
    let forces = two_ticks(&patch, &patch, &[still; 2], &linkage());
    assert_eq!(forces.clusters.len(), 1);
    assert!((forces.net.on_a.force - DVec3::Z * 1.6).length() < 1e-12);
    assert!(two_ticks(&patch, &[], &[still; 2], &settings()).net.on_a.force == DVec3::ZERO);
    let smooth = Settings { clustering: Clustering::Smooth, friction: None, ..settings() };
    let force = two_ticks(&patch, &patch, &[still; 2], &smooth).net.on_a.force;
    assert!((force - DVec3::Z * 1.6).length() < 1e-9, "{force}");
}

#[test]
fn a_slot_narrower_than_delta_grips_the_probe_from_both_sides() {
    let slot = |shift: f64| {
        let wall = |k: u32, side: f64| {
            contact(
                (k, 0),
                DVec3::new(1e-3 * f64::from(k / 2), 1e-3 * side, 0.0),
                -DVec3::Y * side,
                2e-4 - side * shift,
            )
        };
        (0..8).map(|k| wall(k, if k % 2 == 0 { 1.0 } else { -1.0 })).collect::<Vec<_>>()
    };
    let still = Motion {
        pose_ba: Pose::IDENTITY,
        centers: Centers { a: DVec3::ZERO, b: DVec3::ZERO },
        twist: Twist::default(),
        pressed: 0.0,
        step: 0.0,
        elapsed: 1e-3,
    };
    let settings = Settings { friction: None, ..linkage() };
    let at = |shift: f64| two_ticks(&slot(shift), &slot(shift), &[still; 2], &settings);
    assert!(at(0.0).net.on_a.force.length() < 1e-12);
    assert_eq!((at(0.0).clusters.len(), at(0.0).cancelled_normals), (2, 0));
    // Both walls push, so the stiffness is doubled.
    assert!((at(1e-4).net.on_a.force + DVec3::Y * (2.0 * 800.0 * 1e-4)).length() < 1e-12);
    // With the paper's rule alone, there is one cluster, and its normals cancel.
    let paper = Settings { split_angle: None, ..settings };
    assert_eq!(two_ticks(&slot(0.0), &slot(0.0), &[still; 2], &paper).cancelled_normals, 1);
}

#[test]
fn non_finite_contacts_do_not_reach_the_wrench() {
    let mut random = Random::new(SEED ^ 4);
    let (mut first, second, motions) = scene(&mut random);
    for (k, bad) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].into_iter().enumerate() {
        let mut broken = first[0];
        match k {
            0 => broken.normal.x = bad,
            1 => broken.point_b.y = bad,
            _ => broken.separation = bad,
        }
        first.push(broken);
    }
    let forces = two_ticks(&second, &first, &motions, &settings());
    assert_eq!(forces.linkage.non_finite, 3);
    assert!(forces.net.on_a.is_finite() && forces.net.on_b.is_finite());
}

/// Load sharing divides stiffness and loads. The engagement of a cluster is always t − d, whatever
/// contacts are near it.
#[test]
fn engagement_does_not_depend_on_other_clusters() {
    let mut random = Random::new(SEED ^ 9);
    for (round, settings) in turns(50) {
        let (first, second, motions) = scene(&mut random);
        let answer = two_ticks(&first, &second, &motions, &settings);
        for (cluster, &stiffness) in answer.clusters.iter().zip(&answer.stiffnesses) {
            let expected = (settings.contact_offset() - cluster.separation).max(0.0);
            assert_eq!(cluster.engagement, expected, "seed {SEED:#x}, round {round}");
            assert!((0.0..=settings.stiffness).contains(&stiffness), "seed {SEED:#x}, round {round}");
        }
    }
}
