//! Tests bodies that sleep.

use std::sync::Arc;

use glam::DVec3;

use super::{DT, G, at, cuboid, run, settings, speed, table};
use crate::algebra::tolerance::SLEEP_AFTER;
use crate::algebra::{NoClock, Pose, Twist};
use crate::body::Body;
use crate::render::{BodyId, Object, ProbeState, World};

const SIDE: f64 = 0.04;
/// Ticks after which blocks that were put on the table sleep.
const SETTLED: u32 = 300 + (SLEEP_AFTER / DT) as u32;

fn block() -> Arc<Body> {
    cuboid(DVec3::splat(SIDE))
}

/// Returns a world with a table and a stack of sleeping blocks.
fn stack(count: u32) -> (World, Vec<BodyId>) {
    let mut world = table();
    let place = |k: u32| at(0.0, 0.0, 0.0201 + 0.0402 * f64::from(k));
    let blocks = (0..count).map(|k| world.add(Object::free(block(), place(k), 700.0)).unwrap()).collect();
    run(&mut world, SETTLED);
    assert_eq!(world.counters().asleep, count);
    (world, blocks)
}

#[test]
fn still_bodies_sleep_and_are_not_moved() {
    let (mut world, blocks) = stack(3);
    let poses = |world: &World| blocks.iter().map(|&block| world.pose(block)).collect::<Vec<_>>();
    let contacts = |world: &World| world.contacts(blocks[0], blocks[1]).collect::<Vec<_>>();
    let before = (poses(&world), contacts(&world));
    run(&mut world, 2000);
    assert_eq!((poses(&world), contacts(&world)), before);
    assert_eq!((world.counters().asleep, world.counters().islands, world.counters().touching), (3, 0, 3));
    assert!(blocks.iter().all(|&block| world.twist(block) == Twist::default()));
}

/// A tool pushes the lower block of a sleeping stack, and the same stack that never slept.
#[test]
fn sleeping_bodies_feel_like_bodies_that_are_awake() {
    let forces = |sleeps: bool| -> Vec<DVec3> {
        let (mut world, _) = stack(3);
        let tool = world.add_tool(cuboid(DVec3::splat(0.01)), settings()).unwrap();
        let mut settle = |sleeps: bool, x: f64| {
            if !sleeps {
                world.wake_all();
            }
            world.step(&[ProbeState::at(at(x, 0.0, 0.02))], DT, &NoClock);
            (world.counters().asleep, world.tick(tool).commanded.force)
        };
        // A tool wakes all bodies when it is added.
        let asleep = (0..SETTLED).fold(0, |_, _| settle(sleeps, -0.1).0);
        assert_eq!(asleep, if sleeps { 3 } else { 0 });
        (0..2500).map(|k| settle(sleeps, -0.1 + 0.04 * f64::from(k) * DT).1).collect()
    };
    let (asleep, awake) = (forces(true), forces(false));
    let most = awake.iter().map(|force| force.length()).fold(0.0, f64::max);
    let difference = asleep.iter().zip(&awake).map(|(one, other)| one.distance(*other)).fold(0.0, f64::max);
    assert!(most > 0.5, "the tool pushes with {most} N");
    assert!(difference < 1e-6 * most, "the forces differ by {difference} N");
}

#[test]
fn everything_that_can_move_a_sleeping_body_wakes_it() {
    let asleep = |world: &mut World| {
        run(world, 1);
        world.counters().asleep
    };
    let (mut world, _) = stack(2);
    world.set_gravity(G);
    assert_eq!(asleep(&mut world), 0, "gravity");

    let (mut world, blocks) = stack(2);
    let shelf = world.add(Object::fixed(block(), at(0.0, 0.3, 0.0))).unwrap();
    run(&mut world, SETTLED);
    assert_eq!(asleep(&mut world), 2);
    assert!(world.put(shelf, at(0.0, 0.4, 0.0)));
    assert_eq!(asleep(&mut world), 0, "an object was moved");
    assert!(blocks.iter().all(|&block| speed(&world, block) < 1e-6));

    let (mut world, blocks) = stack(2);
    let twist = Twist { linear: DVec3::Z * 0.1, angular: DVec3::ZERO };
    assert!(world.throw(blocks[0], twist));
    run(&mut world, 10);
    assert_eq!(world.counters().asleep, 0, "the lower block is thrown");

    // A third block falls on two blocks, which fall asleep while it falls.
    let (mut world, _) = stack(2);
    let falling = world.add(Object::free(block(), at(0.0, 0.0, 0.7), 700.0)).unwrap();
    run(&mut world, 340);
    assert_eq!(world.counters().asleep, 2);
    run(&mut world, 20);
    assert_eq!(world.counters().asleep, 0, "the block has landed");
    run(&mut world, SETTLED);
    assert_eq!(world.counters().asleep, 3);
    assert!(world.pose(falling).translation.z < 0.1 + 1e-3);
}

#[test]
fn bodies_on_a_driven_body_wake_when_it_moves() {
    let mut world = World::new(settings()).unwrap();
    world.set_gravity(G);
    let belt = world.add(Object::driven(cuboid(DVec3::new(1.0, 0.2, 0.02)), at(0.0, 0.0, -0.01))).unwrap();
    let carried = world.add(Object::free(block(), at(0.0, 0.0, 0.0201), 700.0)).unwrap();
    run(&mut world, SETTLED);
    assert_eq!(world.counters().asleep, 1);
    let speed = 0.1;
    for tick in 0..500 {
        let x = speed * f64::from(tick) * DT;
        world.drive(belt, at(x, 0.0, -0.01), Twist { linear: DVec3::X * speed, angular: DVec3::ZERO });
        run(&mut world, 1);
    }
    assert_eq!(world.counters().asleep, 0);
    let moved = world.pose(carried).translation.x;
    assert!((0.04..=0.05).contains(&moved), "the belt has carried the block by {moved} m");
}

/// Two bodies that touch in weightlessness drift by less than a still body may move.
#[test]
fn bodies_without_a_fixed_support_keep_their_momentum() {
    let mut world = World::new(settings()).unwrap();
    let twist = Twist { linear: DVec3::X * 1e-7, angular: DVec3::ZERO };
    let blocks = [0.0, SIDE].map(|x| world.add(Object::free(block(), at(x, 0.0, 0.0), 700.0)).unwrap());
    blocks.iter().for_each(|&block| assert!(world.throw(block, twist)));
    let momentum = |world: &World| blocks.iter().map(|&block| world.momentum(block).force).sum::<DVec3>();
    let before = momentum(&world);
    run(&mut world, 2 * SETTLED);
    assert_eq!(world.counters().asleep, 0);
    assert!(momentum(&world).distance(before) < 1e-9 * before.length());
}

/// A body that hovers beside a wall, so near that it could touch it in the next step.
#[test]
fn bodies_that_press_on_nothing_do_not_sleep() {
    let mut world = World::new(settings()).unwrap();
    world.add(Object::fixed(block(), at(-SIDE, 0.0, 0.0))).unwrap();
    let beside = 1.5 * settings().contact_offset();
    let hovering = world.add(Object::free(block(), at(beside, 0.0, 0.0), 700.0)).unwrap();
    run(&mut world, 1);
    assert_eq!(world.counters().touching, 1, "the wall is within the distance that is searched");
    assert!(world.throw(hovering, Twist { linear: DVec3::Y * 1e-7, angular: DVec3::ZERO }));
    run(&mut world, 2 * SETTLED);
    assert_eq!((world.counters().touching, world.counters().asleep), (1, 0));
    assert!((world.twist(hovering).linear.y - 1e-7).abs() < 1e-16);
}

/// A tool that holds a body keeps it awake.
#[test]
fn touched_bodies_do_not_sleep() {
    let (mut world, blocks) = stack(1);
    let tool = world.add_tool(cuboid(DVec3::splat(0.01)), settings()).unwrap();
    let device = Pose::from_translation(world.pose(blocks[0]).translation + DVec3::Z * (0.025 - 1e-3));
    (0..SETTLED).for_each(|_| world.step(&[ProbeState::at(device)], DT, &NoClock));
    assert_eq!(world.counters().asleep, 0);
    let held = world.tick(tool).commanded.force.z;
    let away = ProbeState::at(at(0.0, 0.0, 0.3));
    (0..SETTLED).for_each(|_| world.step(&[away], DT, &NoClock));
    assert!(held > 0.1 && world.counters().asleep == 1, "the tool pressed with {held} N");
}
