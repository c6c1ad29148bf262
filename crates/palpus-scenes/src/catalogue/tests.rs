//! Tests that the scripted motions make the contacts that their descriptions promise. The
//! separation is measured between samples of one body (vertices and triangle centres) and the other
//! solid. Samples can miss an edge–edge contact. Then the measured separation is too large by less
//! than the size of a triangle.

use palpus::algebra::Pose;

use super::*;
use crate::overlap::{SampledSolid, overlap};

/// Largest separation that the samples can measure, m.
const FAR: f64 = 0.01;

/// Returns the least signed distance of `samples`, placed by `pose`, to the solid. At most [`FAR`].
fn separation(solid: &SampledSolid, samples: &[glam::DVec3], pose: &Pose) -> f64 {
    samples.iter().map(|&p| solid.signed_distance(pose.point(p), FAR)).fold(FAR, f64::min)
}

fn sampled(soup: &palpus::body::PolygonSoup) -> SampledSolid {
    SampledSolid::new(soup).expect("the shapes are valid")
}

/// Returns the separations at equal time steps along the scene's path.
fn profile(scene: &Scene, count: usize) -> Vec<f64> {
    let (a, b) = (sampled(&scene.probe), sampled(&scene.environment));
    let at = |k: usize| {
        let pose = scene.path.pose(scene.path.duration() * k as f64 / count as f64);
        // In a large environment, only samples near the probe are used.
        let back = pose.inverse();
        let reach = a.points().iter().map(|p| p.length()).fold(0.0, f64::max) + FAR;
        let near: Vec<_> = b.points().iter().copied().filter(|p| p.distance(pose.translation) < reach).collect();
        separation(&b, a.points(), &pose).min(separation(&a, &near, &back))
    };
    (0..=count).map(at).collect()
}

fn assert_touches(name: &str, count: usize, deepest: std::ops::Range<f64>, changes: usize) {
    let scene = scene(name).expect("a scene of that name");
    let profile = profile(&scene, count);
    let lowest = profile.iter().copied().fold(f64::INFINITY, f64::min);
    let swaps = profile.windows(2).filter(|pair| (pair[0] < 0.0) != (pair[1] < 0.0)).count();
    let shown: Vec<_> = profile.iter().map(|d| (d * 1e5).round() / 100.0).collect();
    assert!(deepest.contains(&-lowest), "{name}: deepest {:.3e} m, profile in mm {shown:?}", -lowest);
    assert!(swaps >= changes, "{name}: {swaps} changes between apart and overlapping, profile in mm {shown:?}");
    assert!(profile[0] > scene.contact.tolerance, "{name} starts in contact: {shown:?}");
}

#[test]
fn spoon_touches_the_cup_repeatedly() {
    assert_touches("spoon-cup", 130, 0.0005..0.003, 12);
}

#[test]
fn pen_crosses_the_sphere_once() {
    assert_touches("pen-sphere", 60, 0.001..0.002, 2);
}

#[test]
fn peg_goes_into_the_hole() {
    assert_touches("peg-hole", 80, 0.0001..0.001, 4);
}

#[test]
fn rings_pull_on_each_other() {
    assert_touches("torus-torus", 60, 0.001..0.003, 4);
}

#[test]
fn ball_touches_the_lumen() {
    assert_touches("intestine", 72, 0.0005..0.0025, 8);
}

#[test]
fn box_stands_on_the_table() {
    assert_touches("box-table", 60, 0.0008..0.002, 2);
}

#[test]
fn ball_slides_in_the_groove() {
    assert_touches("v-groove", 60, 0.0005..0.002, 2);
}

#[test]
fn peg_goes_into_the_held_block() {
    let scene = scene("two-hands").expect("a scene of that name");
    let second = scene.second.as_ref().expect("a second tool");
    let surfaces = [&scene.probe, &second.probe, &scene.environment].map(sampled);
    let between = |a: usize, b: usize, pose: &Pose| {
        let there = separation(&surfaces[b], surfaces[a].points(), pose);
        there.min(separation(&surfaces[a], surfaces[b].points(), &pose.inverse()))
    };
    let (mut least, mut deepest_tip) = ([FAR; 2], FAR);
    for k in 0..=96 {
        let time = 0.1 * f64::from(k);
        let (peg, block) = (scene.path.pose(time), second.path.pose(time));
        let together = block.inverse() * peg;
        least = [least[0].min(between(0, 1, &together)), least[1].min(between(1, 2, &block))];
        deepest_tip = deepest_tip.min(together.point(crate::shape::PEG_TIP).z);
        assert!(between(0, 2, &peg) > 0.0, "the peg touches the table at {time} s");
        if k == 0 {
            assert!(least.iter().all(|gap| *gap > scene.contact.tolerance), "{least:?}");
        }
    }
    assert!(least.iter().all(|gap| (-0.005..-0.0005).contains(gap)), "{least:?}");
    assert!(deepest_tip < -0.018, "{deepest_tip}");
}

#[test]
fn trials_make_contact() {
    assert_touches("box-tilt", 60, 0.0004..0.0025, 2);
    assert_touches("box-edge", 50, 0.0004..0.0006, 2);
    assert_touches("box-rest", 40, 0.0004..0.0006, 2);
    assert_touches("nut-bolt", 50, 0.0001..0.0006, 2);
}

#[test]
fn hands_move_within_human_limits() {
    for entry in scenes().iter().chain(trials()) {
        let scene = entry.build();
        assert_eq!(scene.start, scene.path.pose(0.0));
        let second = scene.second.as_ref().map(|second| (&second.start, &second.path));
        for (start, path) in [(&scene.start, &scene.path)].into_iter().chain(second) {
            assert_eq!(*start, path.pose(0.0));
            let mut previous = path.twist(0.0);
            for k in 1..=(path.duration() * 1000.0) as usize {
                let twist = path.twist(k as f64 * 1e-3);
                let (speed, turn) = (twist.linear.length(), twist.angular.length());
                let jump = (twist.linear - previous.linear).length();
                assert!(speed < 0.25 && turn < 4.0, "{}: {speed} m/s, {turn} rad/s at {k} ms", scene.name);
                assert!(jump < 5e-3, "{}: {jump} m/s in 1 ms at {k} ms", scene.name);
                previous = twist;
            }
        }
    }
}

#[test]
fn names_are_unique_and_found() {
    for entry in scenes().iter().chain(trials()) {
        assert_eq!(scenes().iter().chain(trials()).filter(|other| other.name == entry.name).count(), 1);
        assert!(scene(entry.name).is_some_and(|scene| scene.summary == entry.summary));
    }
    assert!(scene("no such scene").is_none());
}

/// Machine parts with play start without contact, and then their path presses them against each
/// other.
#[test]
fn machine_parts_start_free_and_touch() {
    let names = ["slot", "drawer", "key", "square-peg", "box-slide", "screwdriver", "ball-joint", "gears"];
    for name in names {
        let scene = scene(name).expect("a scene of that name");
        let (a, b) = (sampled(&scene.probe), sampled(&scene.environment));
        assert_eq!(overlap(&a, &b, &scene.start), 0.0, "{name} starts with an overlap");
        let deepest = (0..=20)
            .map(|k| overlap(&a, &b, &scene.path.pose(scene.path.duration() * f64::from(k) / 20.0)))
            .fold(0.0, f64::max);
        assert!(deepest > 0.05e-3, "{name}: {deepest} m");
    }
}

/// In the middle of its play, a rolling gear touches no tooth of the other gear.
#[test]
fn gears_roll_freely_at_pitch_distance() {
    let scene = scene("gears").expect("a scene of that name");
    let (a, b) = (sampled(&scene.probe), sampled(&scene.environment));
    for k in 0..12 {
        let angle = f64::from(k) * PI / 96.0;
        let pose = machine::meshed_gears(angle);
        let deepest = overlap(&a, &b, &pose);
        assert!(deepest < 1e-6, "{deepest} m at {angle} rad");
    }
}
