//! Tests valleys: edges where the environment bends inward. A tool in a valley is held by both of
//! its sides.

mod bodies;

use std::f64::consts::TAU;
use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Random};
use palpus::body::{Body, PolygonSoup};
use palpus::render::{Limits, ProbeState, Renderer, Settings};
use palpus_scenes::shape::cuboid;

const SEED: u64 = 0x7A11;
/// Contact tolerance of direct rendering, m.
const TOLERANCE: f64 = 1e-3;
/// Contact stiffness of direct rendering, N/m.
const STIFFNESS: f64 = 1000.0;
const NO_LIMITS: Limits = Limits { force: f64::INFINITY, torque: f64::INFINITY };

/// Returns a prism along y with this outline in the plane y = 0, counter-clockwise as seen from −y.
fn prism(outline: &[[f64; 2]], half: f64) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    for y in [-half, half] {
        soup.vertices.extend(outline.iter().map(|[x, z]| DVec3::new(*x, y, *z)));
    }
    let count = outline.len() as u32;
    soup.push_face(&(0..count).collect::<Vec<_>>());
    soup.push_face(&(count..2 * count).rev().collect::<Vec<_>>());
    for k in 0..count {
        let next = (k + 1) % count;
        soup.push_face(&[next, k, k + count, next + count]);
    }
    body(&soup)
}

/// Returns a block whose top is a valley along y. Its sides rise by `rise` (tangent).
fn valley(rise: f64) -> Arc<Body> {
    let (wide, deep) = (0.02, -0.02);
    prism(&[[-wide, deep], [wide, deep], [wide, rise * wide], [0.0, 0.0], [-wide, rise * wide]], 0.02)
}

/// Returns a pyramid whose tip is the origin.
fn tip() -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    let (side, height) = (5e-3, 0.015);
    let top = |x: f64, y: f64| DVec3::new(side * x, side * y, height);
    soup.vertices.extend([DVec3::ZERO, top(-1.0, -1.0), top(1.0, -1.0), top(1.0, 1.0), top(-1.0, 1.0)]);
    for face in [[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4]] {
        soup.push_face(&face);
    }
    soup.push_face(&[1, 2, 3, 4]);
    body(&soup)
}

/// A tip slides across valleys at a constant distance from their sides. The force changes in
/// proportion to the motion, and each side of the valley is felt on both sides of its edge.
#[test]
fn force_is_continuous_across_a_valley() {
    let (mut random, tip) = (Random::new(SEED), tip());
    let settings = Settings {
        contact_tolerance: TOLERANCE,
        stiffness: STIFFNESS,
        limits: NO_LIMITS,
        coupling: None,
        ..Settings::default()
    };
    let mut worst = 0.0_f64;
    for _ in 0..100 {
        let angle = random.between(0.02, 0.6);
        let turn = DQuat::from_rotation_z(random.between(0.0, TAU)) * DQuat::from_rotation_x(random.between(-0.2, 0.2));
        let gap = random.between(0.05, 0.6) * TOLERANCE;
        let mut renderer = Renderer::new(tip.clone(), valley(angle.tan()), settings).unwrap();
        let (steps, mut last) = (400, None);
        for k in -steps..=steps {
            let x = 2.0 * TOLERANCE * f64::from(k) / f64::from(steps);
            let place = DVec3::new(x, 0.3 * x, x.abs() * angle.tan() + gap / angle.cos());
            let force = renderer.step(&ProbeState::at(Pose::new(turn, place)), 1e-3, &NoClock).commanded.force;
            if let Some((before, from)) = last {
                worst = worst.max(force.distance(before) / (STIFFNESS * place.distance(from)));
            }
            last = Some((force, place));
        }
    }
    assert!(worst < 1.1, "seed {SEED:#x}: {worst} times motion times stiffness");
}

/// A block in a tube of 24 sides is pressed against the wall and turned around along it. Its edges
/// pass the valleys. The force changes only as fast as the hand moves.
#[test]
fn edges_pass_the_valleys_of_a_tube() {
    let corner = |k: u32, radius: f64| {
        let angle = TAU * f64::from(k) / 24.0;
        [radius * angle.cos(), radius * angle.sin()]
    };
    let mut soup = PolygonSoup::new();
    for (y, radius) in [(-0.02, 0.012), (-0.02, 0.016), (0.02, 0.012), (0.02, 0.016)] {
        soup.vertices.extend((0..24).map(|k| corner(k, radius)).map(|[x, z]| DVec3::new(x, y, z)));
    }
    for k in 0..24 {
        let next = (k + 1) % 24;
        let at = |ring: u32, k: u32| 24 * ring + k;
        for [from, to] in [[2, 0], [1, 3], [0, 1], [3, 2]] {
            soup.push_face(&[at(from, k), at(from, next), at(to, next), at(to, k)]);
        }
    }
    let (tube, block) = (body(&soup), body(&cuboid(DVec3::splat(2e-3))));
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, 1e-3, 1e-4);
    let mut renderer = Renderer::new(block, tube, settings).unwrap();
    let (mut last, mut most) = (DVec3::ZERO, 0.0_f64);
    for tick in 0..4000 {
        let time = f64::from(tick) * 1e-3;
        let out = (0.02 * time).min(0.02 * (4.0 - time)).min(0.0125);
        let angle = 0.4 + 0.8 * TAU * time / 4.0;
        let pose = Pose::from_translation(DVec3::new(out * angle.cos(), 1e-3 * (time - 2.0), out * angle.sin()));
        let force = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock).commanded.force;
        assert!(force.distance(last) < 0.07, "{} N in a tick at {time} s", force.distance(last));
        (last, most) = (force, most.max(force.length()));
    }
    assert!(most > 1.0 && most < 4.0 && last.length() < 1e-6, "{most} N");
}
