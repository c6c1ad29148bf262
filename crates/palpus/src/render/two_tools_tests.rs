//! Tests two tools. While the tools are apart, each behaves like a single tool. While they touch,
//! their forces are equal and opposite, tools at rest stay at rest, and tools that move together
//! are not braked.

mod blocks;

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::{Limits, Object, ProbeState, Renderer, Settings, SettingsError, Tick, ToolId, VirtualCoupling, World};
use crate::algebra::{NoClock, Pose, Twist, Wrench};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};
use crate::force::FrictionSettings;
use crate::force::testing::Random;
use blocks::*;

const SEED: u64 = 0xD00;
const DT: f64 = 1e-3;
const LIMITS: Limits = Limits { force: 8.5, torque: 0.188 };
/// Half sizes of the tools, m.
const HALF: DVec3 = DVec3::new(0.02, 0.015, 0.01);
const FRICTION: FrictionSettings =
    FrictionSettings { static_coefficient: 0.5, dynamic_coefficient: 0.4, tangential_stiffness: 800.0 };

#[test]
fn separate_tools_equal_single_tools_to_the_bit() {
    for coupling in [false, true] {
        let block = block();
        let floor = boxes(&[FLOOR], &Pose::IDENTITY);
        let settings = Settings { friction: Some(FRICTION), ..if coupling { coupled() } else { direct() } };
        let mut two = Two::new([block.clone(), block.clone()], floor.clone(), [settings; 2]).unwrap();
        let mut alone = [0, 1].map(|_| Renderer::new(block.clone(), floor.clone(), settings).unwrap());
        let mut random = Random::new(SEED);
        let mut poses = [at(-0.1, 0.0, 0.0105), at(0.1, 0.0, 0.0102)];
        let mut felt = 0;
        for k in 0..300 {
            let states = poses.each_mut().map(|pose| wandering(&mut random, pose));
            let ticks = two.step(&states, DT, &NoClock);
            for (tick, (renderer, state)) in ticks.iter().zip(alone.iter_mut().zip(&states)) {
                let expected = renderer.step(state, DT, &NoClock);
                assert_eq!((tick.commanded, tick.tool_ba), (expected.commanded, expected.tool_ba), "tick {k}");
                assert_eq!((tick.contacts_between, tick.from_other), (0, Wrench::ZERO));
                felt += u32::from(tick.commanded != Wrench::ZERO);
            }
        }
        assert!(felt > 100, "seed {SEED:#x}: {felt}");
    }
}

#[test]
fn forces_between_tools_are_opposite() {
    let mut touching = 0;
    for (round, friction) in [None, Some(FRICTION)].into_iter().cycle().take(4).enumerate() {
        let mut two = blocks(
            |settings| {
                settings.friction = friction;
                settings.damping = 2.0;
            },
            round >= 2,
        );
        let mut random = Random::new(SEED ^ 1);
        // The tools stand beside each other on the floor.
        let mut poses = [at(-0.0201, 0.0, 0.0101), at(0.0201, 0.002, 0.0102)];
        for k in 0..400 {
            let states = poses.each_mut().map(|pose| wandering(&mut random, pose));
            let ticks = two.step(&states, DT, &NoClock);
            let (force, torque) = imbalance(ticks);
            let size = 1.0 + ticks[0].from_other.force.length();
            assert!(force < 1e-9 * size && torque < 1e-9 * size, "seed {SEED:#x}, tick {k}: {force} {torque}");
            assert_eq!(ticks[0].contacts_between, ticks[1].contacts_between);
            for tick in ticks {
                let Tick { contacts, forces, contacts_between, .. } = tick;
                assert_eq!(forces.members.len(), contacts.len());
                let own = contacts.len() - *contacts_between as usize;
                for (k, cluster) in forces.clusters.iter().enumerate() {
                    for &member in &forces.members[cluster.members()] {
                        assert!((contacts[member as usize].normal.dot(cluster.normal) - 1.0).abs() < 1e-9);
                        assert_eq!((member as usize) < own, k < forces.clusters.len() - forces_between(tick));
                    }
                }
                for contact in contacts {
                    let gap = contact.point_a - contact.point_b - contact.separation * contact.normal;
                    assert!(gap.length() < 1e-9, "{contact:?}");
                }
            }
            touching += u32::from(ticks[0].from_other.force.length() > 0.1);
        }
    }
    assert!(touching > 200, "seed {SEED:#x}: {touching}");
}

/// Returns the number of clusters with the other tool; with smooth clustering, each contact is a
/// cluster.
fn forces_between(tick: &Tick) -> usize {
    tick.contacts_between as usize
}

#[test]
fn resting_tool_equals_a_part_of_the_environment() {
    const WALL: (DVec3, DVec3) = (DVec3::new(0.03, -0.1, 0.001), DVec3::new(0.06, 0.1, 0.08));
    let block = block();
    // First the tool stands in a corner, which pushes in two directions. Then it touches only the
    // wall, with friction.
    for (z, friction) in [(HALF.z - 5e-4, None), (0.04, Some(FRICTION))] {
        let settings = Settings { friction, damping: 3.0, ..direct() };
        let whole = boxes(&[FLOOR, WALL], &Pose::IDENTITY);
        let mut one = Renderer::new(block.clone(), whole, settings).unwrap();
        let parts = [block.clone(), boxes(&[WALL], &Pose::IDENTITY)];
        let mut two = Two::new(parts, boxes(&[FLOOR], &Pose::IDENTITY), [settings; 2]).unwrap();
        let (mut random, mut felt) = (Random::new(SEED ^ 2), 0.0f64);
        let rest = at(0.03 - HALF.x + 3e-4, 0.0, z);
        for k in 0..300 {
            let slide = DVec3::Y * (1e-5 * f64::from(k));
            let pose =
                Pose::new(DQuat::from_scaled_axis(random.point(0.01)), rest.translation + slide + random.point(2e-4));
            let state =
                ProbeState { pose_ba: pose, twist: Twist { angular: random.point(0.1), linear: random.point(0.05) } };
            let expected = one.step(&state, DT, &NoClock).commanded;
            let [tick, _] = two.step(&[state, still(Pose::IDENTITY)], DT, &NoClock);
            let error = (tick.commanded.force - expected.force).length();
            assert!(error < 1e-9, "seed {SEED:#x}, tick {k}: {} and {}", tick.commanded.force, expected.force);
            assert!((tick.commanded.torque - expected.torque).length() < 1e-10);
            felt = felt.max(expected.force.y.abs());
        }
        assert!(felt > if friction.is_some() { 0.2 } else { 0.0 }, "{felt}");
    }
}

#[test]
fn moving_the_world_moves_the_wrenches() {
    let moved = Pose::new(DQuat::from_scaled_axis(DVec3::new(0.7, -0.4, 1.1)), DVec3::new(0.3, -0.2, 0.5));
    for coupling in [false, true] {
        let block = block();
        // Patches depend on the axes of the environment's frame.
        let settings =
            Settings { friction: Some(FRICTION), patch_angle: None, ..if coupling { coupled() } else { direct() } };
        let two = |at: &Pose| Two::new([block.clone(), block.clone()], boxes(&[FLOOR], at), [settings; 2]).unwrap();
        let (mut here, mut there) = (two(&Pose::IDENTITY), two(&moved));
        let mut most = 0.0f64;
        for k in 0..300 {
            let s = f64::from(k) / 300.0;
            let linear = DVec3::new(0.05 * (6.0 * s).cos(), 0.02, 0.0);
            let first = Pose::new(
                DQuat::from_rotation_z(0.1 + 0.05 * s) * DQuat::from_rotation_y(0.02) * DQuat::from_rotation_x(-0.013),
                DVec3::new(-0.021 + 1.5e-3 * (6.0 * s).sin(), 0.004 * s, 0.0104),
            );
            let states = [
                ProbeState { pose_ba: first, twist: Twist { angular: DVec3::Z * 0.1, linear } },
                still(Pose::new(
                    DQuat::from_rotation_z(-0.03) * DQuat::from_rotation_x(0.03),
                    DVec3::new(0.02, 0.003, 0.0107),
                )),
            ];
            let turned = states.map(|state| ProbeState {
                pose_ba: moved * state.pose_ba,
                twist: Twist { angular: moved.vector(state.twist.angular), linear: moved.vector(state.twist.linear) },
            });
            let expected = here.step(&states, DT, &NoClock).map(|tick| tick.commanded.rotated(&moved));
            let found = there.step(&turned, DT, &NoClock).map(|tick| tick.commanded);
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found.force - expected.force).length() < 2e-5, "{coupling}, tick {k}: {found:?} {expected:?}");
                assert!(
                    (found.torque - expected.torque).length() < 2e-6,
                    "{coupling}, tick {k}: {found:?} {expected:?}"
                );
            }
            most = most.max(here.ticks()[0].from_other.force.length());
        }
        assert!(most > 0.1, "the tools must press harder: {most}");
    }
}

#[test]
fn resting_pair_stays_at_rest() {
    // In the three cases, the tools are too far apart for contacts, near enough for contacts
    // without force, and nearly touching.
    for gap in [0.01, 4e-4, 1.0001e-4] {
        let mut two = blocks(|settings| settings.friction = Some(FRICTION), true);
        let poses = [at(-HALF.x - gap / 2.0, 0.0, 0.1), at(HALF.x + gap / 2.0, 0.001, 0.1)];
        for k in 0..200 {
            let ticks = two.step(&poses.map(still), DT, &NoClock);
            for (tick, pose) in ticks.iter().zip(&poses) {
                assert!((tick.tool_ba.translation - pose.translation).length() < 1e-12, "tick {k}, gap {gap}");
                assert!(tick.commanded.force.length() < 1e-9 && tick.commanded.torque.length() < 1e-10);
            }
            assert_eq!(ticks[0].contacts_between > 0, gap < 1e-3, "gap {gap}");
        }
    }
}

/// Returns the wrenches on both tools when they are pressed into each other by `overlap` (m) and
/// move together at `velocity` (m/s).
fn pressed(two: &mut Two, overlap: f64, velocity: DVec3, ticks: u32) -> [Wrench; 2] {
    let x = HALF.x - overlap / 2.0;
    for k in 0..ticks {
        let s = f64::from(k) * DT;
        // First the tools approach each other slowly, then they move together.
        let x = x + 0.005 * (1.0 - 10.0 * s).max(0.0);
        let along = velocity * (s - 0.2).max(0.0);
        let moving = if s > 0.2 { velocity } else { DVec3::ZERO };
        let state = |x: f64| ProbeState {
            pose_ba: Pose::from_translation(DVec3::new(x, 0.0, 0.1) + along),
            twist: Twist { angular: DVec3::ZERO, linear: moving },
        };
        two.step(&[state(-x), state(x)], DT, &NoClock);
    }
    two.ticks().map(|tick| tick.commanded)
}

#[test]
fn three_springs_in_series_balance() {
    let mut two = blocks(|_| (), true);
    let settings = *two.settings_between();
    let coupling = settings.coupling.unwrap();
    let [first, second] = pressed(&mut two, 4e-3, DVec3::ZERO, 3000);
    // The contact begins one contact offset before the blocks meet.
    let row = 1.0 / (2.0 / coupling.stiffness + 1.0 / settings.stiffness);
    let expected = row * (4e-3 + coupling.contact_offset);
    assert!((first.force - DVec3::NEG_X * expected).length() < 1e-6 * expected, "{first:?}, not {expected}");
    assert!((second.force - DVec3::X * expected).length() < 1e-6 * expected, "{second:?}");
    assert!(first.torque.length() < 1e-6 && second.torque.length() < 1e-6);
    let tools = two.ticks().map(|tick| tick.counters.tool);
    assert!(tools.iter().all(|tool| (tool.unsettled, tool.reset) == (0, 0)), "{tools:?}");
}

#[test]
fn moving_pair_presses_like_a_resting_pair() {
    // Two separate steps with the other tool's last pose would give tens of newtons at 0.1 m/s.
    let standing = pressed(&mut blocks(|_| (), true), 4e-3, DVec3::ZERO, 1200);
    for velocity in [DVec3::X * 0.1, DVec3::X * 0.4, DVec3::new(-0.1, 0.2, 0.3)] {
        let moving = pressed(&mut blocks(|settings| settings.friction = Some(FRICTION), true), 4e-3, velocity, 1200);
        for (moving, standing) in moving.iter().zip(&standing) {
            assert!((moving.force - standing.force).length() < 1e-3, "{velocity}: {moving:?}, {standing:?}");
        }
    }
}

#[test]
fn tool_against_a_direct_tool_equals_tool_against_wall() {
    let block = block();
    let floor = boxes(&[FLOOR], &Pose::IDENTITY);
    let held = coupled();
    let driven = Settings { coupling: None, ..held };
    for driven_first in [false, true] {
        let settings = if driven_first { [driven, held] } else { [held, driven] };
        let mut two = Two::new([block.clone(), block.clone()], floor.clone(), settings).unwrap();
        let coupling = held.coupling.unwrap();
        let felt = pressed(&mut two, 4e-3, DVec3::ZERO, 3000)[usize::from(driven_first)].force;
        let row = 1.0 / (1.0 / coupling.stiffness + 1.0 / two.settings_between().stiffness);
        let expected = row * (4e-3 + coupling.contact_offset);
        let direction = if driven_first { DVec3::X } else { DVec3::NEG_X };
        assert!((felt - direction * expected).length() < 1e-6 * expected, "{felt}, not {expected}");
        let [first, second] = two.ticks();
        assert_eq!(first.from_other.force, -second.from_other.force);
    }
}

#[test]
fn friction_acts_only_on_relative_motion() {
    let mut two = blocks(|settings| settings.friction = Some(FRICTION), false);
    let both = |shift: DVec3, along: DVec3| {
        let place = |x: f64, by: DVec3| still(Pose::from_translation(DVec3::new(x, 0.0, 0.1) + by));
        [place(-HALF.x + 5e-4, along + shift), place(HALF.x - 5e-4, along)]
    };
    // The tools overlap by 2 mm at 800 N/m.
    let mut force =
        |shift: f64, along: f64| two.step(&both(DVec3::Y * shift, DVec3::Z * along), DT, &NoClock)[0].commanded.force;
    let rest = force(0.0, 0.0);
    assert!((rest + DVec3::X * 1.6).length() < 1e-9, "{rest}");
    for k in 0..50 {
        assert!((force(0.0, 1e-3 * f64::from(k)) - rest).length() < 1e-9);
    }
    assert!((force(0.5e-3, 0.05) - DVec3::new(-1.6, -0.4, 0.0)).length() < 1e-9);
}

#[test]
fn tool_with_invalid_pose_is_ignored() {
    let mut two = blocks(|_| (), true);
    let mut alone = blocks(|_| (), true);
    let away = still(at(0.1, 0.1, 0.1));
    let nowhere = still(Pose::from_translation(DVec3::NAN));
    for k in 0..100 {
        let first = still(at(-HALF.x, 0.0, HALF.z - 1e-5 * f64::from(k)));
        let [tick, none] = two.step(&[first, nowhere], DT, &NoClock);
        let expected = alone.step(&[first, away], DT, &NoClock)[0].commanded;
        assert_eq!(tick.commanded, expected);
        assert_eq!((none.commanded, none.counters.bad_state), (Wrench::ZERO, 1));
    }
    // The valid poses of the next step give contact again.
    let ticks = two.step(&[still(at(-HALF.x, 0.0, 0.1)), still(at(HALF.x - 1e-4, 0.0, 0.1))], DT, &NoClock);
    assert!(ticks.iter().all(|tick| tick.commanded.is_finite()));
}

#[test]
fn nonsense_steps_give_finite_wrenches() {
    let mut two = blocks(|_| (), true);
    pressed(&mut two, 2e-3, DVec3::ZERO, 400);
    let states = [still(at(-HALF.x + 1e-3, 0.0, 0.1)), still(at(HALF.x - 1e-3, 0.0, 0.1))];
    for dt in [0.0, f64::NAN, f64::INFINITY, -1.0, 1e300] {
        for tick in two.step(&states, dt, &NoClock) {
            assert!(tick.commanded.is_finite() && tick.tool_ba.is_valid(), "{dt}");
        }
    }
    two.world.clear();
    for tick in two.step(&states, DT, &NoClock) {
        assert!(tick.commanded.is_finite());
    }
}

#[test]
fn contact_transmits_energy_without_gain() {
    for coupling in [false, true] {
        let mut two = blocks(|settings| settings.friction = Some(FRICTION), coupling);
        let (mut sum, mut most, mut through) = (0.0, 0.0f64, 0.0f64);
        for k in 0..4000 {
            let s = f64::from(k) * DT;
            // One tool presses the other and releases it, and also moves it to and fro.
            let (press, way) = (1.5e-3 * (9.0 * s).sin(), 0.02 * (3.0 * s).sin());
            let along = DVec3::new(way, 0.003 * (5.0 * s).sin(), 0.0);
            let x = HALF.x - press;
            let rate = DVec3::new(0.06 * (3.0 * s).cos(), 0.015 * (5.0 * s).cos(), 0.0);
            let state = |x: f64| ProbeState {
                pose_ba: Pose::from_translation(DVec3::new(x, 0.0, 0.1) + along),
                twist: Twist { angular: DVec3::ZERO, linear: rate },
            };
            let [first, second] = two.step(&[state(-x), state(x)], DT, &NoClock).map(|tick| tick.work_from_other);
            sum += first.iter().chain(&second).sum::<f64>();
            most = most.max(sum);
            through += first[0].abs();
        }
        // Without a coupling, forces are constant over a tick while the tools move.
        let least = if coupling { 2e-4 } else { 2e-3 };
        assert!(through > 1e-2 && most < least, "{coupling}: {most} of {through} J");
    }
}

#[test]
fn settings_change_for_one_tool_and_its_pairs() {
    let mut two = blocks(|_| (), false);
    let states = [still(at(-HALF.x + 5e-4, 0.0, 0.1)), still(at(HALF.x - 5e-4, 0.0, 0.1))];
    let soft = Settings { stiffness: 400.0, ..*two.settings()[1] };
    let force = |two: &mut Two| two.step(&states, DT, &NoClock)[0].commanded.force.length();
    assert!((force(&mut two) - 1.6).abs() < 1e-9);
    two.set_settings(1, &soft).unwrap();
    assert!((force(&mut two) - 0.8).abs() < 1e-9);
    let bad = Settings { capacity: 7, ..soft };
    assert_eq!(two.set_settings(0, &bad).unwrap_err().field, "capacity");
    assert!((force(&mut two) - 0.8).abs() < 1e-9);
}
