//! Tests a heap of free bodies in a world with limited work.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::Body;
use palpus::render::{BodyId, Limits, Object, ProbeState, Settings, ToolId, WorkLimit, World};
use palpus_scenes::shape::{cuboid, cup, gear, nut, scanned_torus, spoon};

const DT: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);
/// Work limit of a step. Without a limit, steps in which parts land need up to 140 times as much.
const WORK: u64 = 500;

/// Parts that fall onto a table, beside a tool that touches nothing.
struct Heap {
    world: World,
    tool: ToolId,
    parts: Vec<(BodyId, Arc<Body>)>,
}

impl Heap {
    fn new() -> Self {
        let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, DT, 5e-4).with_friction(0.4, 0.3);
        let mut world = World::new(settings).expect("valid settings");
        world.set_gravity(GRAVITY);
        let table = body(&cuboid(DVec3::new(0.8, 0.8, 0.02)));
        world.add(Object::fixed(table, Pose::from_translation(DVec3::Z * -0.01))).expect("a valid pose");
        let mut parts = Vec::new();
        let mut height = 0.0;
        for (k, soup) in (0..).zip([scanned_torus(4000), gear(), spoon(), nut(), cup()]) {
            let part = body(&soup);
            let size = part.size();
            let rotation = DQuat::from_rotation_x(0.5 + f64::from(k)) * DQuat::from_rotation_y(0.3 * f64::from(k));
            let center = DVec3::new(0.01 * f64::from(k % 3), 0.01 * f64::from(k % 2), height + 0.55 * size);
            let translation = center - rotation * part.mass().center_of_mass;
            let start = Pose { translation, rotation };
            parts.push((world.add(Object::free(part.clone(), start, 1000.0)).expect("a valid object"), part));
            height += 1.1 * size;
        }
        let tool = world.add_tool(body(&cuboid(DVec3::splat(0.01))), settings).expect("valid settings");
        Self { world, tool, parts }
    }

    fn step(&mut self) {
        self.world.step(&[ProbeState::at(Pose::from_translation(DVec3::new(0.0, 0.3, 0.3)))], DT, &NoClock);
    }

    /// Returns the sum of the kinetic and the potential energy of all parts, J.
    fn energy(&self) -> f64 {
        let of_part = |(id, part): &(BodyId, Arc<Body>)| {
            let (momentum, twist, mass) = (self.world.momentum(*id), self.world.twist(*id), part.mass());
            let center = self.world.pose(*id).point(mass.center_of_mass);
            0.5 * momentum.power(&twist) - 1000.0 * mass.volume * GRAVITY.dot(center)
        };
        self.parts.iter().map(of_part).sum()
    }
}

#[test]
fn heap_with_little_work_gains_no_energy() {
    let mut heap = Heap::new();
    heap.world.allow(WorkLimit::Units(WORK));
    let first = heap.energy();
    let (mut last, mut gained, mut held) = (first, 0.0f64, 0);
    for _ in 0..2000 {
        heap.step();
        let energy = heap.energy();
        gained += (energy - last).max(0.0);
        held += u32::from(heap.world.counters().bounded > 0);
        last = energy;
    }
    assert!(held > 1000, "{held}");
    // It was 10 times the first energy when gravity accelerated parts that were held.
    assert!(gained < 1e-6 * first, "{gained} J of {first} J");
}

#[test]
fn work_that_pairs_leave_goes_to_those_that_need_it() {
    let mut heap = Heap::new();
    heap.world.allow(WorkLimit::Units(WORK));
    let (mut held, mut unused) = (0, 0);
    for _ in 0..2000 {
        heap.step();
        let tick = heap.world.tick(heap.tool);
        let is_held = heap.world.counters().bounded > 0;
        held += u32::from(is_held);
        unused += u32::from(is_held && tick.work < WORK * 3 / 4);
    }
    // Measured: 1 %. It was 38 % when pairs with much work were queried before others.
    assert!(held > 1000 && unused * 20 < held, "{unused} of {held}");
}
