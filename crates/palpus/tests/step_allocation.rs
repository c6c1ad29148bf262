//! Tests that a step of the renderer or the world does not allocate.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Twist};
use palpus::body::{Body, BodySettings, Mesh, PolygonSoup};
use palpus::force::{FrictionSettings, ShadingSettings};
use palpus::render::{Clustering, Material, Object, ProbeState, Renderer, Settings, VirtualCoupling, WorkLimit, World};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

/// Returns a torus about z, made of `n` × `m` quads. The radii are in metres.
fn torus(major: f64, minor: f64, n: u32, m: u32) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    for i in 0..n {
        for j in 0..m {
            let (s, t) = (TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
            let ring = major + minor * t.cos();
            soup.vertices.push(DVec3::new(ring * s.cos(), ring * s.sin(), minor * t.sin()));
            let (k, l) = ((i + 1) % n, (j + 1) % m);
            soup.push_face(&[i * m + j, k * m + j, k * m + l, i * m + l]);
        }
    }
    let (mesh, _) = Mesh::from_soup(&soup).expect("the torus has a mesh");
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).expect("the torus has a body"))
}

/// Returns the tori of the probe and of the environment.
fn tori() -> [Arc<Body>; 2] {
    [torus(0.04, 0.012, 20, 10), torus(0.04, 0.012, 24, 12)]
}

/// Returns settings with friction, shading, damping and a material.
fn every_force_stage() -> Settings {
    Settings {
        friction: Some(FrictionSettings {
            static_coefficient: 0.5,
            dynamic_coefficient: 0.4,
            tangential_stiffness: 600.0,
        }),
        shading: Some(ShadingSettings { crease_angle: 0.6, most_turn: 0.5 }),
        damping: 1.0,
        material: Some(Material::WOOD),
        ..Settings::default()
    }
}

/// Returns the state of the probe at tick `k`. One torus rolls and slides through the hole of the
/// other, with phases of contact and of separation.
fn path(k: u32) -> ProbeState {
    let s = f64::from(k) / 400.0;
    let turn = DQuat::from_rotation_x(0.5 * TAU * s) * DQuat::from_rotation_y(1.3 + 3.0 * s);
    let place = DVec3::new(0.04 + 0.012 * (TAU * 3.0 * s).sin(), 0.01 * (TAU * s).cos(), 0.02 * (TAU * 2.0 * s).sin());
    ProbeState { pose_ba: Pose::new(turn, place), twist: Twist { angular: DVec3::X, linear: DVec3::Y * 0.1 } }
}

#[test]
fn a_step_does_not_allocate() {
    let (settings, [probe, environment]) = (every_force_stage(), tori());
    let mut renderer = Renderer::new(probe.clone(), environment.clone(), settings).expect("the settings are valid");
    let mut hurried = Renderer::new(probe, environment, settings).expect("the settings are valid");
    hurried.allow(WorkLimit::Units(60));
    let before = allocations_of_this_thread();
    assert!(before > 0, "the counting allocator is not installed");
    let (mut touching, mut most, mut overlapping) = (0, 0, 0);
    for k in 0..400 {
        let tick = renderer.step(&path(k), 1e-3, &NoClock);
        assert!(tick.commanded.is_finite() && tick.commanded.force.length() <= settings.limits.force);
        touching += u32::from(!tick.contacts.is_empty());
        most = most.max(tick.contacts.len());
        overlapping += u32::from(tick.separation() < 0.0);
    }
    // Repeat the motion with settings that change every 10 ticks.
    let direct = Settings { clustering: Clustering::Linkage, shading: None, friction: None, ..settings };
    for k in 0..400 {
        if k % 10 == 0 {
            let coupling = VirtualCoupling::tuned(&settings.limits, 1e-3, 1e-3);
            let coupled = Settings { coupling: Some(coupling), stiffness: 2000.0, ..settings };
            let changed = [settings, coupled, direct][k as usize / 10 % 3];
            renderer.set_settings(&changed).expect("the settings are valid");
        }
        assert!(renderer.step(&path(k), 1e-3, &NoClock).commanded.is_finite());
    }
    // Repeat the motion with a limit on the work per step. The second part is too fast for one
    // step, so it needs sub-steps.
    let (mut late, mut sub_steps) = (0, 0);
    for k in (0..400).chain((0..400).step_by(3)) {
        let tick = hurried.step(&path(k), 1e-3, &NoClock);
        assert!(tick.commanded.is_finite());
        late += u32::from(tick.is_late());
        sub_steps += tick.counters.query.sub_steps;
    }
    assert_eq!(allocations_of_this_thread(), before, "allocations in steps");
    assert!(late > 50 && sub_steps > 100, "{late} late, {sub_steps} sub-steps");
    assert!(touching > 50 && touching < 400 && most > 5 && overlapping > 50, "{touching} {most} {overlapping}");
}

/// Returns `n` × `n` cubes of 0.8 mm in a plane, 1 mm apart.
fn cubes(n: u32) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let center = DVec3::new(f64::from(i), f64::from(j), 0.0) * 1e-3;
        let first = soup.vertices.len() as u32;
        let sign = |bit: bool| if bit { 0.4e-3 } else { -0.4e-3 };
        let corner = |k: u32| center + DVec3::new(sign(k & 1 != 0), sign(k & 2 != 0), sign(k & 4 != 0));
        soup.vertices.extend((0..8).map(corner));
        for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
            soup.push_face(&face.map(|k: u32| first + k));
        }
    }
    let (mesh, _) = Mesh::from_soup(&soup).expect("the cubes have a mesh");
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).expect("the cubes have a body"))
}

/// Another thread takes part in the steps of bodies with many pieces.
#[test]
fn a_step_with_a_helper_does_not_allocate() {
    let settings = every_force_stage();
    let body = cubes(34);
    let [mut alone, mut helped] =
        [(); 2].map(|()| Renderer::new(body.clone(), body.clone(), settings).expect("the settings are valid"));
    let helper = helped.helper();
    assert!(helper.is_useful());
    let path = |k: u32| {
        let s = f64::from(k) * 0.02;
        let shift = DVec3::new(3e-4 * s.sin(), 2e-4 * s.cos(), 8e-4 - 1e-5 * (3.0 * s).sin());
        ProbeState { pose_ba: Pose::new(DQuat::from_rotation_x(1e-3 * s.sin()), shift), twist: Twist::default() }
    };
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let of_helper = scope.spawn(|| {
            let before = allocations_of_this_thread();
            while !stop.load(Ordering::Relaxed) {
                if !helper.help() {
                    std::thread::yield_now();
                }
            }
            allocations_of_this_thread() - before
        });
        let (before, mut touching, mut same) = (allocations_of_this_thread(), 0, true);
        for k in 0..300 {
            touching += helped.step(&path(k), 1e-3, &NoClock).contacts.len();
            same &= alone.step(&path(k), 1e-3, &NoClock).commanded == helped.tick().commanded;
        }
        let of_steps = allocations_of_this_thread() - before;
        stop.store(true, Ordering::Relaxed);
        let of_helper = of_helper.join().expect("the helper has not panicked");
        assert_eq!([of_steps, of_helper], [0, 0], "allocations in steps");
        assert!(same && touching > 10_000, "the same wrenches: {same}; {touching} contacts");
    });
}

#[test]
fn a_step_of_two_tools_does_not_allocate() {
    let (settings, [probe, environment]) = (every_force_stage(), tori());
    let coupling = VirtualCoupling::tuned(&settings.limits, 1e-3, 1e-3);
    let coupled = Settings { coupling: Some(coupling), stiffness: 5000.0, ..settings };
    let mut worlds = [[settings; 2], [coupled; 2], [coupled, settings]].map(|both| {
        let mut world = World::new(both[0]).expect("the settings are valid");
        world.add(Object::fixed(environment.clone(), Pose::IDENTITY)).expect("the settings are valid");
        let tools = both.map(|settings| world.add_tool(probe.clone(), settings).expect("the settings are valid"));
        (world, tools)
    });
    let before = allocations_of_this_thread();
    let (mut touching, mut most) = (0, 0);
    for k in 0..400 {
        let second = path(k + 150);
        let aside = Pose { translation: second.pose_ba.translation + DVec3::Y * 0.03, ..second.pose_ba };
        for (world, tools) in &mut worlds {
            world.step(&[path(k), ProbeState { pose_ba: aside, ..second }], 1e-3, &NoClock);
            let ticks = tools.map(|tool| world.tick(tool));
            assert!(ticks.iter().all(|tick| tick.commanded.is_finite()));
            touching += u32::from(ticks[0].contacts_between > 0);
            most = most.max(ticks[1].contacts.len());
        }
    }
    assert_eq!(allocations_of_this_thread(), before, "allocations in steps");
    assert!(touching > 50 && most > 5, "{touching} {most}");
}
