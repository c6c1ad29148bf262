//! The C library gives the same bits as Rust, and a step allocates no memory.
#![allow(unsafe_code, reason = "the C library's functions take pointers")]

use std::sync::Arc;

use palpus::glam::{DQuat, DVec3};
use palpus::render::Material;
use palpus::{
    Body, ContactQuery, Limits, NoClock, Object, Pose, ProbeState, QuerySettings, Settings, Twist, World,
    contact_tolerance,
};
use palpus_alloc::{CountingAllocator, allocations_of_this_thread};
use palpus_capi::body::{palpus_body, palpus_body_destroy, palpus_body_from_convex};
use palpus_capi::depth::{palpus_depth, palpus_depth_bound, palpus_depth_bounds, palpus_depth_create};
use palpus_capi::query::{palpus_query, palpus_query_contacts, palpus_query_create, palpus_query_nearest};
use palpus_capi::result::palpus_result::{self, PalpusOk};
use palpus_capi::settings::{
    palpus_contact_tolerance, palpus_settings, palpus_settings_coupled, palpus_settings_default,
};
use palpus_capi::value::{palpus_contact, palpus_pose, palpus_twist, palpus_wrench};
use palpus_capi::world::{palpus_object, palpus_probe, palpus_tool, palpus_world};
use palpus_capi::world_functions as world_of;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

const PERIOD: f64 = 1e-3;

fn ok(result: palpus_result) {
    assert_eq!(result, PalpusOk);
}

fn corners(size: DVec3) -> Vec<[f64; 3]> {
    let corner = |k: u32| (DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) - 0.5) * size;
    (0..8).map(|k| corner(k).to_array()).collect()
}

fn block(size: DVec3) -> (Arc<Body>, palpus_body) {
    let points = corners(size);
    let mut body = palpus_body::default();
    // SAFETY: the pointers point to eight points and to memory for a handle.
    ok(unsafe { palpus_body_from_convex(points.as_flattened().as_ptr(), points.len(), &mut body) });
    let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
    (Arc::new(Body::from_convex(&points).unwrap()), body)
}

fn wiggle(k: u32) -> Pose {
    let t = f64::from(k) * PERIOD;
    let turn = DQuat::from_rotation_x(0.3 * (7.0 * t).sin()) * DQuat::from_rotation_z(0.2 * t);
    Pose::new(turn, DVec3::new(0.01 * (3.0 * t).sin(), 0.0, 0.034 - 0.008 * t.min(1.0)))
}

#[test]
fn queries_match_rust_bit_for_bit() {
    let ((a, a_c), (b, b_c)) = (block(DVec3::new(0.02, 0.02, 0.04)), block(DVec3::new(0.1, 0.1, 0.02)));
    let mut query = ContactQuery::new(a, b, QuerySettings::default());
    let (mut query_c, mut depth_c) = (palpus_query::default(), palpus_depth::default());
    // SAFETY: the settings are null, and the pointers point to memory for the results.
    unsafe {
        ok(palpus_query_create(a_c, b_c, std::ptr::null(), &mut query_c));
        ok(palpus_depth_create(a_c, b_c, std::ptr::null(), &mut depth_c));
    }
    let mut touching = 0;
    for k in 0..1000 {
        let pose = wiggle(k);
        let place = palpus_pose::from(pose);
        let mut found = [palpus_contact::default(); 64];
        let (mut count, mut nearest) = (0, palpus_contact::default());
        // SAFETY: the pointers point to a pose and to memory for as many results as the capacity
        // says.
        unsafe {
            ok(palpus_query_contacts(query_c, &place, found.as_mut_ptr(), found.len(), &mut count));
            ok(palpus_query_nearest(query_c, &place, &mut nearest));
        }
        let expected: Vec<palpus_contact> = query.contacts(&pose).iter().map(palpus_contact::from).collect();
        assert_eq!(found[..count], expected, "pose {k}");
        assert_eq!(Some(nearest), query.nearest(&pose).as_ref().map(palpus_contact::from), "pose {k}");
        touching += u32::from(count > 0);
        if k % 200 == 199 {
            let mut bounds = palpus_depth_bounds::default();
            // SAFETY: the pointers point to a pose and to memory for the result.
            ok(unsafe { palpus_depth_bound(depth_c, &place, &mut bounds) });
            assert!(bounds.lower <= bounds.upper && bounds.certified == 1);
            assert_eq!(bounds.upper > 0.0, nearest.separation < 0.0, "pose {k}");
        }
    }
    assert!(touching > 300);
}

#[test]
fn steps_match_rust_and_allocate_nothing() {
    let [plate, finger, cube] =
        [DVec3::new(0.1, 0.1, 0.02), DVec3::new(0.01, 0.01, 0.04), DVec3::splat(0.01)].map(block);
    let limits = Limits { force: 8.5, torque: 0.19 };
    let ringing = Some(Material::STEEL);
    let settings = Settings { material: ringing, ..Settings::coupled(limits, PERIOD, 2e-4).with_friction(0.4, 0.3) };
    let mut world = World::new(settings).unwrap();
    world.set_gravity(DVec3::Z * -9.81);
    world.add(Object::fixed(plate.0.clone(), Pose::IDENTITY)).unwrap();
    let beside = Pose::from_translation(DVec3::new(0.012, 0.0, 0.0151));
    let free = world.add(Object::free_of_mass(cube.0.clone(), beside, 0.02)).unwrap();
    let tool = world.add_tool(finger.0.clone(), settings).unwrap();

    let settings_c = palpus_settings::from(&settings);
    let (mut world_c, mut object, mut free_c, mut tool_c) =
        (palpus_world::default(), palpus_object::default(), palpus_object::default(), palpus_tool::default());
    // SAFETY: the pointers point to values and to memory for the results.
    unsafe {
        ok(world_of::palpus_world_create(&settings_c, &mut world_c));
        ok(world_of::palpus_world_set_gravity(world_c, [0.0, 0.0, -9.81].as_ptr()));
        ok(world_of::palpus_world_add_fixed(world_c, plate.1, &Pose::IDENTITY.into(), &mut object));
        ok(world_of::palpus_world_add_free(world_c, cube.1, &beside.into(), 0.02, &mut free_c));
        ok(world_of::palpus_world_add_tool(world_c, finger.1, &settings_c, &mut tool_c));
    }
    // The world keeps a body alive after the body's handle is destroyed.
    ok(palpus_body_destroy(finger.1));
    for k in 0..2000 {
        let pose = wiggle(k);
        let twist = Twist { linear: DVec3::X * 0.01, angular: DVec3::Z * 0.2 };
        world.step(&[ProbeState { pose_ba: pose, twist }], PERIOD, &NoClock);
        let probe = palpus_probe { pose: pose.into(), twist: palpus_twist::from(twist) };
        let (mut wrench, mut place) = (palpus_wrench::default(), palpus_pose::default());
        let before = allocations_of_this_thread();
        // SAFETY: the pointers point to one probe and to memory for one wrench.
        ok(unsafe { world_of::palpus_world_step(world_c, &probe, &mut wrench, 1, PERIOD) });
        assert_eq!(allocations_of_this_thread(), before, "step {k} allocated memory");
        // SAFETY: the pointer points to memory for a pose.
        ok(unsafe { world_of::palpus_world_get_pose(world_c, free_c, &mut place) });
        assert_eq!(wrench, world.tick(tool).commanded.into(), "step {k}");
        assert_eq!(place, world.pose(free).into(), "step {k}");
    }
    assert!(world.tick(tool).commanded.force.length() > 1.0);
    assert_eq!((settings_c.has_material, settings_c.material.gain), (1, Material::STEEL.gain));
}

#[test]
fn c_settings_equal_rust_settings() {
    let (mut coupled, mut default) = ([settings_with_noise(); 1], [settings_with_noise(); 1]);
    // SAFETY: the pointers point to memory for settings.
    unsafe {
        ok(palpus_settings_coupled(8.5, 0.19, PERIOD, 2e-4, coupled.as_mut_ptr()));
        ok(palpus_settings_default(default.as_mut_ptr()));
    }
    assert_eq!(
        coupled[0],
        palpus_settings::from(&Settings::coupled(Limits { force: 8.5, torque: 0.19 }, PERIOD, 2e-4))
    );
    assert_eq!(default[0], palpus_settings::from(&Settings::default()));
    assert_eq!((default[0].has_coupling, coupled[0].has_coupling), (0, 1));
}

#[test]
fn c_tolerance_equals_rust_tolerance() {
    let [plate, finger] = [DVec3::new(0.1, 0.1, 0.02), DVec3::new(0.01, 0.01, 0.04)].map(block);
    let (pose, mut tolerance) = (Pose::from_translation(DVec3::Z * 0.03), f64::NAN);
    // SAFETY: the pointers point to a pose and to memory for a number.
    ok(unsafe { palpus_contact_tolerance(finger.1, plate.1, &pose.into(), &mut tolerance) });
    assert_eq!(tolerance, contact_tolerance(&finger.0, &plate.0, &pose));
    assert_eq!(tolerance, 0.01 * finger.0.size());
}

/// Returns settings with arbitrary values, which the test overwrites.
fn settings_with_noise() -> palpus_settings {
    palpus_settings { capacity: 7, has_material: 9, ..palpus_settings::from(&Settings::default()) }
}
