//! Tests the effects of the scripted motions in scenes with free bodies. No step may allocate
//! memory.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{NoClock, Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::FrictionSettings;
use palpus::render::{BodyId, Limits, Object, ProbeState, Settings, VirtualCoupling, World};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_scenes::{Motion, Scene};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const DT: f64 = 1e-3;
const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };

/// A built-in scene in a world. The scripted hands move its tools.
struct Stage {
    scene: Scene,
    world: World,
    objects: Vec<BodyId>,
    ticks: u32,
}

fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("a valid shape"))
}

impl Stage {
    fn new(name: &str) -> Self {
        let scene = palpus_scenes::scene(name).expect("a built-in scene");
        let stiffness =
            VirtualCoupling::contact_stiffness(&LIMITS, scene.contact.tolerance).expect("a finite force limit");
        let settings = Settings {
            contact_tolerance: scene.contact.tolerance,
            cluster_radius: scene.contact.cluster_radius,
            stiffness,
            friction: scene.contact.friction.map(|friction| FrictionSettings {
                static_coefficient: friction.static_coefficient,
                dynamic_coefficient: friction.dynamic_coefficient,
                tangential_stiffness: stiffness,
            }),
            coupling: Some(VirtualCoupling::tuned(&LIMITS, DT, scene.contact.tolerance)),
            limits: LIMITS,
            ..Settings::default()
        };
        let mut world = World::new(settings).expect("valid settings");
        world.set_gravity(scene.gravity);
        world.add(Object::fixed(body(&scene.environment), Pose::IDENTITY)).expect("a valid pose");
        let mut shapes = HashMap::new();
        let mut objects = Vec::new();
        for object in &scene.objects {
            let shape = shapes.entry(Arc::as_ptr(&object.shape)).or_insert_with(|| body(&object.shape)).clone();
            let object = match object.motion {
                Motion::Fixed => Object::fixed(shape, object.start),
                Motion::Driven(_) => Object::driven(shape, object.start),
                Motion::Free(density) => Object::free(shape, object.start, density),
            };
            objects.push(world.add(object).expect("a valid pose and density"));
        }
        let probes = [Some(&scene.probe), scene.second.as_ref().map(|second| &second.probe)];
        for probe in probes.into_iter().flatten() {
            world.add_tool(body(probe), settings).expect("valid settings");
        }
        Self { scene, world, objects, ticks: 0 }
    }

    /// Continues until `time` (s).
    fn run_until(&mut self, time: f64) {
        let paths = [Some(&self.scene.path), self.scene.second.as_ref().map(|second| &second.path)];
        while f64::from(self.ticks) * DT < time {
            let now = f64::from(self.ticks) * DT;
            if self.ticks.is_multiple_of(17) {
                for (object, id) in self.scene.objects.iter().zip(&self.objects) {
                    if let Motion::Driven(twist) = object.motion {
                        let turn = glam::DQuat::from_scaled_axis(twist.angular * now);
                        let place = object.start.translation + twist.linear * now;
                        self.world.drive(*id, Pose::new(turn * object.start.rotation, place), twist);
                    }
                }
            }
            let probes: Vec<_> = paths.iter().flatten().map(|path| ProbeState::at(path.pose(now))).collect();
            let before = allocations_of_this_thread();
            self.world.step(&probes, DT, &NoClock);
            assert_eq!(allocations_of_this_thread(), before, "tick {} allocates memory", self.ticks);
            assert_eq!(self.world.counters().reset, 0, "tick {}", self.ticks);
            self.ticks += 1;
        }
    }

    fn place(&self, object: usize) -> DVec3 {
        self.world.pose(self.objects[object]).translation
    }
}

#[test]
fn pushed_stack_does_not_fall() {
    let mut stage = Stage::new("stack");
    stage.run_until(0.9);
    let rested = [0, 1, 2].map(|k| stage.place(k));
    stage.run_until(3.2);
    let pushed = [0, 1, 2].map(|k| stage.place(k) - rested[k]);
    assert!(pushed[2].x > 5e-3 && pushed[0].length() < 1e-3, "{pushed:?}");
    assert!(pushed.iter().all(|by| by.z.abs() < 1e-4), "{pushed:?}");
    stage.run_until(6.2);
    assert!(stage.place(0).x - rested[0].x > 2e-3, "{}", stage.place(0));
}

#[test]
fn drawer_slides_through_its_frame() {
    let mut stage = Stage::new("drawer-slides");
    stage.run_until(0.9);
    let begin = stage.place(0);
    stage.run_until(3.6);
    let pushed = stage.place(0);
    assert!(pushed.x - begin.x > 8e-3, "{begin} to {pushed}");
    stage.run_until(10.0);
    let back = stage.place(0);
    assert!(pushed.x - back.x > 5e-3, "{pushed} to {back}");
    // The play is 0.3 mm.
    assert!((back - DVec3::X * back.x).length() < 0.5e-3, "{back}");
}

#[test]
fn turntable_carries_parts_and_finger_blocks_them() {
    let mut stage = Stage::new("conveyor");
    stage.run_until(1.0);
    let angle = |place: DVec3| place.y.atan2(place.x);
    let turned = angle(stage.place(1)) - 0.9;
    // The turntable turns by 0.8 rad in a second. The part turns less, because it must accelerate.
    assert!((0.5..0.85).contains(&turned), "{turned} rad in a second");
    stage.run_until(7.0);
    for part in 1..5 {
        let place = stage.place(part);
        assert!(place.truncate().length() < 0.11, "part {part} at {place}");
    }
}

#[test]
fn swept_parts_stay_in_the_tray() {
    let mut stage = Stage::new("tray");
    let begin: Vec<_> = (1..21).map(|k| stage.place(k)).collect();
    stage.run_until(12.0);
    let mut moved = 0;
    for (k, begin) in begin.iter().enumerate() {
        let place = stage.place(k + 1);
        let within = place.x.abs() < 0.08 && place.y.abs() < 0.06 && (2e-3..0.03).contains(&place.z);
        assert!(within, "part {k} at {place}");
        moved += u32::from(place.distance(*begin) > 5e-3);
        let Twist { linear, .. } = stage.world.twist(stage.objects[k + 1]);
        assert!(linear.length() < 0.5, "part {k} flies at {linear}");
    }
    assert!(moved >= 8, "{moved} parts were moved");
}

#[test]
fn two_fingers_put_the_nut_on_its_bolt() {
    let mut stage = Stage::new("nut-table");
    stage.run_until(1.9);
    let begin = stage.place(1);
    stage.run_until(4.0);
    let lifted = stage.place(1);
    assert!(lifted.z - begin.z > 0.015, "{begin} to {lifted}");
    stage.run_until(8.0);
    let (bolt, nut) = (stage.place(0), stage.place(1));
    assert!((nut - bolt).truncate().length() < 2e-3 && nut.z > begin.z + 0.01, "bolt {bolt}, nut {nut}");
}

/// Compares the step times of two worlds. The first world has three tools that each press on an
/// object. The second world has fifty objects and four tools, of which three press on an object.
#[test]
#[ignore = "figures for the record: cost of bodies without contact"]
#[expect(clippy::print_stdout, reason = "figures are for reading")]
fn cost_of_fifty_objects_without_contact() {
    let cube = body(&palpus_scenes::shape::cuboid(DVec3::splat(0.012)));
    let ball = body(&palpus_scenes::shape::sphere(0.008, 2));
    let settings = Settings {
        contact_tolerance: 0.5e-3,
        limits: LIMITS,
        stiffness: VirtualCoupling::contact_stiffness(&LIMITS, 0.5e-3).expect("a finite force limit"),
        coupling: Some(VirtualCoupling::tuned(&LIMITS, DT, 0.5e-3)),
        ..Settings::default()
    };
    let place = |k: u32| DVec3::new(0.04 * f64::from(k % 10), 0.04 * f64::from(k / 10), 0.0);
    let world = |objects: &[u32], tools: u32| {
        let mut world = World::new(settings).expect("valid settings");
        for &k in objects {
            world.add(Object::fixed(cube.clone(), Pose::from_translation(place(k)))).expect("a valid pose");
        }
        (0..tools).for_each(|_| _ = world.add_tool(ball.clone(), settings).expect("valid settings"));
        world
    };
    let pressed = [0, 25, 49];
    let probes = |tools: usize, t: f64| -> Vec<ProbeState> {
        let rub = DVec3::new((9.0 * t).sin(), (7.0 * t).cos(), 0.0) * 2e-3;
        let above = |k: usize| pressed.get(k).map_or(DVec3::Z * 0.2, |&k| place(k) + rub + DVec3::Z * 0.0135);
        (0..tools).map(|k| ProbeState::at(Pose::from_translation(above(k)))).collect()
    };
    let median = |world: &mut World, tools: usize| {
        let mut times: Vec<f64> = (0..4000)
            .map(|k| {
                let probes = probes(tools, f64::from(k) * DT);
                let begin = std::time::Instant::now();
                world.step(&probes, DT, &NoClock);
                begin.elapsed().as_secs_f64() * 1e6
            })
            .collect();
        assert!(world.counters().touching == 3, "{:?}", world.counters());
        palpus::algebra::quantile(&mut times, 0.5).expect("at least one time")
    };
    let all: Vec<u32> = (0..50).collect();
    let (mut three, mut many) = (world(&pressed, 3), world(&all, 4));
    for round in 0..3 {
        let (alone, among) = (median(&mut three, 3), median(&mut many, 4));
        println!(
            "round {round}: three pairs {alone:.1} µs, with fifty objects {among:.1} µs: {:.2} times",
            among / alone
        );
    }
}
