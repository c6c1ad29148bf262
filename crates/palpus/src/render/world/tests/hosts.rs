//! Tests hosts that drive bodies at their own rate, including hosts that send bad updates.

use glam::DVec3;

use super::{DT, at, cuboid, settings};
use crate::algebra::{NoClock, Pose, Random, Twist};
use crate::render::{Object, ProbeState, World};

const SEED: u64 = 0xd21e_0001;

/// Position (m) and velocity (m/s) of a driven body at a time (s).
type Way = fn(f64) -> (DVec3, DVec3);

/// Returns the largest change of force (N) in ticks with an update, the largest change in other
/// ticks, and the last force.
fn steps(way: Way, mut pause: impl FnMut() -> f64) -> (f64, f64, DVec3) {
    let mut world = World::new(settings()).unwrap();
    let said = |t: f64| {
        let (place, linear) = way(t);
        (Pose::from_translation(place - DVec3::Z * 0.01), Twist { angular: DVec3::ZERO, linear })
    };
    let belt = world.add(Object::driven(cuboid(DVec3::new(8.0, 0.2, 0.02)), said(0.0).0)).unwrap();
    let tool = world.add_tool(cuboid(DVec3::splat(0.02)), settings()).unwrap();
    let (mut next, mut last) = (0.0, DVec3::ZERO);
    let (mut at_update, mut between) = (0.0f64, 0.0f64);
    for k in 0..2000 {
        let t = f64::from(k) * DT;
        let is_update = t >= next;
        if is_update {
            let (pose, twist) = said(t);
            assert!(world.drive(belt, pose, twist));
            next += pause();
        }
        world.step(&[ProbeState::at(at(0.0, 0.0, 0.006))], DT, &NoClock);
        let force = world.tick(tool).commanded.force;
        let step = force.distance(last);
        if k > 300 {
            let most = if is_update { &mut at_update } else { &mut between };
            *most = most.max(step);
        }
        last = force;
    }
    (at_update, between, last)
}

fn conveyor(t: f64) -> (DVec3, DVec3) {
    (DVec3::X * (2.0 * t - 2.0), DVec3::X * 2.0)
}

/// Returns a motion of 2 mm up and down at 2 Hz, against the tool.
fn press(t: f64) -> (DVec3, DVec3) {
    let phase = 4.0 * std::f64::consts::PI * t;
    (DVec3::Z * (0.002 * phase.sin()), DVec3::Z * (0.002 * 4.0 * std::f64::consts::PI * phase.cos()))
}

#[test]
fn updates_are_not_felt_as_steps() {
    let mut random = Random::new(SEED);
    let steady = steps(conveyor, || 1.0 / 60.0);
    let jittery = steps(conveyor, || 0.010 + 0.015 * random.unit());
    let press = steps(press, || 1.0 / 60.0);
    // Rounding changes a force by less than a micronewton. For the press, the force changes with
    // the coupling's stiffness times the press's speed.
    for (name, (at_update, between, force), most) in
        [("conveyor", steady, 1e-6), ("conveyor, jittery host", jittery, 1e-6), ("press", press, 0.025)]
    {
        assert!(at_update <= between.max(1e-6), "{name}: {at_update} N at updates, {between} N between");
        assert!(between <= most, "{name}: {between} N from tick to tick");
        assert!(force.z > 0.3, "{name}: the tool touches: {force}, seed {SEED:#x}");
    }
}

/// For any input of hosts at any time, every wrench is finite and within the device's limits.
#[test]
fn hostile_hosts_break_nothing() {
    let mut random = Random::new(SEED);
    let mut world = World::new(settings()).unwrap();
    world.set_gravity(DVec3::Z * -9.81);
    world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    let block = cuboid(DVec3::splat(0.04));
    let free = world.add(Object::free(block.clone(), at(0.0, 0.0, 0.02), 700.0)).unwrap();
    let driven = world.add(Object::driven(block.clone(), at(0.05, 0.0, 0.02))).unwrap();
    let tool = world.add_tool(block, settings()).unwrap();
    let odd = [0.0, 1e-300, 1e-12, 0.04, -0.03, 1.0, 1e9, -1e150, 1e300, f64::MAX, f64::INFINITY, f64::NAN];
    for tick in 0..4000 {
        let mut any = || if random.unit() < 0.7 { 0.1 * random.signed() } else { odd[(random.unit() * 12.0) as usize] };
        let mut vector = || DVec3::new(any(), any(), any());
        let pose = Pose::from_translation(vector());
        let twist = Twist { angular: vector(), linear: vector() };
        let dt = [DT, DT, DT, 0.0, f64::NAN, 1e-9, 10.0, 1e300][tick % 8];
        match tick % 7 {
            0 => {
                world.drive(driven, pose, twist);
            }
            1 => {
                world.throw(free, twist);
            }
            2 => {
                world.put(free, pose);
            }
            3 => {
                world.put(driven, pose);
            }
            4 => world.set_gravity(twist.linear),
            _ => {}
        }
        world.step(&[ProbeState { pose_ba: at(0.02, 0.0, 0.05), twist: Twist::default() }], dt, &NoClock);
        let felt = world.tick(tool).commanded;
        assert!(felt.is_finite(), "tick {tick}, seed {SEED:#x}: {felt:?}");
        assert!(felt.force.length() <= super::LIMITS.force * (1.0 + 1e-9), "tick {tick}, seed {SEED:#x}: {felt:?}");
    }
}
