//! Tests that a tool that is thrown at a thin body does not pass through the body.

mod bodies;

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Random};
use palpus::body::PolygonSoup;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus::render::{Limits, Object, ProbeState, Settings, World};
use palpus_device::{
    Cuts, DeviceState, HAND_PRESETS, HandImpedance, Servo, ServoOptions, ServoTick, SimulatedDevice,
    SimulationSettings, StepOutcome, Timing,
};
use palpus_scenes::shape::cuboid;

const TICK: f64 = 1e-3;
const SEED: u64 = 0x7480;
/// Time until the chain is engaged, s.
const QUIET: f64 = 1.5;
/// Time of a throw, with the way to its start and back, s.
const ROUND: f64 = 0.7;
/// Distance from the start of a throw to the middle of the sheet, m.
const RUN_UP: f64 = 0.03;
/// Depth that a corner or edge of the block can reach in a hole of 10 mm, with a margin, m.
const HOLE_DEPTH: f64 = 5.5e-3;

/// One throw: point on the sheet (m), direction, orientation and speed (m/s).
#[derive(Clone, Copy)]
struct Throw {
    at: DVec3,
    along: DVec3,
    rotation: DQuat,
    speed: f64,
}

impl Throw {
    fn random(random: &mut Random) -> Self {
        let tilt = random.between(0.0, 0.9);
        let around = random.between(0.0, std::f64::consts::TAU);
        Self {
            at: DVec3::new(random.between(-0.03, 0.03), random.between(-0.03, 0.03), 0.0),
            along: -DVec3::new(tilt.sin() * around.cos(), tilt.sin() * around.sin(), tilt.cos()),
            rotation: DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0)),
            speed: random.between(0.5, 2.0),
        }
    }

    /// Returns the intended pose `way` m behind the sheet.
    fn pose(&self, way: f64) -> Pose {
        Pose::new(self.rotation, self.at + self.along * way)
    }

    /// Returns the intended pose `time` s after the start of the throw.
    fn intent(&self, time: f64) -> Pose {
        let strike = 2.0 * RUN_UP / self.speed;
        let back = 0.2;
        self.pose(match time {
            _ if time < strike => self.speed * time - RUN_UP,
            _ if time < strike + 0.05 => RUN_UP,
            _ => RUN_UP - 2.0 * RUN_UP * ((time - strike - 0.05) / back).min(1.0),
        })
    }
}

/// Returns the intent for all throws, with smooth paths between them.
fn intent(throws: Arc<[Throw]>) -> impl Fn(f64) -> Pose {
    move |time: f64| {
        let k = (((time - QUIET) / ROUND).floor().max(0.0) as usize).min(throws.len() - 1);
        let since = time - QUIET - ROUND * k as f64;
        let before = if k == 0 { throws[0] } else { throws[k - 1] };
        let share = (since / 0.25).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        if since >= 0.25 {
            return throws[k].intent(since - 0.25);
        }
        let [from, to] = [before, throws[k]].map(|throw| throw.pose(-RUN_UP));
        Pose::new(from.rotation.slerp(to.rotation, share), from.translation.lerp(to.translation, share))
    }
}

/// Returns the targets of the throws, and the largest depth below z = 0 that a point of the tool
/// may reach, m.
fn targets() -> [(&'static str, PolygonSoup, f64); 5] {
    // The sheet's upper face is at z = 0, as for the other targets.
    let mut sheet = cuboid(DVec3::new(0.2, 0.2, 5e-4));
    sheet.vertices.iter_mut().for_each(|vertex| vertex.z -= 2.5e-4);
    let mut open = PolygonSoup::new();
    let mut holed = PolygonSoup::new();
    let cells = 20;
    for (soup, hole) in [(&mut open, false), (&mut holed, true)] {
        for i in 0..=cells {
            for j in 0..=cells {
                soup.vertices.push(DVec3::new(0.01 * f64::from(i) - 0.1, 0.01 * f64::from(j) - 0.1, 0.0));
            }
        }
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            if hole && i % 3 == 1 && j % 3 == 1 {
                continue;
            }
            let corner = |i: i32, j: i32| (i * (cells + 1) + j) as u32;
            soup.push_face(&[corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]);
        }
    }
    [
        ("a sheet of 0.5 mm", sheet, 1e-4),
        ("the back of an open sheet", reversed(&open), 1e-4),
        ("the back of an open sheet with holes", reversed(&holed), HOLE_DEPTH),
        ("an open sheet", open, 1e-4),
        ("an open sheet with holes", holed, HOLE_DEPTH),
    ]
}

/// Returns the surface with its other side outward.
fn reversed(soup: &PolygonSoup) -> PolygonSoup {
    let mut other = PolygonSoup { vertices: soup.vertices.clone(), ..PolygonSoup::new() };
    for f in 0..soup.face_count() {
        other.push_face(&soup.face(f).iter().rev().copied().collect::<Vec<u32>>());
    }
    other
}

/// Throws a block `count` times at `soup`.
fn thrown(what: &str, soup: &PolygonSoup, depth: f64, hand: HandImpedance, count: usize, random: &mut Random) {
    let tool_body = body(&cuboid(DVec3::new(0.014, 0.018, 0.02)));
    let throws: Arc<[Throw]> = (0..count).map(|_| Throw::random(random)).collect();
    let settings = SimulationSettings { hand, ..SimulationSettings::default() };
    let limits = Limits { force: settings.spec.force_max, torque: settings.spec.torque_max };
    let peak = limits.force;
    let mut device = SimulatedDevice::new(settings, intent(throws.clone())).expect("the settings are valid");
    let settings = Settings::coupled(limits, TICK, 2e-4);
    let mut world = World::new(settings).expect("the settings are valid");
    world.add(Object::fixed(body(soup), Pose::IDENTITY)).expect("the body is added");
    let tool = world.add_tool(tool_body.clone(), settings).expect("the tool is added");
    let duration = Some(QUIET + ROUND * count as f64);
    let mut servo = Servo::new(ServoOptions { timing: Timing::Simulated, duration, ..ServoOptions::default() })
        .expect("the options are valid");
    let seen = RefCell::new((Cuts::NONE, DVec3::ZERO));
    let mut lowest: f64 = 0.0;
    servo.run(
        &mut device,
        |state: &DeviceState, dt| {
            world.step(&[ProbeState { pose_ba: state.pose, twist: state.twist }], dt, &NoClock);
            let pose = world.pose(world.body_of(tool));
            lowest = tool_body.mesh().vertices().iter().map(|&v| pose.point(v).z).fold(lowest, f64::min);
            StepOutcome::of(world.tick(tool).commanded)
        },
        &mut |tick: &ServoTick, (): &()| {
            let mut seen = seen.borrow_mut();
            let change = tick.wrench.force.distance(seen.1);
            assert!(change <= 0.5 * peak * 1.001, "{what}: a step of {change} N");
            *seen = (seen.0.or(tick.cuts), tick.wrench.force);
        },
        &AtomicBool::new(false),
    );
    let cuts = seen.into_inner().0;
    assert!(lowest > -depth, "{what}: {lowest} m, seed {SEED:#x}");
    assert!(!cuts.is_fault(), "{what}: {cuts:?}, seed {SEED:#x}");
}

/// Makes `count` throws for each hand and target.
fn all(count: usize) {
    let mut random = Random::new(SEED);
    for (what, soup, depth) in &targets() {
        for (name, hand) in HAND_PRESETS {
            if hand.stiffness > 0.0 {
                thrown(&format!("{what}, {name} hand"), soup, *depth, hand, count, &mut random);
            }
        }
    }
}

#[test]
fn nothing_passes_through_a_thin_body() {
    all(20);
}

#[test]
#[ignore = "long: a hundred thousand throws, half an hour"]
fn nothing_passes_through_a_thin_body_in_many_throws() {
    all(100_000 / 20);
}

/// The witness point of a corner lies near the sides of the block that meet at this corner. These
/// sides must not hide the sheet above the corner.
#[test]
fn corner_below_a_holed_sheet_is_pushed_back() {
    let [.., (_, soup, _)] = targets();
    let settings = QuerySettings { tolerance: 2e-4, ..QuerySettings::default() };
    let block = body(&cuboid(DVec3::new(0.014, 0.018, 0.02)));
    let mut query = ContactQuery::new(block.clone(), body(&soup), settings);
    let mut random = Random::new(SEED);
    for _ in 0..2000 {
        // The block is nearly flat, with one corner lowest, above a strip without holes.
        let axis = DVec3::new(random.signed(), random.signed(), 0.0).normalize_or(DVec3::X);
        let rotation =
            DQuat::from_axis_angle(axis, random.between(0.02, 0.2)) * DQuat::from_rotation_z(random.between(0.0, 6.0));
        let corner = block.mesh().vertices().iter().map(|&v| rotation * v).min_by(|p, q| p.z.total_cmp(&q.z));
        let depth = random.between(2e-4, 1e-3);
        let at = DVec3::new(random.between(-0.03, 0.03), random.between(0.011, 0.029), -depth);
        let pose = Pose::new(rotation, at - corner.unwrap_or_default());
        query.clear();
        let contacts = query.contacts(&pose);
        let pushed = contacts.iter().any(|c| c.normal.z > 0.98 && c.separation < -0.8 * depth);
        assert!(pushed, "{depth} m deep at {pose:?}: {contacts:?}, seed {SEED:#x}");
    }
}
