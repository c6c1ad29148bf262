//! Tests that the force stage does not allocate after its working memory has been created.

use glam::DVec3;
use palpus::algebra::{Pose, Twist};
use palpus::body::{Feature, FeaturePair};
use palpus::detect::Contact;
use palpus::force::{Centers, FrictionSettings};
use palpus::render::{Clustering, Forces, Motion, Scratch, Settings, force};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns `n` contacts scattered over a sphere, different in each tick.
fn contacts(n: u32, tick: u32) -> Vec<Contact> {
    let spin = |k: u32, step: f64| f64::from(k.wrapping_mul(2_654_435_761)) * step + 0.1 * f64::from(tick);
    (0..n)
        .map(|k| {
            let (u, v) = (spin(k, 1e-3), spin(k, 1.7e-3));
            let normal = DVec3::new(u.sin() * v.cos(), u.sin() * v.sin(), u.cos());
            let separation = 1.5e-3 * spin(k, 2.3e-3).sin();
            let point_b = 0.005 * normal;
            Contact {
                piece_a: (k + tick) % 37,
                piece_b: k,
                features: FeaturePair { a: Feature::Vertex(0), b: Feature::Face(0) },
                point_a: point_b + separation * normal,
                point_b,
                normal,
                separation,
                slope: 0.0875,
                count: 1.0,
                inside: false,
            }
        })
        .collect()
}

#[test]
fn the_force_stage_does_not_allocate() {
    let friction = FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.4, tangential_stiffness: 600.0 };
    let linkage =
        Settings { friction: Some(friction), clustering: Clustering::Linkage, capacity: 300, ..Settings::default() };
    let smooth = Settings { clustering: Clustering::Smooth, ..linkage };
    let mut scratch = Scratch::new(linkage.capacity);
    let mut forces = Forces::new(linkage.capacity);
    let motion = Motion {
        pose_ba: Pose::IDENTITY,
        centers: Centers { a: DVec3::X, b: DVec3::ZERO },
        twist: Twist::default(),
        pressed: 0.0,
        step: 0.0,
        elapsed: 1e-3,
    };
    // Ticks with no contacts, a few contacts, as many contacts as fit, and far too many. Some
    // clusters are cut, and contacts appear and disappear.
    let ticks: Vec<_> = [0, 3, 40, 300, 900, 2000, 7, 0, 150].iter().zip(0..).map(|(&n, t)| contacts(n, t)).collect();
    let before = allocations_of_this_thread();
    assert!(before > 0, "the counting allocator is not installed");
    let (mut dropped, mut cut) = (0, 0);
    for (contacts, settings) in ticks.iter().flat_map(|contacts| [(contacts, &linkage), (contacts, &smooth)]) {
        force(contacts, &motion, settings, |contact| contact.normal, &mut scratch, &mut forces);
        dropped += forces.linkage.dropped;
        cut += forces.linkage.cut_groups;
    }
    assert_eq!(allocations_of_this_thread(), before);
    assert!(dropped > 0 && cut > 0);
}
