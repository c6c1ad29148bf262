//! Tests the linearisation of contacts in the implicit step on random contacts.

use glam::DVec3;

use super::contact_rows::ContactRows;
use super::{Clustering, Forces, Motion, Scratch, Settings, force};
use crate::algebra::{Pose, SpatialMatrix, Twist, Wrench};
use crate::detect::Contact;
use crate::force::testing::{Random, contact};
use crate::force::{Centers, FrictionSettings};

const SEED: u64 = 0x5EED_2045;
const H: f64 = 1e-3;
/// Damping over stiffness, s.
const LAG: f64 = 2e-3;
/// Change of a twist relative to its size.
const STEP: f64 = 1e-7;

fn settings(clustering: Clustering) -> Settings {
    let friction = FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.4, tangential_stiffness: 5e4 };
    Settings { friction: Some(friction), clustering, capacity: 64, ..Settings::default() }
}

/// Returns the contacts of a random scene in the implicit step. The forces are turned away from the
/// normals, as by shading.
fn rows(random: &mut Random, settings: &Settings) -> ContactRows {
    let count = 1 + random.below(12);
    let contacts: Vec<Contact> = (0..count)
        .map(|k| contact((k as u32, 0), random.point(0.01), random.direction(), random.between(-2e-3, 1.2e-3)))
        .collect();
    let motion = Motion {
        pose_ba: random.pose(0.02),
        centers: Centers { a: random.point(0.05), b: random.point(0.05) },
        twist: Twist::default(),
        pressed: random.between(0.0, 2.0),
        step: H,
        elapsed: H,
    };
    let turn = random.point(0.2);
    let (mut scratch, mut forces) = (Scratch::new(64), Forces::new(64));
    let direction = |contact: &Contact| (contact.normal + turn.cross(contact.normal)).normalize();
    for translation in [DVec3::ZERO, random.point(1e-4)] {
        let pose_ba = Pose { translation: motion.pose_ba.translation + translation, ..motion.pose_ba };
        force(&contacts, &Motion { pose_ba, ..motion }, settings, direction, &mut scratch, &mut forces);
    }
    let mut rows = ContactRows::new(64);
    rows.gather(&contacts, &forces, motion.centers.a, settings);
    rows
}

/// Returns the impulse that the contacts are predicted to have at `twist`, and the matrix and
/// right-hand side of the next round.
fn predicted(rows: &mut ContactRows, twist: &Twist) -> (Wrench, SpatialMatrix, Wrench) {
    rows.revise(twist, H, LAG, true);
    let (mut system, mut load) = (SpatialMatrix::ZERO, Wrench::ZERO);
    rows.add_to(&mut system, &mut load, H, LAG);
    (rows.predicted_impulse(twist, H), system, load)
}

fn size(wrench: &Wrench) -> f64 {
    wrench.force.length() + wrench.torque.length() / 0.05
}

/// A round uses Newton's method: at the twist of the prediction, its system has the predicted
/// impulse and the derivative of this impulse. The twists are so fast that nearly all contacts
/// slide.
#[test]
fn system_has_the_value_and_derivative_of_the_predicted_impulse() {
    let mut random = Random::new(SEED);
    let mut tested = 0;
    for round in 0..200 {
        let settings = settings([Clustering::Smooth, Clustering::Linkage][round % 2]);
        let mut rows = rows(&mut random, &settings);
        let twist = Twist { angular: random.point(20.0), linear: random.point(1.0) };
        let change = Twist { angular: random.point(20.0), linear: random.point(1.0) } * STEP;
        let (impulse, system, load) = predicted(&mut rows, &twist);
        let linear = load + -system.times(&twist);
        assert!(size(&(impulse + -linear)) <= 1e-12 * (1.0 + size(&load)), "seed {SEED:#x}, round {round}");
        let (moved, ..) = predicted(&mut rows, &(twist + change));
        let (actual, expected) = (moved + -impulse, -system.times(&change));
        if size(&expected) > 0.0 {
            tested += 1;
            let off = size(&(actual + -expected)) / size(&expected);
            assert!(off < 1e-4, "seed {SEED:#x}, round {round}: {off}");
        }
    }
    assert!(tested > 150, "{tested}");
}

/// A tool slides from one contact onto another one, which has only 1 % of the load yet. When the
/// step gives it the whole load, it must also hold the whole friction.
#[test]
fn contact_that_takes_over_the_load_takes_over_the_friction() {
    let settings = settings(Clustering::Smooth);
    let reach = 1.0 / settings.stiffness;
    let barely = contact((0, 0), DVec3::ZERO, DVec3::Z, settings.contact_offset() - 0.01 * reach);
    let centers = Centers { a: DVec3::ZERO, b: DVec3::ZERO };
    let (mut scratch, mut forces) = (Scratch::new(64), Forces::new(64));
    for x in [0.0, 1e-3] {
        let pose_ba = Pose { translation: DVec3::X * x, ..Pose::IDENTITY };
        let motion = Motion { pose_ba, centers, twist: Twist::default(), pressed: 1.0, step: H, elapsed: H };
        force(&[barely], &motion, &settings, |contact| contact.normal, &mut scratch, &mut forces);
    }
    let mut rows = ContactRows::new(64);
    rows.gather(&[barely], &forces, DVec3::ZERO, &settings);
    let press = Twist { linear: DVec3::Z * (-0.99 * reach / (H + LAG)), ..Twist::default() };
    let force = predicted(&mut rows, &press).0.force / H;
    assert!((force.z - 1.0).abs() < 1e-9, "{force}");
    assert!(force.x < -0.39, "{force}");
}
