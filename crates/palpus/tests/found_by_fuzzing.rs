//! Regression tests for cases that fuzzing found. Each test is named by the symptom.

use std::cell::Cell;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Clock, NoClock, Pose, Twist, Wrench};
use palpus::body::{Body, Feature, FeaturePair, convex_hull};
use palpus::collision::{Proximity, march};
use palpus::render::{Limits, Object, ProbeState, Renderer, Saturation, Settings, WorkLimit, World, saturate};

/// A clock that starts at a large time.
struct Late(Cell<u64>);

impl Clock for Late {
    fn now_ns(&self) -> u64 {
        self.0.set(self.0.get() + 10);
        self.0.get()
    }
}

/// Returns a cube with sides of 2 cm.
fn cube() -> Arc<Body> {
    let corner = |k: u32| 0.02 * DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
    Arc::new(Body::from_convex(&(0..8).map(corner).collect::<Vec<_>>()).expect("a cube is a convex body"))
}

/// The end of the work allowance overflowed 64 bits.
#[test]
fn an_unlimited_allowance_is_never_late() {
    let settings = Settings::default();
    let clock = Late(Cell::new(1 << 40));
    let probe = ProbeState::at(Pose::from_translation(DVec3::new(0.0, 0.0, 0.0199)));
    let mut alone = Renderer::new(cube(), cube(), settings).expect("the arguments are valid");
    alone.allow(WorkLimit::Units(u64::MAX));
    let tick = alone.step(&probe, 1e-3, &clock);
    assert!(!tick.is_late() && tick.commanded.force.z > 0.0, "{:?}", tick.commanded);
    let mut world = World::new(settings).expect("the arguments are valid");
    world.add(Object::fixed(cube(), Pose::IDENTITY)).expect("the arguments are valid");
    let [tool, _] = [0, 1].map(|_| world.add_tool(cube(), settings).expect("the arguments are valid"));
    world.allow(WorkLimit::Units(u64::MAX));
    world.step(&[probe, ProbeState::at(Pose::from_translation(DVec3::X))], 1e-3, &clock);
    let tick = world.tick(tool);
    assert!(!tick.is_late() && tick.commanded.force.z > 0.0, "{:?}", tick.commanded);
}

/// For a subnormal limit, a force that was scaled to the limit exceeded it by one unit in the last
/// place.
#[test]
fn subnormal_limits_are_not_exceeded() {
    let limits = Limits { force: 3.259_468_752_411_96e-310, torque: 5e-324 };
    for policy in [Saturation::Separate, Saturation::Joint, Saturation::UnderActuated] {
        for scale in [1e-309, 1.0, 1e200] {
            let given = saturate(Wrench { force: DVec3::splat(scale), torque: DVec3::splat(scale) }, &limits, policy);
            for (v, limit) in [(given.wrench.force, limits.force), (given.wrench.torque, limits.torque)] {
                let largest = v.abs().max_element();
                let length = if largest > 0.0 { (v / largest).length() * largest } else { 0.0 };
                assert!(length <= limit, "{policy:?}, {scale}: {given:?}");
            }
        }
    }
}

/// With extreme tolerances and states, bodies can be in contact at distances whose squares
/// overflow.
#[test]
fn contacts_at_huge_distances_are_finite_or_omitted() {
    for exponent in (20..308).step_by(4) {
        let far = 10f64.powi(exponent);
        let settings = Settings { contact_tolerance: 1e308, cluster_radius: 0.0, ..Settings::default() };
        let mut renderer = Renderer::new(cube(), cube(), settings).expect("the arguments are valid");
        for direction in [DVec3::X, DVec3::new(0.3, -0.8, 0.1), DVec3::splat(-1.0)] {
            let tick = renderer.step(&ProbeState::at(Pose::from_translation(far * direction)), 1e-3, &NoClock);
            assert!(tick.contacts.iter().all(|contact| contact.is_finite()), "{far:e}: {:?}", tick.contacts);
            assert!(tick.commanded.is_finite() && !tick.separation().is_nan());
        }
    }
}

/// A quaternion that has unit length only in single precision scaled the bodies and their normals.
#[test]
fn single_precision_quaternions_keep_normals_unit() {
    let mut renderer = Renderer::new(cube(), cube(), Settings::default()).expect("the arguments are valid");
    for off in [-9e-7, -3e-8, 3e-8, 9e-7] {
        let turned = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.3) * (1.0 + off);
        let pose = Pose { rotation: turned, translation: DVec3::new(0.0, 0.0, 0.0195) };
        let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
        assert!(!tick.contacts.is_empty());
        assert!(
            tick.contacts.iter().all(|contact| (contact.normal.length() - 1.0).abs() < 1e-12),
            "{:?}",
            tick.contacts
        );
    }
}

/// The hull has two vertices very close to each other, and a merged face between them and the
/// support vertex. The march ended at the two vertices, with a distance that was 1 % too large.
#[test]
fn a_march_does_not_end_at_a_very_short_edge() {
    let points = |list: &[[f64; 3]]| list.iter().map(|&p| DVec3::from(p)).collect::<Vec<_>>();
    let a = points(&[
        [-3.125, -3.125, -3.125],
        [-2.5625, -3.125, 0.5],
        [-0.5, -0.5, 2.875],
        [-0.5, 0.5, -0.5],
        [0.5, -0.5, 3.625_000_83],
        [0.5, -0.5, 3.625_000_84],
    ]);
    let b = points(&[
        [-0.5, -0.5, -0.5],
        [-0.5, -0.5, 2.875],
        [-0.5, 0.5, 0.5],
        [0.5, -2.718_75, -3.125],
        [0.5, 0.5, -1.875],
    ]);
    let hull = |points: &[DVec3]| {
        let extent = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        convex_hull(points, 1e-9 * extent)
            .expect("the points have a hull")
            .into_polytope()
            .expect("the hull is a solid")
            .0
    };
    let (a, b) = (hull(&a), hull(&b));
    let pose =
        Pose::from_translation(DVec3::new(-15.863_545_472_809_99, -16.187_291_298_785_706, -2.589_966_607_805_713));
    let place = pose.placement();
    for v in 0..6 {
        let start = FeaturePair { a: Feature::Vertex(v), b: Feature::Vertex(3) };
        let marched = march(&a, &b, &place, start);
        let Proximity::Disjoint(closest) = marched.proximity else { panic!("{marched:?}") };
        assert!((closest.distance - 21.256_145_927_487_49).abs() < 1e-7, "from vertex {v}: {marched:?}");
    }
}

/// The hull has two vertices that differ only by rounding errors. The march ended with a
/// distance that was 2.6 % too large.
#[test]
fn a_march_does_not_end_at_a_duplicate_vertex() {
    let points = |list: &[[f64; 3]]| list.iter().map(|&p| DVec3::from(p)).collect::<Vec<_>>();
    let a = points(&[
        [-3.125, -3.125, -3.125],
        [-3.125, 1.0, 1.0],
        [-2.968_75, 0.5, 0.0],
        [-0.5, -0.5, 2.875],
        [-0.5, 2.625_000_84, 3.625_000_000_084],
        [0.0, 0.0, -1.125],
        [0.3125, 0.093_75, 0.5],
        [2.0, -3.125, 2.718_75],
    ]);
    let b = points(&[
        [-1.343_750_000_000_043, -1.343_750_000_000_047, -1.343_750_000_000_043],
        [-1.343_750_000_000_043, -1.343_750_000_000_043, -1.343_750_000_000_043],
        [-1.343_750_000_000_043, -1.343_750_000_000_043, -0.5],
        [-0.5, -1.343_750_86, 2.1875],
        [-0.5, 0.5, -0.5],
        [0.0, -3.125, 1.0],
        [0.5, -2.968_75, 0.5],
        [1.0, 2.0, -3.125],
        [2.1875, -1.343_750_000_000_043, 0.3125],
        [2.1875, 2.1875, 2.1875],
        [3.624_999_999_999_957, -1.343_750_000_000_043, -1.343_750_000_000_043],
    ]);
    let hull = |points: &[DVec3]| {
        let extent = points.iter().map(|p| p.length()).fold(0.0, f64::max);
        convex_hull(points, 1e-9 * extent)
            .expect("the points have a hull")
            .into_polytope()
            .expect("the hull is a solid")
            .0
    };
    let (a, b) = (hull(&a), hull(&b));
    let turn = DQuat::from_xyzw(
        -0.802_033_161_854_941_7,
        -0.444_202_981_950_429_23,
        0.037_016_915_162_535_774,
        0.397_562_908_359_370_14,
    );
    let place = Pose::new(turn, DVec3::new(0.0, 0.0, -16.514_354_033_720_025)).placement();
    for v in 0..11 {
        let start = FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(v) };
        let Proximity::Disjoint(closest) = march(&a, &b, &place, start).proximity else {
            panic!("the march reports an overlap of disjoint hulls")
        };
        assert!((closest.distance - 11.798_546_764_667_083).abs() < 1e-7, "from vertex {v}: {closest:?}");
    }
}

/// The inverse of the inertia overflowed. Then a body at rest had a NaN velocity, or a rotating
/// body stopped.
#[test]
fn a_free_body_of_any_mass_keeps_its_thrown_twist() {
    let thrown = Twist { angular: DVec3::new(0.1, -0.2, 0.3), linear: DVec3::X };
    for exponent in (-280..=280).step_by(20) {
        let mut world = World::new(Settings::default()).expect("the arguments are valid");
        let object = Object::free_of_mass(cube(), Pose::IDENTITY, 10f64.powi(exponent));
        let body = world.add(object).expect("the mass is finite and positive");
        assert_eq!(world.twist(body), Twist::default(), "1e{exponent} kg");
        assert!(world.throw(body, thrown));
        let Twist { angular, linear } = world.twist(body);
        let off = (angular - thrown.angular).length() + (linear - thrown.linear).length();
        assert!(off < 1e-12, "1e{exponent} kg: {angular}, {linear}");
    }
}

/// A throw with a finite velocity gave an infinite momentum.
#[test]
fn a_throw_with_infinite_momentum_is_rejected() {
    let mut world = World::new(Settings::default()).expect("the arguments are valid");
    let body = world.add(Object::free_of_mass(cube(), Pose::IDENTITY, 1e10)).expect("the arguments are valid");
    assert!(!world.throw(body, Twist { angular: DVec3::ZERO, linear: 1e300 * DVec3::X }));
    assert_eq!(world.momentum(body), Wrench::ZERO);
}

/// The rotation of a driven body was NaN if the square of its motion overflowed.
#[test]
fn a_driven_body_of_any_speed_has_a_valid_pose() {
    for exponent in (0..=300).step_by(20) {
        for dt in [1e-7, 1e-3, 1e3, 1e200] {
            let mut world = World::new(Settings::default()).expect("the arguments are valid");
            let body = world.add(Object::driven(cube(), Pose::IDENTITY)).expect("the arguments are valid");
            let fast = 10f64.powi(exponent) * DVec3::new(0.6, -0.8, 0.1);
            for _ in 0..4 {
                assert!(world.drive(body, Pose::from_translation(DVec3::X), Twist { angular: fast, linear: fast }));
                world.step(&[], dt, &NoClock);
                let (pose, Twist { angular, linear }) = (world.pose(body), world.twist(body));
                assert!(pose.is_valid(), "1e{exponent}, {dt} s: {pose:?}");
                assert!(angular.is_finite() && linear.is_finite(), "1e{exponent}, {dt} s: {angular}, {linear}");
            }
        }
    }
}
