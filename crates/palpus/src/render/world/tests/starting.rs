//! Tests free bodies that overlap other bodies at the start.

use glam::DVec3;

use super::{G, at, cuboid, run, settings, speed};
use crate::render::{Object, Settings, World};

const SIDE: f64 = 0.04;

/// Returns the largest height of a block above its height at the end, its largest speed, and its
/// height at the end, for a block that begins `deep` (m) in a table.
fn rise(deep: f64) -> [f64; 3] {
    let mut world = World::new(Settings { stiffness: 2.5e5, ..settings() }).unwrap();
    world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    world.set_gravity(G);
    let block = world.add(Object::free(cuboid(DVec3::splat(SIDE)), at(0.0, 0.0, 0.5 * SIDE - deep), 1000.0)).unwrap();
    let (mut highest, mut fastest) = (f64::MIN, 0.0f64);
    for _ in 0..1000 {
        run(&mut world, 1);
        highest = highest.max(world.pose(block).translation.z);
        fastest = fastest.max(speed(&world, block));
    }
    let last = world.pose(block).translation.z;
    [highest - last, fastest, last]
}

#[test]
fn body_that_overlaps_at_the_start_comes_out_slowly() {
    let [_, _, placed] = rise(0.0);
    for deep in [1e-5, 1e-3, 1e-2] {
        let [above, fastest, last] = rise(deep);
        // It was 1.2 m and 5 m/s for the deepest start.
        assert!(above < 5e-4 && fastest < 0.1, "{deep} m: {above} m, {fastest} m/s");
        assert!((last - placed).abs() < 1e-6, "{deep} m: ends at {last} m, and not at {placed} m");
    }
}

/// A block of 6.4 kg falls 0.1 mm. Its weight presses it 0.27 mm into the table.
#[test]
fn overlap_that_begins_later_is_resisted_at_once() {
    let mut world = World::new(settings()).unwrap();
    world.add(Object::fixed(cuboid(DVec3::new(1.0, 1.0, 0.1)), at(0.0, 0.0, -0.05))).unwrap();
    world.set_gravity(G);
    let start = at(0.0, 0.0, 0.5 * SIDE + 1e-4);
    let block = world.add(Object::free(cuboid(DVec3::splat(SIDE)), start, 100_000.0)).unwrap();
    let mut deepest = 0.0f64;
    for _ in 0..500 {
        run(&mut world, 1);
        deepest = deepest.max(0.5 * SIDE - world.pose(block).translation.z);
    }
    let last = 0.5 * SIDE - world.pose(block).translation.z;
    assert!(deepest < 7e-4, "{deepest} m");
    assert!((2e-4..3.5e-4).contains(&last), "{last} m");
}
