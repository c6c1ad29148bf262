//! Tests worlds against known results of mechanics.

mod facets;
mod hosts;
mod sleeping;
mod starting;
mod sticking;
mod swinging;

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::{BodyId, Object, ToolId, World};
use crate::algebra::{NoClock, Pose, Twist, Wrench};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
use crate::force::FrictionSettings;
use crate::render::{Limits, ProbeState, Settings, VirtualCoupling};

const DT: f64 = 1e-3;
const G: DVec3 = DVec3::new(0.0, 0.0, -9.81);
const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };
const MU: f64 = 0.4;

fn cuboid(size: DVec3) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    let sign = |k: u32, bit: u32| if k >> bit & 1 == 1 { 0.5 } else { -0.5 };
    soup.vertices.extend((0..8).map(|k| DVec3::new(sign(k, 0), sign(k, 1), sign(k, 2)) * size));
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        soup.push_face(&face);
    }
    let (mesh, _) = Mesh::from_soup(&soup).unwrap();
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

fn settings() -> Settings {
    Settings {
        limits: LIMITS,
        stiffness: 5000.0,
        coupling: Some(VirtualCoupling::tuned(&LIMITS, DT, 1e-3)),
        friction: Some(FrictionSettings {
            static_coefficient: MU,
            dynamic_coefficient: MU,
            tangential_stiffness: 5000.0,
        }),
        ..Settings::default()
    }
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::from_translation(DVec3::new(x, y, z))
}

/// Returns a world with a table whose top is z = 0.
fn table() -> World {
    let mut world = World::new(settings()).unwrap();
    world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    world.set_gravity(G);
    world
}

fn run(world: &mut World, ticks: u32) {
    for _ in 0..ticks {
        world.step(&[], DT, &NoClock);
    }
}

/// Runs steps in which no body sleeps.
fn run_awake(world: &mut World, ticks: u32) {
    for _ in 0..ticks {
        world.wake_all();
        world.step(&[], DT, &NoClock);
    }
}

fn speed(world: &World, body: BodyId) -> f64 {
    let Twist { angular, linear } = world.twist(body);
    linear.length() + 0.02 * angular.length()
}

#[test]
fn block_and_stack_come_to_rest() {
    for count in [1, 3] {
        let mut world = table();
        let body = cuboid(DVec3::splat(0.04));
        let blocks: Vec<_> = (0..count)
            .map(|k| {
                let pose = at(0.002 * f64::from(k), 0.0, 0.0201 + 0.0402 * f64::from(k));
                world.add(Object::free(body.clone(), pose, 700.0)).unwrap()
            })
            .collect();
        run_awake(&mut world, 1000);
        let before: Vec<_> = blocks.iter().map(|&block| world.pose(block)).collect();
        run_awake(&mut world, 2000);
        for (&block, before) in blocks.iter().zip(&before) {
            let drift = world.pose(block).translation.distance(before.translation);
            assert!(drift < 1e-9, "{count} blocks: {drift} m in two seconds");
            assert!(speed(&world, block) < 1e-9, "{count} blocks: {:?}", world.twist(block));
        }
        // The table bears the weight of all blocks.
        let weight = f64::from(count) * 700.0 * 0.04f64.powi(3) * -G.z;
        let borne = world.pairs[0].impulse(&Twist::default(), DT).force.z / DT;
        assert!((borne - weight).abs() < 1e-6 * weight, "{borne} N of {weight}");
    }
}

#[test]
#[ignore = "ten minutes of rest take minutes"]
fn block_and_stack_rest_for_ten_minutes() {
    for count in [1, 3] {
        let mut world = table();
        let body = cuboid(DVec3::splat(0.04));
        let mass = 700.0 * 0.04f64.powi(3);
        let pose = |k: u32| at(0.002 * f64::from(k), 0.0, 0.0201 + 0.0402 * f64::from(k));
        let blocks: Vec<_> =
            (0..count).map(|k| world.add(Object::free(body.clone(), pose(k), 700.0)).unwrap()).collect();
        run_awake(&mut world, 1000);
        // Bound of the energy above rest, J. The kinetic energy is overestimated, since a cube's
        // radius of inertia is less than 0.02 m.
        let energy = |world: &World| -> f64 {
            let of = |&id: &BodyId| speed(world, id).powi(2) - G.z * world.pose(id).translation.z;
            mass * blocks.iter().map(of).sum::<f64>()
        };
        let before: Vec<_> = blocks.iter().map(|&block| world.pose(block)).collect();
        let begin = energy(&world);
        for minute in 0..10 {
            run_awake(&mut world, 60_000);
            let gained = energy(&world) - begin;
            assert!(gained < 1e-12, "{count} blocks, minute {minute}: {gained} J");
            for (&block, before) in blocks.iter().zip(&before) {
                let drift = world.pose(block).translation.distance(before.translation);
                assert!(drift < 1e-6 && speed(&world, block) < 1e-9, "minute {minute}: {drift} m");
            }
        }
    }
}

/// On a slope just below the friction angle a block stays. Just above this angle, it slides as
/// Coulomb's law predicts.
#[test]
fn block_on_a_slope_follows_coulombs_law() {
    let limit = MU.atan();
    for (slope, slides) in [(0.5 * limit, false), (0.97 * limit, false), (1.2 * limit, true)] {
        let mut world = table();
        world.set_gravity(DVec3::new(slope.sin(), 0.0, -slope.cos()) * 9.81);
        let block = world.add(Object::free(cuboid(DVec3::new(0.06, 0.04, 0.02)), at(-0.3, 0.0, 0.01), 700.0)).unwrap();
        run(&mut world, 300);
        let (from, begin) = (world.pose(block).translation.x, world.twist(block).linear.x);
        run(&mut world, 300);
        let (to, end) = (world.pose(block).translation.x, world.twist(block).linear.x);
        let expected = 9.81 * (slope.sin() - MU * slope.cos());
        if slides {
            let acceleration = (end - begin) / 0.3;
            assert!((acceleration - expected).abs() < 0.01 * 9.81 * MU * slope.cos(), "{acceleration}, {expected}");
        } else {
            // Waits until the loads of the block's corners have settled.
            run(&mut world, 300);
            let at_rest = world.pose(block).translation.x;
            run(&mut world, 1000);
            let crept = world.pose(block).translation.x - at_rest;
            assert!(crept.abs() < 1e-9 && end.abs() < 1e-9, "{crept} m in a second, {} m before", to - from);
        }
    }
}

/// Three bodies collide in free space at odd angles.
#[test]
fn collisions_conserve_momentum() {
    let mut world = World::new(settings()).unwrap();
    let bodies = [
        (cuboid(DVec3::new(0.06, 0.04, 0.02)), at(0.0, 0.0, 0.0)),
        (cuboid(DVec3::splat(0.03)), at(0.06, 0.013, 0.004)),
        (cuboid(DVec3::new(0.02, 0.08, 0.03)), at(-0.05, -0.02, 0.0)),
    ];
    let ids = bodies.map(|(body, pose)| world.add(Object::free(body, pose, 900.0)).unwrap());
    world.throw(ids[0], Twist { angular: DVec3::new(1.0, 5.0, -3.0), linear: DVec3::ZERO });
    world.throw(ids[1], Twist { angular: DVec3::new(7.0, -2.0, 1.0), linear: DVec3::new(-0.3, 0.0, 0.01) });
    world.throw(ids[2], Twist { angular: DVec3::ZERO, linear: DVec3::new(0.25, 0.05, 0.0) });
    let total = |world: &World| {
        ids.iter().fold((DVec3::ZERO, DVec3::ZERO), |(linear, angular), &id| {
            let Wrench { torque, force } = world.momentum(id);
            let thing = &world.things[id.0];
            let center = thing.pose.point(thing.body.mass().center_of_mass);
            (linear + force, angular + torque + center.cross(force))
        })
    };
    let size: f64 = ids.iter().map(|&id| world.momentum(id).force.length()).sum();
    let (linear, angular) = total(&world);
    let mut met = 0;
    for tick in 0..1000 {
        run(&mut world, 1);
        met += world.counters().touching;
        let (now, turning) = total(&world);
        assert!(now.distance(linear) < 1e-9 * size, "tick {tick}: {now} of {linear}");
        assert!(turning.distance(angular) < 1e-9 * 0.1 * size, "tick {tick}: {turning} of {angular}");
    }
    assert!(met > 10, "the bodies must collide: {met}");
}

/// Returns a free block on a table, and two fingers that press it from both sides.
fn squeeze() -> (World, BodyId, [ToolId; 2]) {
    let mut world = table();
    let block = world.add(Object::free(cuboid(DVec3::splat(0.04)), at(0.0, 0.0, 0.02), 700.0)).unwrap();
    let finger = cuboid(DVec3::new(0.02, 0.03, 0.03));
    let fingers = [0, 1].map(|_| world.add_tool(finger.clone(), settings()).unwrap());
    (world, block, fingers)
}

/// Returns the target poses of the two fingers: each is `in_by` (m) inside the block, lifted by
/// `lift` (m), and turned about the y axis by `turn` (rad).
fn meant(in_by: f64, lift: f64, turn: f64) -> [ProbeState; 2] {
    let rotation = DQuat::from_rotation_y(turn);
    [-1.0, 1.0].map(|side| {
        let offset = rotation * (DVec3::X * (side * (0.03 - in_by)));
        ProbeState::at(Pose::new(rotation, DVec3::Z * (0.02 + lift) + offset))
    })
}

#[test]
fn two_tools_lift_and_turn_a_free_block() {
    let (mut world, block, fingers) = squeeze();
    let (depth, height, angle) = (3e-3, 0.05, 0.5);
    for k in 0..3000 {
        let t = f64::from(k) * DT;
        let ramp = |from: f64, to: f64| ((t - from) / (to - from)).clamp(0.0, 1.0);
        let probes = meant(depth * ramp(0.0, 0.5), height * ramp(0.6, 1.4), angle * ramp(1.5, 2.3));
        world.step(&probes, DT, &NoClock);
    }
    let pose = world.pose(block);
    let turned = pose.rotation * DVec3::X;
    assert!((pose.translation.z - 0.02 - height).abs() < 2e-3, "{pose:?}");
    assert!((turned.z.atan2(turned.x) + angle).abs() < 0.05, "{pose:?}");
    assert!(speed(&world, block) < 1e-3, "{:?}", world.twist(block));
    let [left, right] = fingers.map(|finger| world.tick(finger).commanded.force);
    let weight = 700.0 * 0.04f64.powi(3) * 9.81;
    assert!((left + right).distance(G.normalize() * weight) < 0.05, "{left} and {right} bear {weight} N");
}

/// Bodies that a tool does not touch do not change its wrench.
#[test]
fn bodies_without_contact_do_not_change_the_wrench() {
    let probe = cuboid(DVec3::splat(0.02));
    let press = |k: u32| {
        let t = f64::from(k) * DT;
        ProbeState::at(at(0.05 * t, 0.0, 0.01 - 2e-3 * (3.0 * t).sin()))
    };
    let mut alone = table();
    let tool = alone.add_tool(probe.clone(), settings()).unwrap();
    let mut among = table();
    for k in 0..20 {
        let pose = at(-0.4 + 0.04 * f64::from(k % 10), 0.3 + 0.05 * f64::from(k / 10), 0.0101);
        among.add(Object::free(probe.clone(), pose, 700.0)).unwrap();
    }
    let same = among.add_tool(probe, settings()).unwrap();
    let mut most = 0.0f64;
    for k in 0..1500 {
        alone.step(&[press(k)], DT, &NoClock);
        among.step(&[press(k)], DT, &NoClock);
        most = most.max(alone.tick(tool).commanded.force.z);
        assert_eq!(alone.tick(tool).commanded, among.tick(same).commanded, "tick {k}");
    }
    assert!(most > 0.1, "{most} N");
}

#[test]
fn moved_and_added_bodies_are_felt() {
    let mut world = World::new(settings()).unwrap();
    let block = cuboid(DVec3::splat(0.02));
    let wall = world.add(Object::fixed(block.clone(), at(1.0, 0.0, 0.0))).unwrap();
    let tool = world.add_tool(block.clone(), settings()).unwrap();
    let felt = |world: &mut World, x: f64| {
        world.clear();
        (0..20).for_each(|k| world.step(&[ProbeState::at(at(x, 0.0, 0.022 - 2e-4 * f64::from(k)))], DT, &NoClock));
        world.tick(tool).commanded.force.z
    };
    assert_eq!(felt(&mut world, 0.0), 0.0);
    assert!(felt(&mut world, 1.0) > 0.5);
    assert!(world.put(wall, at(0.0, 0.0, 0.0)));
    assert!(felt(&mut world, 0.0) > 0.5);
    assert_eq!(felt(&mut world, 1.0), 0.0);
    world.add(Object::fixed(block, at(2.0, 0.0, 0.0))).unwrap();
    assert!(felt(&mut world, 2.0) > 0.5);
}

#[test]
fn invalid_input_is_refused_and_changes_nothing() {
    let mut world = table();
    let body = cuboid(DVec3::splat(0.02));
    for density in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = world.add(Object::free(body.clone(), Pose::IDENTITY, density)).unwrap_err();
        assert!(error.to_string().contains("mass"), "{error}");
    }
    assert!(world.add(Object::fixed(body.clone(), at(f64::NAN, 0.0, 0.0))).is_err());
    let block = world.add(Object::free(body.clone(), at(0.0, 0.0, 0.5), 700.0)).unwrap();
    let arm = world.add(Object::driven(body.clone(), at(0.3, 0.0, 0.5))).unwrap();
    let tool = world.add_tool(body, settings()).unwrap();
    assert!(!world.drive(block, Pose::IDENTITY, Twist::default()));
    assert!(!world.drive(arm, at(f64::NAN, 0.0, 0.0), Twist::default()));
    assert!(!world.throw(arm, Twist::default()) && !world.put(world.body_of(tool), Pose::IDENTITY));
    world.set_gravity(DVec3::NAN);
    for dt in [0.0, f64::NAN, -1.0, DT] {
        // A step without a probe state, and a step with an invalid pose.
        world.step(&[], dt, &NoClock);
        world.step(&[ProbeState::at(at(f64::NAN, 0.0, 0.0))], dt, &NoClock);
        assert_eq!(world.tick(tool).commanded, Wrench::ZERO);
    }
    assert_eq!(world.pose(block), at(0.0, 0.0, 0.5));
    assert!(world.put(block, at(0.1, 0.0, 0.5)));
    assert_eq!(world.pose(block), at(0.1, 0.0, 0.5));
}
