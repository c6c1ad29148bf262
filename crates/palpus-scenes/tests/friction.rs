//! Compares friction with physics: a free block on a ramp and on a table. Only gravity, the
//! engine's wrench and a small drag act on it.

mod bodies;
mod falling;

use std::sync::Arc;

use bodies::body;
use falling::{DT, Falling, GRAVITY};
use glam::{DQuat, DVec2, DVec3};
use palpus::algebra::Pose;
use palpus::body::{Body, PolygonSoup};
use palpus::force::FrictionSettings;
use palpus::render::{Clustering, Settings};
use palpus_scenes::shape;

/// Size of the block, m.
const SIZE: DVec3 = DVec3::new(0.060, 0.040, 0.016);
/// Mass of the block, kg.
const MASS: f64 = 0.1;
/// Static coefficient of friction.
const STATIC: f64 = 0.5;
/// Dynamic coefficient of friction.
const DYNAMIC: f64 = 0.35;
/// Drag of the block, 1/s.
const DRAG: DVec3 = DVec3::splat(20.0);
const DEGREE: f64 = std::f64::consts::PI / 180.0;

fn settings(clustering: Clustering) -> Settings {
    Settings {
        clustering,
        // The block rests above the ground, near the upper end of the tolerance. If it sank in, the
        // sides of the rails would stop it.
        stiffness: 1600.0,
        // Without damping, the free body would oscillate on the spring of its contact.
        damping: 3.0,
        friction: Some(FrictionSettings {
            static_coefficient: STATIC,
            dynamic_coefficient: DYNAMIC,
            tangential_stiffness: 1600.0,
        }),
        ..Settings::default()
    }
}

/// Returns a block that has come to rest on a level table.
fn resting(trial: &Trial, turned: f64) -> Falling {
    let above = 0.5 * SIZE.z + Settings::default().contact_tolerance;
    let pose = Pose::new(DQuat::from_rotation_z(turned), DVec3::new(-0.09, 0.0, above));
    let mut falling = Falling::new(&trial.block, &trial.ground, MASS, settings(trial.clustering), pose);
    // A device also has such drag. Without it, nothing would damp a block on springs. The tests
    // switch off the drag in the direction that they measure.
    (falling.drag, falling.spin_drag) = (DRAG, DRAG);
    falling.run(0.5);
    falling
}

/// Tilts the ground slowly from `from` to `to` (rad), in `seconds`.
fn tilt_to(falling: &mut Falling, from: f64, to: f64, seconds: f64) {
    let ticks = (seconds / DT) as u64;
    for k in 0..=ticks {
        falling.tilt(from + (to - from) * k as f64 / ticks as f64);
        falling.step();
    }
}

/// Returns the prism over an outline in x and z (m), `width` (m) long along y.
fn extruded(outline: &[DVec2], width: f64) -> PolygonSoup {
    let count = outline.len() as u32;
    let mut soup = PolygonSoup::new();
    for side in [-0.5, 0.5] {
        soup.vertices.extend(outline.iter().map(|p| DVec3::new(p.x, side * width, p.y)));
    }
    soup.push_face(&(0..count).collect::<Vec<_>>());
    soup.push_face(&(count..2 * count).rev().collect::<Vec<_>>());
    for k in 0..count {
        let next = (k + 1) % count;
        soup.push_face(&[k, k + count, next + count, next]);
    }
    soup
}

/// Returns the block on two runners, 10 mm wide. This block is not convex and has a contact under
/// each runner.
fn sled() -> PolygonSoup {
    let outline = [(-30, -8), (-20, -8), (-20, 0), (20, 0), (20, -8), (30, -8), (30, 8), (-30, 8)];
    extruded(&outline.map(|(x, z)| DVec2::new(f64::from(x), f64::from(z)) * 1e-3), SIZE.y)
}

/// Returns a table with ribs along the slope, 2 mm wide and 6 mm apart. The ribs give many
/// contacts, but no contact at the long sides of the block.
fn rails() -> PolygonSoup {
    let mut soup = ribs();
    for v in &mut soup.vertices {
        *v = DVec3::new(v.y, -v.x, v.z);
    }
    soup
}

/// Returns the table of [`rails`] with its ribs across the slope. A sliding block bumps into the
/// next rib, because the contact tolerance surrounds the rib.
fn ribs() -> PolygonSoup {
    let mut outline = vec![DVec2::new(0.15, -0.02), DVec2::new(0.15, 0.0)];
    for k in (-24..=25).rev() {
        let x = 0.006 * f64::from(k) - 0.005;
        outline.extend(
            [(4.0, 0.0), (4.0, -2.0), (0.0, -2.0), (0.0, 0.0)].map(|(u, z)| DVec2::new(x + u * 1e-3, z * 1e-3)),
        );
    }
    outline.extend([(-0.15, 0.0), (-0.15, -0.02)].map(|(x, z)| DVec2::new(x, z)));
    outline.reverse();
    extruded(&outline, 0.3)
}

/// A block, the ground under it, and the kind of clustering.
struct Trial {
    name: String,
    block: Arc<Body>,
    ground: Arc<Body>,
    clustering: Clustering,
}

/// Returns all combinations of blocks and grounds, with both kinds of clustering.
fn trials() -> Vec<Trial> {
    let (block, sled) = (body(&shape::cuboid(SIZE)), body(&sled()));
    let (table, rails, ribs) = (body(&shape::table()), body(&rails()), body(&ribs()));
    let pairs = [
        ("block", &block, &table),
        ("sled", &sled, &table),
        ("block on rails", &block, &rails),
        ("block on ribs", &block, &ribs),
    ];
    let ways = [Clustering::Linkage, Clustering::Smooth];
    let trial = |(name, block, ground): (&str, &Arc<Body>, &Arc<Body>), clustering| Trial {
        name: format!("{name}, {clustering:?}"),
        block: block.clone(),
        ground: ground.clone(),
        clustering,
    };
    pairs.into_iter().flat_map(|pair| ways.map(|way| trial(pair, way))).collect()
}

/// Returns the cases in which all contact normals are vertical.
fn level_trials() -> impl Iterator<Item = Trial> {
    trials().into_iter().filter(|trial| !trial.name.contains("ribs"))
}

/// Returns the distance that the block slides along x, m.
fn slide(falling: &mut Falling, seconds: f64) -> f64 {
    let before = falling.pose.translation.x;
    falling.run(seconds);
    falling.pose.translation.x - before
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn block_slides_only_above_the_static_angle() {
    let (holds, slides) = (STATIC.atan() - DEGREE, STATIC.atan() + DEGREE);
    for trial in level_trials() {
        let name = &trial.name;
        let mut falling = resting(&trial, 0.3);
        tilt_to(&mut falling, 0.0, holds, 2.0);
        falling.run(0.3);
        let held = falling.pose;
        falling.run(1.0);
        let crept = falling.pose.translation.distance(held.translation);
        eprintln!("{name}: a degree below the static angle moved {crept:.1e} m in a second");
        assert!(crept < 2e-6, "{name}: moved {crept} m");
        tilt_to(&mut falling, holds, slides, 0.5);
        let slid = slide(&mut falling, 0.3);
        assert!(slid > 0.02, "{name}: slid {slid} m");
    }
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn sliding_block_stops_only_below_the_dynamic_angle() {
    for trial in level_trials() {
        let name = &trial.name;
        let start = |angle: f64| {
            let mut falling = resting(&trial, 0.3);
            // The block comes to rest on the slope before it is pushed.
            tilt_to(&mut falling, 0.0, angle, 1.0);
            falling.twist.linear.x = 0.1;
            falling
        };
        let mut above = start(DYNAMIC.atan() + DEGREE);
        above.drag.x = 0.0;
        above.run(0.5);
        assert!(above.twist.linear.x > 0.1, "{name}: slowed to {}", above.twist.linear.x);
        let mut below = start(DYNAMIC.atan() - DEGREE);
        below.run(1.2);
        let crept = slide(&mut below, 0.5);
        eprintln!("{name}: stopped, and then moved {crept:.1e} m in half a second");
        assert!(crept.abs() < 2e-6, "{name}: moves {crept} m");
    }
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn sliding_block_accelerates_by_coulombs_law() {
    for trial in level_trials() {
        let name = &trial.name;
        for degrees in [22.0, 30.0, 38.0] {
            let angle = f64::to_radians(degrees);
            let mut falling = resting(&trial, 0.0);
            falling.drag.x = 0.0;
            falling.tilt(angle);
            // The block is held back until it no longer oscillates.
            for _ in 0..300 {
                falling.twist.linear.x = 0.02;
                falling.step();
            }
            falling.run(0.05);
            let before = falling.twist.linear.x;
            falling.run(0.2);
            let gained = (falling.twist.linear.x - before) / 0.2;
            let expected = GRAVITY * (angle.sin() - DYNAMIC * angle.cos());
            eprintln!("{name}: at {degrees}° {gained:.4} m/s², expected {expected:.4}");
            assert!((gained / expected - 1.0).abs() < 0.01, "{name}, {degrees}°: {gained} m/s², expected {expected}");
        }
    }
}

/// Returns the mean distance of `place(u, v)` from the middle. u and v are uniform between −1 and
/// 1.
fn mean_lever(place: impl Fn(f64, f64) -> DVec2) -> f64 {
    let at = |k: i32| (f64::from(k) + 0.5) / 50.0 - 1.0;
    (0..10_000).map(|k| place(at(k / 100), at(k % 100)).length()).sum::<f64>() / 10_000.0
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn spinning_block_stops_by_coulombs_law() {
    // The corners of a rotated block get caught between rails.
    for trial in level_trials().filter(|trial| !trial.name.contains(" on ")) {
        let name = &trial.name;
        let half = SIZE / 2.0;
        // With uniform load, the torque of friction is μ F times the mean distance of the patch's
        // points from the axis.
        let lever = if name.starts_with("sled") {
            mean_lever(|u, v| DVec2::new(half.x - 0.005 + 0.005 * u, half.y * v))
        } else {
            mean_lever(|u, v| DVec2::new(half.x * u, half.y * v))
        };
        let mut falling = resting(&trial, 0.3);
        falling.spin_drag.z = 0.0;
        let about = trial.block.mass().inertia.z_axis.z * MASS / trial.block.mass().volume;
        let spin = 12.0;
        falling.twist.angular.z = spin;
        let expected = spin * about / (DYNAMIC * MASS * GRAVITY * lever);
        let mut seconds = 0.0;
        while falling.twist.angular.z > 0.0 && seconds < 4.0 * expected {
            falling.step();
            seconds += DT;
        }
        eprintln!("{name}: spins for {seconds:.3} s, expected {expected:.3} s");
        assert!((seconds / expected - 1.0).abs() < 0.1, "{name}: {seconds} s, expected {expected} s");
        falling.spin_drag.z = DRAG.z;
        falling.run(1.0);
        assert!(falling.twist.angular.length() < 1e-3, "{name}: {}", falling.twist.angular);
    }
}

/// Returns for each second the distance (m) of a resting block on an incline from its position
/// after the first two seconds.
fn creep(trial: &Trial, seconds: u32) -> Vec<f64> {
    let mut falling = resting(trial, 0.3);
    tilt_to(&mut falling, 0.0, 0.35, 1.0);
    falling.run(1.0);
    let held = falling.pose;
    let turned = |pose: &Pose| pose.rotation.angle_between(held.rotation) * SIZE.x;
    (0..seconds)
        .map(|_| {
            falling.run(1.0);
            falling.pose.translation.distance(held.translation).max(turned(&falling.pose))
        })
        .collect()
}

#[allow(clippy::print_stderr, reason = "figures for the record")]
fn assert_no_drift(seconds: u32) {
    for trial in trials() {
        let name = &trial.name;
        let crept = creep(&trial, seconds);
        let half = crept.len() / 2;
        let most = |part: &[f64]| part.iter().copied().fold(0.0, f64::max);
        let (first, second) = (most(&crept[..half]), most(&crept[half..]));
        eprintln!("{name}: within {first:.1e} m in the first half of {seconds} s, {second:.1e} m in the second");
        assert!(first < 1e-6, "{name}: {first} m");
        assert!(second <= first * 1.1 + 1e-9, "{name}: {second} m after {first} m");
    }
}

#[test]
fn block_at_rest_on_an_incline_does_not_drift() {
    assert_no_drift(10);
}

#[test]
#[ignore = "ten minutes of simulated time, four times"]
fn block_at_rest_does_not_drift_in_ten_minutes() {
    assert_no_drift(600);
}
