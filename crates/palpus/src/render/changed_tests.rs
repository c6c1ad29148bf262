//! Tests changes of settings between two steps.

use glam::{DQuat, DVec3};

use super::renderer_tests::{DT, at, cube_on_floor, drum, settings};
use super::{Clustering, Limits, ProbeState, Renderer, Saturation, Settings, Tick, VirtualCoupling};
use crate::algebra::{NoClock, Pose, Twist};
use crate::force::testing::Random;
use crate::force::{FrictionSettings, ShadingSettings};

const SEED: u64 = 0x5E77;
const SHADING: ShadingSettings = ShadingSettings { crease_angle: 0.6, most_turn: 0.5 };
const FRICTION: FrictionSettings =
    FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.3, tangential_stiffness: 1000.0 };

/// States of a drum that moves over the rim of another drum, in and out of contact.
fn wander(steps: usize) -> Vec<ProbeState> {
    let mut random = Random::new(SEED);
    let mut pose = Pose::new(DQuat::from_rotation_x(0.4), DVec3::new(0.036, 0.01, 0.0));
    (0..steps)
        .map(|_| {
            pose = Pose::new(DQuat::from_scaled_axis(random.point(0.01)), random.point(2e-4)) * pose;
            ProbeState { pose_ba: pose, twist: Twist { angular: random.point(1.0), linear: random.point(0.1) } }
        })
        .collect()
}

fn drums(settings: Settings) -> Renderer {
    Renderer::new(drum(0.01, 0.02, 12), drum(0.03, 0.01, 24), settings).unwrap()
}

fn coupling() -> VirtualCoupling {
    VirtualCoupling::tuned(&Limits { force: 8.5, torque: 0.188 }, DT, 1e-3)
}

#[test]
fn changed_settings_equal_a_new_renderer() {
    let base = settings();
    for changed in [
        Settings { stiffness: 1500.0, ..base },
        Settings { damping: 3.0, ..base },
        Settings { clustering: Clustering::Linkage, cluster_radius: 2e-3, ..base },
        Settings { limits: Limits { force: 1.0, torque: 0.01 }, saturation: Saturation::Joint, ..base },
        Settings { grip_a: DVec3::new(0.0, 0.01, 0.02), ..base },
        Settings { shading: Some(SHADING), ..base },
        Settings { split_angle: None, clustering: Clustering::Linkage, ..base },
    ] {
        let (mut turned, mut built) = (drums(base).with_surfaces(SHADING.crease_angle), drums(changed));
        let mut touched = 0;
        for (k, probe) in wander(300).iter().enumerate() {
            if k % 50 == 0 {
                turned.set_settings(if k % 100 == 0 { &base } else { &changed }).unwrap();
            }
            let in_force = k % 100 >= 50;
            let expected = built.step(probe, DT, &NoClock).commanded;
            let tick = turned.step(probe, DT, &NoClock);
            assert_eq!(tick.index, k as u64);
            if in_force {
                assert_eq!(tick.commanded, expected, "seed {SEED:#x}, step {k}, {changed:?}");
                touched += u32::from(expected.force != DVec3::ZERO);
            }
        }
        assert!(touched > 30, "{touched}");
    }
}

#[test]
fn wider_tolerance_equals_a_new_renderer() {
    let (near, wide) = (settings(), Settings { contact_tolerance: 3e-3, ..settings() });
    let (mut turned, mut built) = (drums(near), drums(wide));
    for (k, probe) in wander(400).iter().enumerate() {
        if k % 40 == 0 {
            turned.set_settings(if k % 80 == 0 { &near } else { &wide }).unwrap();
        }
        let expected = built.step(probe, DT, &NoClock);
        let tick = turned.step(probe, DT, &NoClock);
        if k % 80 >= 40 {
            assert_eq!(tick.contacts.len(), expected.contacts.len(), "seed {SEED:#x}, step {k}");
            let off = tick.commanded.force.distance(expected.commanded.force);
            assert!(off < 1e-9, "seed {SEED:#x}, step {k}: {off} N");
        }
    }
}

#[test]
fn new_coupling_starts_at_the_device() {
    let direct = settings();
    let mut turned = cube_on_floor(direct);
    let coupled = Settings { coupling: Some(coupling()), ..direct };
    let felt = |tick: &Tick| (tick.tool_ba, tick.commanded);
    for x in 0..20 {
        turned.step(&at(f64::from(x) * 1e-4, -1e-3), DT, &NoClock);
    }
    turned.set_settings(&coupled).unwrap();
    let mut fresh = cube_on_floor(coupled);
    let mut last = Pose::IDENTITY;
    for x in 20..60 {
        let probe = at(f64::from(x) * 1e-4, -1e-3);
        let (tool, wrench) = felt(turned.step(&probe, DT, &NoClock));
        let (of_fresh, expected) = felt(fresh.step(&probe, DT, &NoClock));
        assert!(tool.translation.distance(of_fresh.translation) < 1e-9, "{tool:?} {of_fresh:?}");
        assert!(wrench.force.distance(expected.force) < 1e-6, "{wrench:?} {expected:?}");
        last = tool;
    }
    // A coupling that changes while it is in use continues from the tool's present pose.
    let soft = VirtualCoupling { stiffness: 100.0, ..coupling() };
    turned.set_settings(&Settings { coupling: Some(soft), ..direct }).unwrap();
    let (tool, _) = felt(turned.step(&at(60e-4, -1e-3), DT, &NoClock));
    assert!(tool.translation.distance(last.translation) < 1e-3);
    turned.set_settings(&direct).unwrap();
    let probe = at(70e-4, -1e-3);
    assert_eq!(turned.step(&probe, DT, &NoClock).tool_ba, probe.pose_ba);
}

#[test]
fn friction_after_a_pause_starts_without_strain() {
    let (dry, slippery) = (Settings { friction: Some(FRICTION), ..settings() }, settings());
    let mut renderer = cube_on_floor(dry);
    let across = |renderer: &mut Renderer, x| renderer.step(&at(x, -1e-3), DT, &NoClock).commanded.force.x;
    assert!(across(&mut renderer, 0.0).abs() < 1e-9 && across(&mut renderer, 5e-4) < -0.4);
    renderer.set_settings(&Settings { friction: Some(FRICTION), stiffness: 900.0, ..dry }).unwrap();
    assert!(across(&mut renderer, 5e-4) < -0.4, "a change of another setting keeps friction");
    renderer.set_settings(&slippery).unwrap();
    assert!(across(&mut renderer, 5e-4).abs() < 1e-9);
    renderer.set_settings(&dry).unwrap();
    assert!(across(&mut renderer, 5e-4).abs() < 1e-9, "the new friction begins without strain");
}

#[test]
fn invalid_changes_are_refused_and_change_nothing() {
    let base = settings();
    let mut renderer = cube_on_floor(base);
    let mut refuse = |settings: Settings| {
        let error = renderer.set_settings(&settings).expect_err("the settings are refused");
        assert_eq!(*renderer.settings(), base);
        error.field
    };
    assert_eq!(refuse(Settings { stiffness: f64::NAN, ..base }), "stiffness");
    assert_eq!(refuse(Settings { capacity: base.capacity + 1, ..base }), "capacity");
    assert_eq!(refuse(Settings { shading: Some(SHADING), ..base }), "shading.crease_angle");
    let before = cube_on_floor(base).step(&at(0.0, -1e-3), DT, &NoClock).commanded;
    assert_eq!(renderer.step(&at(0.0, -1e-3), DT, &NoClock).commanded, before);

    let shaded = Settings { shading: Some(SHADING), ..base };
    let mut renderer = cube_on_floor(shaded).with_surfaces(0.1);
    assert_eq!(renderer.crease_angle(), Some(SHADING.crease_angle), "prepared surfaces stay");
    renderer.set_settings(&base).unwrap();
    renderer.set_settings(&shaded).unwrap();
    assert_eq!(*renderer.settings(), shaded);
}
