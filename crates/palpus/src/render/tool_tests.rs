//! Compares the tool with known results, and with the same equations in smaller steps.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::{Clustering, Limits, ProbeState, Renderer, Settings, VirtualCoupling};
use crate::algebra::{NoClock, Pose, Twist};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
use crate::force::FrictionSettings;

const DT: f64 = 1e-3;
const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };
/// The box's half sizes, m. The origin of its frame and its grip are in its middle.
const HALF: DVec3 = DVec3::new(0.03, 0.02, 0.015);

#[test]
fn tool_that_was_held_returns_with_a_bounded_change_of_the_force() {
    let coupling = VirtualCoupling::tuned(&LIMITS, DT, 1e-3);
    let gain = coupling.release(&LIMITS, DT);
    let change = gain * (coupling.stiffness + coupling.damping / DT);
    assert!(change > 0.0 && change < 0.05 * LIMITS.force, "{change}");
    // A device that gives no force does not hold its tool back.
    let none = Limits { force: 0.0, ..LIMITS };
    assert_eq!(VirtualCoupling::tuned(&none, DT, 1e-3).release(&none, DT), f64::INFINITY);
}

fn cuboid(low: DVec3, high: DVec3) -> Arc<Body> {
    let corner = |k: u32| DVec3::select(glam::BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0), high, low);
    let mut soup = PolygonSoup::new();
    soup.vertices.extend((0..8).map(corner));
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        soup.push_face(&face);
    }
    let (mesh, _) = Mesh::from_soup(&soup).unwrap();
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

fn block() -> Arc<Body> {
    cuboid(-HALF, HALF)
}

/// Returns a floor whose top is z = 0.
fn floor() -> Arc<Body> {
    cuboid(DVec3::new(-0.2, -0.2, -0.05), DVec3::new(0.2, 0.2, 0.0))
}

fn coupled(change: impl FnOnce(&mut Settings)) -> Renderer {
    let block = block();
    let mut settings = Settings {
        limits: LIMITS,
        stiffness: 5000.0,
        coupling: Some(VirtualCoupling::tuned(&LIMITS, DT, 1e-3)),
        ..Settings::default()
    };
    change(&mut settings);
    Renderer::new(block, floor(), settings).unwrap()
}

fn at(pose: Pose) -> ProbeState {
    ProbeState::at(pose)
}

fn above(height: f64) -> Pose {
    Pose::from_translation(DVec3::Z * (HALF.z + height))
}

#[test]
fn force_in_free_space_is_zero() {
    let mut renderer = coupled(|_| ());
    let pose = Pose::new(DQuat::from_rotation_x(0.3), DVec3::new(0.01, -0.02, 0.1));
    for _ in 0..10 {
        let tick = renderer.step(&at(pose), DT, &NoClock);
        assert_eq!(tick.tool_ba, pose);
        assert!(tick.commanded.force.length() < 1e-12 && tick.commanded.torque.length() < 1e-12);
    }
    // After a motion, the tool comes to rest within 1 mN and 0.1 mN·m.
    for k in 0..300 {
        let s = f64::from(k) / 300.0;
        let moved = Pose { translation: pose.translation + DVec3::X * (0.05 * s), ..pose };
        renderer.step(
            &ProbeState { pose_ba: moved, twist: Twist { linear: DVec3::X * 0.167, ..Twist::default() } },
            DT,
            &NoClock,
        );
    }
    let moved = Pose { translation: pose.translation + DVec3::X * 0.05, ..pose };
    for _ in 0..300 {
        renderer.step(&at(moved), DT, &NoClock);
    }
    let felt = renderer.tick().commanded;
    assert!(felt.force.length() < 1e-6 && felt.torque.length() < 1e-7, "{felt:?}");
}

#[test]
fn springs_in_series_balance_on_a_floor() {
    for (mass, stiffness) in [(None, 5000.0), (Some(0.0), 5000.0), (None, 1e5), (Some(0.5), 5000.0)] {
        let mut renderer = coupled(|settings| {
            settings.stiffness = stiffness;
            if let (Some(mass), Some(coupling)) = (mass, &mut settings.coupling) {
                coupling.mass = mass;
            }
        });
        let coupling = renderer.settings().coupling.unwrap();
        renderer.step(&at(above(2e-3)), DT, &NoClock);
        for _ in 0..3000 {
            renderer.step(&at(above(-3e-3)), DT, &NoClock);
        }
        let tick = renderer.tick();
        // The contact begins one contact offset above the floor.
        let row = coupling.stiffness * stiffness / (coupling.stiffness + stiffness);
        let expected = row * (3e-3 + coupling.contact_offset);
        let felt = tick.commanded;
        assert!((felt.force - DVec3::Z * expected).length() < 1e-6 * expected, "{mass:?} {stiffness}: {felt:?}");
        assert!(felt.torque.length() < 1e-6, "{felt:?}");
        assert_eq!((tick.counters.tool.unsettled, tick.counters.tool.reset), (0, 0));
    }
}

#[test]
fn strong_hand_does_not_press_the_tool_in() {
    let mut renderer = coupled(|settings| {
        settings.stiffness = VirtualCoupling::contact_stiffness(&LIMITS, settings.contact_tolerance).unwrap();
    });
    renderer.step(&at(above(2e-3)), DT, &NoClock);
    for k in 0..2000 {
        let depth = (f64::from(k) * 2e-5).min(0.03);
        let tick = renderer.step(&at(above(-depth)), DT, &NoClock);
        // At 8.5 N the tool sinks in by half the contact offset. The tool sinks in farther only
        // while it is still moving.
        assert!(tick.contacts.is_empty() || tick.separation() > 0.04e-3, "tick {k}: {}", tick.separation());
        assert!(tick.commanded.force.length() <= LIMITS.force);
    }
}

#[test]
fn one_step_nearly_equals_many_small_steps() {
    // The same equations with a thousandth of the step: backward Euler converges with first order.
    let device = |time: f64| {
        let swing = (TAU * 3.0 * time).sin();
        let pose = Pose::new(
            DQuat::from_scaled_axis(DVec3::new(0.2, 0.1, -0.3) * swing),
            DVec3::new(0.01 * swing, 0.0, HALF.z + 0.02 - 0.022 * (TAU * time).sin()),
        );
        at(pose)
    };
    let tool_at = |steps_per_tick: u32| {
        let mut renderer = coupled(|settings| {
            settings.stiffness = 300.0;
            settings.clustering = Clustering::Smooth;
        });
        let h = DT / f64::from(steps_per_tick);
        for k in 0..200 * steps_per_tick {
            renderer.step(&device(f64::from(k) * h), h, &NoClock);
        }
        (renderer.tick().tool_ba, renderer.tick().computed)
    };
    let (fine, fine_felt) = tool_at(64);
    let error = |steps| {
        let (pose, felt) = tool_at(steps);
        let turn = crate::algebra::rotation_between(fine.rotation, pose.rotation).length();
        ((pose.translation - fine.translation).length() + HALF.x * turn, (felt.force - fine_felt.force).length())
    };
    let (coarse, middle) = (error(1), error(4));
    assert!(coarse.0 < 1e-3 && middle.0 < 0.4 * coarse.0, "{coarse:?} {middle:?}");
    assert!(coarse.1 < 0.5 && middle.1 < 0.4 * coarse.1, "{coarse:?} {middle:?}");
}

#[test]
fn friction_sticks_in_its_cone_and_slides_at_its_limit() {
    let friction = FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.4, tangential_stiffness: 5000.0 };
    let mut renderer = coupled(|settings| settings.friction = Some(friction));
    let pressed = |x: f64| at(Pose { translation: above(-3e-3).translation + DVec3::X * x, ..Pose::IDENTITY });
    renderer.step(&at(above(2e-3)), DT, &NoClock);
    for _ in 0..300 {
        renderer.step(&pressed(0.0), DT, &NoClock);
    }
    // 1 mm sideways: 5000 N/m in series with 1000 N/m gives 0.83 N at a load of 3.3 N. So the block
    // sticks and leans a little.
    for k in 0..300 {
        renderer.step(&pressed((f64::from(k) * 1e-5).min(1e-3)), DT, &NoClock);
    }
    let held = renderer.tick().commanded.force;
    assert!(held.x < -0.5 && held.x > -1e-3 * 5000.0 * 1000.0 / 6000.0 && held.z > 2.5, "{held}");
    assert_eq!(renderer.tick().counters.friction.sliding, 0);
    // 20 mm sideways: the block slides with the dynamic coefficient.
    let mut ratios = Vec::new();
    for k in 0..1200 {
        let x = 1e-3 + (f64::from(k) * 2e-5).min(0.02);
        let tick = renderer.step(&pressed(x), DT, &NoClock);
        if (500..900).contains(&k) {
            ratios.push(-tick.commanded.force.x / tick.commanded.force.z);
        }
    }
    let (low, high) = ratios.iter().fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
    assert!(low > 0.38 && high < 0.52, "{low} to {high}");
}

#[test]
fn tilting_through_flat_is_continuous() {
    // The torque's change per tick is at most a few times the coupling's torque for the motion of
    // one tick.
    let mut renderer = coupled(|settings| settings.clustering = Clustering::Smooth);
    let coupling = renderer.settings().coupling.unwrap();
    let rate = 0.5;
    let pose = |k: u32| {
        let angle = 0.15 * (f64::from(k) * DT * rate / 0.15).sin();
        let lowest = HALF.x * angle.abs().sin() + HALF.z * angle.cos();
        Pose::new(DQuat::from_rotation_y(angle), DVec3::Z * (lowest - 2e-3))
    };
    renderer.step(&at(above(2e-3)), DT, &NoClock);
    for _ in 0..500 {
        renderer.step(&at(pose(0)), DT, &NoClock);
    }
    let mut last = renderer.tick().commanded;
    for k in 0..4000 {
        let felt = renderer.step(&at(pose(k)), DT, &NoClock).commanded;
        let turn = rate * DT;
        let motion = HALF.x * turn;
        let (force, torque) = ((felt.force - last.force).length(), (felt.torque - last.torque).length());
        assert!(force < 4.0 * coupling.stiffness * motion, "tick {k}: {force} N");
        let most = coupling.angular_stiffness * turn + felt.force.length() * motion;
        assert!(torque < 8.0 * most, "tick {k}: {torque} N·m of {most}");
        last = felt;
    }
}

#[test]
fn nonsense_resets_the_tool_and_is_counted() {
    let mut renderer = coupled(|_| ());
    renderer.step(&at(above(0.01)), DT, &NoClock);
    let far = Pose { translation: DVec3::splat(1e200), ..above(0.0) };
    for dt in [DT, 0.0, f64::NAN, f64::INFINITY, -1.0] {
        let tick = renderer.step(&at(far), dt, &NoClock);
        assert!(tick.commanded.is_finite() && tick.commanded.force.length() <= LIMITS.force, "{dt}");
        assert!(tick.tool_ba.is_valid());
    }
    renderer.clear();
    let tick = renderer.step(&at(above(0.01)), DT, &NoClock);
    assert_eq!(tick.tool_ba, above(0.01));
}

#[test]
fn coupling_follows_the_limits_of_the_device() {
    let of = |force, torque, period| VirtualCoupling::tuned(&Limits { force, torque }, period, 1e-3);
    for limits in [(8.5, 0.188), (3.3, 0.0), (12.0, 0.0), (0.0, 0.0), (f64::INFINITY, f64::INFINITY), (22.0, 0.188)] {
        for period in [1e-4, 1e-3, 2e-3] {
            let coupling = of(limits.0, limits.1, period);
            let settings = Settings { coupling: Some(coupling), contact_tolerance: 1e-3, ..Settings::default() };
            assert_eq!(settings.validate(), Ok(()), "{limits:?} {period}");
            assert_eq!(coupling.mass, 0.0);
        }
    }
    // Slower loops allow a lower stiffness.
    assert!(of(8.5, 0.188, 2e-3).stiffness < of(8.5, 0.188, 1e-3).stiffness);
    let settings =
        Settings { coupling: Some(VirtualCoupling { mass: -1.0, ..of(8.5, 0.1, 1e-3) }), ..Settings::default() };
    assert_eq!(settings.validate().unwrap_err().field, "coupling.mass");
}

#[test]
fn pressed_plate_stays_flat() {
    // 2 N on a plate of 60 mm resist a torque of 60 mN·m before the plate tips over its edge.
    let half = DVec3::new(0.03, 0.03, 0.0025);
    let mut settings =
        Settings { limits: LIMITS, coupling: Some(VirtualCoupling::tuned(&LIMITS, DT, 1e-3)), ..Settings::default() };
    settings.stiffness = VirtualCoupling::contact_stiffness(&LIMITS, settings.contact_tolerance).unwrap();
    let coupling = settings.coupling.unwrap();
    let mut renderer = Renderer::new(cuboid(-half, half), floor(), settings).unwrap();
    renderer.step(&at(Pose::from_translation(DVec3::Z * 0.005)), DT, &NoClock);
    let low = half.z - 2.0 / coupling.stiffness;
    for torque in [0.0, 0.02, 0.04, 0.057] {
        for axis in [DVec3::X, DVec3::Y] {
            let turn = DQuat::from_axis_angle(axis, torque / coupling.angular_stiffness);
            for _ in 0..400 {
                renderer.step(&at(Pose::new(turn, DVec3::Z * low)), DT, &NoClock);
            }
            let tick = renderer.tick();
            let tilt = tick.tool_ba.rotation.angle_between(DQuat::IDENTITY).to_degrees();
            assert!((tick.commanded.force.z - 2.0).abs() < 0.1, "{torque}: {:?}", tick.commanded);
            assert!((tick.commanded.torque.dot(axis) + torque).abs() < 0.02 * torque + 1e-6, "{:?}", tick.commanded);
            assert!(tilt < 0.1, "{torque} N·m about {axis}: {tilt}°");
        }
    }
}
