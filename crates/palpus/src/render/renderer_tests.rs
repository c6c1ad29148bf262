//! Tests whole steps on small bodies with known results.

use std::cell::Cell;
use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::{Limits, ProbeState, Renderer, Settings, WorkLimit, World};
use crate::algebra::tolerance::PACE_LEAST_WORK;
use crate::algebra::{Clock, NoClock, Pose, Twist, Wrench};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
use crate::force::testing::Random;
use crate::force::{FrictionSettings, ShadingSettings};

const SEED: u64 = 0x7E4D;
pub(super) const DT: f64 = 1e-3;
const UNLIMITED: Limits = Limits { force: f64::INFINITY, torque: f64::INFINITY };

pub(super) fn body(soup: &PolygonSoup) -> Arc<Body> {
    let (mesh, _) = Mesh::from_soup(soup).unwrap();
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

pub(super) fn cuboid(low: DVec3, high: DVec3) -> Arc<Body> {
    let corner = |k: u32| DVec3::select(glam::BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0), high, low);
    let mut soup = PolygonSoup::new();
    soup.vertices.extend((0..8).map(corner));
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        soup.push_face(&face);
    }
    body(&soup)
}

/// Returns a closed prism of `sides` sides around the z axis.
pub(super) fn drum(radius: f64, half_height: f64, sides: u32) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    for k in 0..sides {
        let angle = TAU * f64::from(k) / f64::from(sides);
        let rim = DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0);
        soup.vertices.extend([rim - DVec3::Z * half_height, rim + DVec3::Z * half_height]);
        let next = (k + 1) % sides;
        soup.push_face(&[2 * k, 2 * next, 2 * next + 1, 2 * k + 1]);
    }
    soup.push_face(&(0..sides).rev().map(|k| 2 * k).collect::<Vec<_>>());
    soup.push_face(&(0..sides).map(|k| 2 * k + 1).collect::<Vec<_>>());
    body(&soup)
}

/// Returns a cube of 20 mm on a floor whose top is z = 0. The origin of the cube's frame is the
/// middle of its bottom.
pub(super) fn cube_on_floor(settings: Settings) -> Renderer {
    let cube = cuboid(DVec3::new(-0.01, -0.01, 0.0), DVec3::new(0.01, 0.01, 0.02));
    let floor = cuboid(DVec3::new(-0.1, -0.1, -0.05), DVec3::new(0.1, 0.1, 0.0));
    Renderer::new(cube, floor, settings).unwrap()
}

pub(super) fn at(x: f64, z: f64) -> ProbeState {
    ProbeState::at(Pose::from_translation(DVec3::new(x, 0.0, z)))
}

pub(super) fn settings() -> Settings {
    Settings { limits: UNLIMITED, ..Settings::default() }
}

#[test]
fn cube_on_a_floor_is_pushed_up_by_its_engagement() {
    let mut renderer = cube_on_floor(settings());
    for height in [2e-3, 1e-3, 0.9e-3, 0.5e-3, 1e-5, 0.0, -1e-5, -1e-3, -4e-3] {
        let tick = renderer.step(&at(0.0123, height), DT, &NoClock);
        let expected = 800.0 * (1e-3 - height).max(0.0);
        assert!((tick.commanded.force - DVec3::Z * expected).length() < 1e-9, "at {height}: {:?}", tick.commanded);
        // The grip is over the middle of the faces, and all corners of flush faces have the same
        // load.
        assert!(tick.commanded.torque.length() < 1e-9, "at {height}: {:?}", tick.commanded);
        assert_eq!(tick.contacts.len(), if expected > 0.0 { 4 } else { 0 });
        assert_eq!(tick.summary().clusters as usize, tick.forces.clusters.len());
        if expected > 0.0 {
            assert!((tick.separation() - height).abs() < 1e-12);
        }
    }
}

#[test]
fn the_torque_is_about_the_grip() {
    let grip = DVec3::new(0.03, 0.0, 0.1);
    let mut renderer = cube_on_floor(Settings { grip_a: grip, ..settings() });
    let tick = renderer.step(&at(0.0, -1e-3), DT, &NoClock);
    let push = DVec3::Z * 1.6;
    assert!((tick.commanded.torque - (-grip).cross(push)).length() < 1e-9);
    // The torque about the centre of mass is zero, since it is above the middle of the contact.
    assert!(tick.forces.net.on_a.torque.length() < 1e-9);
    assert_eq!(tick.forces.net.on_a.force, -tick.forces.net.on_b.force);
}

#[test]
fn device_state_is_that_of_the_grip() {
    let (grip, turn) = (DVec3::new(0.03, 0.0, 0.1), DQuat::from_rotation_z(0.2));
    let twist = Twist { angular: DVec3::X, linear: DVec3::Y };
    // The cube overlaps the floor by 1 mm and is turned about its grip.
    let held = Pose { rotation: turn, translation: grip - DVec3::Z * 1e-3 };
    let state = ProbeState::of_grip(&held, &twist, grip);
    assert!(state.pose_ba.point(grip).distance(held.translation) < 1e-15);
    assert_eq!((state.pose_ba.rotation, state.twist), (turn, twist));
    let mut renderer = cube_on_floor(Settings { grip_a: grip, ..settings() });
    let tick = renderer.step(&ProbeState::of_grip(&held, &Twist::default(), grip), DT, &NoClock);
    let to_middle = turn * -grip;
    let push = DVec3::Z * 1.6;
    assert!((tick.commanded.force - push).length() < 1e-9, "{}", tick.commanded.force);
    assert!((tick.commanded.torque - to_middle.cross(push)).length() < 1e-9, "{}", tick.commanded.torque);
}

#[test]
fn damping_uses_the_velocity_at_the_contact() {
    let mut renderer = cube_on_floor(Settings { damping: 4.0, ..settings() });
    let mut probe = at(0.0, -1e-3);
    probe.twist = Twist { angular: DVec3::Z * 3.0, linear: DVec3::new(0.5, 0.0, -0.1) };
    let tick = renderer.step(&probe, DT, &NoClock);
    assert!((tick.commanded.force - DVec3::Z * 2.0).length() < 1e-9);
}

#[test]
fn limits_are_kept_and_counted() {
    let limits = Limits { force: 2.0, torque: 0.01 };
    let mut renderer = cube_on_floor(Settings { limits, grip_a: DVec3::X * 0.05, ..settings() });
    let tick = renderer.step(&at(0.0, -9e-3), DT, &NoClock);
    assert!((tick.commanded.force - DVec3::Z * 2.0).length() < 1e-9);
    assert!((tick.commanded.torque.length() - 0.01).abs() < 1e-9);
    assert!((tick.computed.force - DVec3::Z * 8.0).length() < 1e-9);
    assert_eq!((tick.counters.saturated_force, tick.counters.saturated_torque), (1, 1));
}

#[test]
fn invalid_pose_gives_no_force_for_one_step() {
    let mut renderer = cube_on_floor(settings());
    let good = renderer.step(&at(0.0, -1e-3), DT, &NoClock).commanded;
    for bad in [
        Pose::from_translation(DVec3::NAN),
        Pose { rotation: DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), translation: DVec3::ZERO },
        Pose { rotation: DQuat::from_xyzw(f64::INFINITY, 0.0, 0.0, 1.0), translation: DVec3::ZERO },
    ] {
        let tick = renderer.step(&ProbeState::at(bad), DT, &NoClock);
        assert_eq!((tick.commanded, tick.counters.bad_state), (Wrench::ZERO, 1));
        assert!(tick.contacts.is_empty() && tick.forces.clusters.is_empty());
        assert_eq!(renderer.step(&at(0.0, -1e-3), DT, &NoClock).commanded, good);
    }
    let mut restless = at(0.0, -1e-3);
    restless.twist.linear.y = f64::NAN;
    let tick = renderer.step(&restless, DT, &NoClock);
    assert_eq!((tick.commanded, tick.counters.bad_state), (good, 1));
    for far in [1e3, 1e9, 1e150] {
        let tick = renderer.step(&at(far, 0.0), DT, &NoClock);
        assert_eq!(tick.commanded, Wrench::ZERO, "at {far}");
    }
}

#[test]
fn a_dragged_cube_sticks_and_slides() {
    let friction = FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.3, tangential_stiffness: 1000.0 };
    let mut renderer = cube_on_floor(Settings { friction: Some(friction), ..settings() });
    // The normal force is 800 N/m · 2 mm = 1.6 N. The cube sticks up to 0.8 N at 0.8 mm. After
    // another 0.8 mm of sliding, friction is 0.48 N.
    let mut drag = |x: f64| renderer.step(&at(x, -1e-3), DT, &NoClock).commanded.force;
    assert!((drag(0.0) - DVec3::Z * 1.6).length() < 1e-9);
    assert!((drag(0.7e-3) - DVec3::new(-0.7, 0.0, 1.6)).length() < 1e-9);
    assert!((drag(0.9e-3) - DVec3::new(-0.8, 0.0, 1.6)).length() < 1e-9);
    assert!((drag(3.0e-3) - DVec3::new(-0.76, 0.0, 1.6)).length() < 1e-9);
    assert!((drag(5.0e-3) - DVec3::new(-0.48, 0.0, 1.6)).length() < 1e-9);
    assert!((drag(4.9e-3) - DVec3::new(-0.38, 0.0, 1.6)).length() < 1e-9);
}

/// Returns the largest rotation of the force between steps (rad) while a cube's corner moves around
/// a drum's side.
fn largest_turn(shading: Option<ShadingSettings>) -> f64 {
    let probe = cuboid(DVec3::splat(-0.004), DVec3::splat(0.004));
    let drum = drum(0.02, 0.05, 20);
    let mut renderer = Renderer::new(probe, drum, Settings { shading, ..settings() }).unwrap();
    let corner_outward = DQuat::from_rotation_arc(DVec3::splat(1.0).normalize(), -DVec3::X);
    let mut previous: Option<DVec3> = None;
    let mut most: f64 = 0.0;
    for k in 0..2000 {
        let around = DQuat::from_rotation_z(0.9 * f64::from(k) / 2000.0);
        let pose = Pose::new(around * corner_outward, around * DVec3::X * (0.0197 + 0.004 * 3f64.sqrt()));
        let force = renderer.step(&ProbeState::at(pose), DT, &NoClock).commanded.force;
        let direction = force.normalize();
        most = most.max(previous.map_or(0.0, |previous| previous.distance(direction)));
        previous = Some(direction);
    }
    most
}

#[test]
fn shading_smooths_the_edges_of_a_drum() {
    let bare = largest_turn(None);
    let shading = |crease: f64| Some(ShadingSettings { crease_angle: crease.to_radians(), most_turn: 0.5 });
    let shaded = largest_turn(shading(30.0));
    // Neighbouring faces meet at 18°, which is 0.31 rad.
    assert!(bare > 0.25, "{bare}");
    assert!(shaded < 0.01, "{shaded}");
    // Edges sharper than the crease angle are not smoothed.
    assert!(largest_turn(shading(10.0)) > 0.25);
}

#[test]
fn the_same_steps_give_the_same_bits() {
    let friction = FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.3, tangential_stiffness: 1000.0 };
    let shading = ShadingSettings { crease_angle: 0.6, most_turn: 0.5 };
    let settings = Settings { friction: Some(friction), shading: Some(shading), damping: 1.0, ..Settings::default() };
    let (a, b) = (drum(0.01, 0.02, 12), drum(0.03, 0.01, 24));
    let run = |renderer: &mut Renderer| -> Vec<Wrench> {
        let mut random = Random::new(SEED);
        let mut pose = Pose::new(DQuat::from_rotation_x(0.4), DVec3::new(0.03, 0.01, 0.0));
        (0..300)
            .map(|_| {
                let step = Pose::new(DQuat::from_scaled_axis(random.point(0.02)), random.point(4e-4));
                pose = step * pose;
                let twist = Twist { angular: random.point(1.0), linear: random.point(0.1) };
                let tick = renderer.step(&ProbeState { pose_ba: pose, twist }, DT, &NoClock);
                assert!(tick.commanded.is_finite());
                tick.commanded
            })
            .collect()
    };
    let mut renderer = Renderer::new(a.clone(), b.clone(), settings).unwrap();
    let first = run(&mut renderer);
    assert!(first.iter().filter(|wrench| wrench.force != DVec3::ZERO).count() > 50);
    assert_eq!(first, run(&mut Renderer::new(a, b, settings).unwrap()));
    renderer.clear();
    assert_eq!(first, run(&mut renderer));
}

/// A clock on which each reading takes the same time, ns.
struct Ticking(Cell<u64>, u64);

impl Clock for Ticking {
    fn now_ns(&self) -> u64 {
        self.0.set(self.0.get() + self.1);
        self.0.get()
    }
}

#[test]
fn step_with_a_running_clock_keeps_to_the_least_time_budget() {
    let block = cuboid(DVec3::ZERO, DVec3::splat(0.02));
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, DT, 1e-4);
    let mut world = World::new(settings).unwrap();
    let (fast, slow) = (Ticking(Cell::new(0), 10), Ticking(Cell::new(0), 1_000_000));
    let tool = world.add_tool(block.clone(), Settings { time_budget: None, ..settings }).unwrap();
    let allowed = |world: &mut World, clock: &dyn Clock| {
        world.step(&[at(0.0, 0.0), at(0.1, 0.0)], DT, &clock);
        world.tick(tool).work_allowed
    };
    assert_eq!(allowed(&mut world, &fast), None);
    world.set_tool_settings(tool, &settings).unwrap();
    assert_eq!(allowed(&mut world, &NoClock), None);
    let whole = allowed(&mut world, &fast).unwrap();
    world.add_tool(block, Settings { time_budget: Some(300_000), ..settings }).unwrap();
    let half = allowed(&mut world, &fast).unwrap();
    assert!((4 * whole / 10..6 * whole / 10).contains(&half), "{half} of {whole}");
    // On the slow clock, the rest of the step leaves no time for queries.
    (0..100).for_each(|_| assert!(allowed(&mut world, &slow).is_some()));
    assert_eq!(allowed(&mut world, &slow), Some(PACE_LEAST_WORK));
    for (limit, expected) in [(WorkLimit::Units(70), Some(70)), (WorkLimit::Unlimited, None)] {
        world.allow(limit);
        assert_eq!(allowed(&mut world, &slow), expected);
    }
    world.allow(WorkLimit::TimeBudget);
    assert_eq!(allowed(&mut world, &NoClock), None);
}

#[test]
fn caller_clock_times_the_stages() {
    let mut renderer = cube_on_floor(settings());
    let clock = Ticking(Cell::new(0), 10);
    let times = renderer.step(&at(0.0, 0.0), DT, &clock).times;
    assert!(times.query > 0 && times.depth > 0 && times.force > 0 && times.couple > 0 && times.saturate > 0);
    assert!(times.total >= times.query + times.depth + times.force + times.couple + times.saturate);
    assert_eq!(renderer.step(&at(0.0, 0.0), DT, &NoClock).times, Default::default());
    assert_eq!(renderer.tick().index, 1);
}
