//! The scenes with bodies that nobody holds: what a scripted hand does to them.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::{NoClock, Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::force::FrictionSettings;
use palpus::render::{BodyId, Limits, Object, ProbeState, Settings, VirtualCoupling, World};
use palpus_scenes::{Motion, Scene};

const DT: f64 = 1e-3;
const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };

/// A built-in scene in a world of its own, its tools where the scripted hands are.
struct Stage {
    scene: Scene,
    world: World,
    objects: Vec<BodyId>,
    ticks: u32,
}

fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("a sound shape"))
}

impl Stage {
    fn new(name: &str) -> Self {
        let scene = palpus_scenes::scene(name).expect("a scene of that name");
        let stiffness = VirtualCoupling::contact_stiffness(&LIMITS, scene.contact.tolerance).expect("limits");
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
        let mut world = World::new(settings).expect("settings in range");
        world.set_gravity(scene.gravity);
        world.add(Object::fixed(body(&scene.environment), Pose::IDENTITY)).expect("a pose");
        let mut shapes = HashMap::new();
        let mut objects = Vec::new();
        for object in &scene.objects {
            let shape = shapes.entry(Arc::as_ptr(&object.shape)).or_insert_with(|| body(&object.shape)).clone();
            let object = match object.motion {
                Motion::Fixed => Object::fixed(shape, object.start),
                Motion::Driven(_) => Object::driven(shape, object.start),
                Motion::Free(density) => Object::free(shape, object.start, density),
            };
            objects.push(world.add(object).expect("a pose and a density"));
        }
        let probes = [Some(&scene.probe), scene.second.as_ref().map(|second| &second.probe)];
        for probe in probes.into_iter().flatten() {
            world.add_tool(body(probe), settings).expect("settings in range");
        }
        Self { scene, world, objects, ticks: 0 }
    }

    /// Goes on until `time` (s).
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
            self.world.step(&probes, DT, &NoClock);
            assert_eq!(self.world.counters().reset, 0, "tick {}", self.ticks);
            self.ticks += 1;
        }
    }

    fn place(&self, object: usize) -> DVec3 {
        self.world.pose(self.objects[object]).translation
    }
}

#[test]
fn a_stack_is_pushed_over_its_lower_blocks_and_stays_up() {
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
fn a_loose_drawer_goes_through_its_frame_and_keeps_to_it() {
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
fn a_turntable_carries_its_parts_and_a_finger_holds_them_up() {
    let mut stage = Stage::new("conveyor");
    stage.run_until(1.0);
    let angle = |place: DVec3| place.y.atan2(place.x);
    let turned = angle(stage.place(1)) - 0.9;
    // 0.8 rad/s, less what it took to get going.
    assert!((0.5..0.85).contains(&turned), "{turned} rad in a second");
    stage.run_until(7.0);
    for part in 1..5 {
        let place = stage.place(part);
        assert!(place.truncate().length() < 0.11, "part {part} at {place}");
    }
}

#[test]
fn twenty_parts_are_swept_about_and_stay_in_the_tray() {
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
fn two_fingers_set_a_nut_on_its_bolt() {
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
