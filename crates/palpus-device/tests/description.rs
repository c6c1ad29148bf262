//! Tests that the force does not depend on the triangulation of a mesh.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Random, quantile};
use palpus::body::{Body, PolygonSoup};
use palpus::render::{Limits, Object, ProbeState, Settings, ToolId, World};
use palpus_device::{Encoder, HapticDevice, SimulatedDevice, SimulationSettings};
use palpus_scenes::{Scene, scene};

const TICK: f64 = 1e-3;
const SEED: u64 = 0xde5c;

fn settings(scene: &Scene, coupled: bool) -> Settings {
    let limits = Limits { force: 8.5, torque: 0.188 };
    let settings = if coupled {
        Settings::coupled(limits, TICK, scene.contact.tolerance)
    } else {
        Settings {
            contact_tolerance: scene.contact.tolerance,
            stiffness: scene.contact.stiffness,
            limits,
            ..Settings::default()
        }
    };
    settings.with_friction(0.4, 0.3)
}

/// Returns the same polygons in another order, each with another first vertex, and with the
/// vertices in another order.
fn shuffled(soup: &PolygonSoup, random: &mut Random) -> PolygonSoup {
    let mut order: Vec<usize> = (0..soup.vertices.len()).collect();
    random.shuffle(&mut order);
    let mut place = vec![0u32; order.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old] = new as u32;
    }
    let mut faces: Vec<usize> = (0..soup.face_count()).collect();
    random.shuffle(&mut faces);
    let mut out = PolygonSoup::new();
    out.vertices = order.iter().map(|&old| soup.vertices[old]).collect();
    for f in faces {
        let mut face: Vec<u32> = soup.face(f).iter().map(|&v| place[v as usize]).collect();
        let turn = random.below(face.len());
        face.rotate_left(turn);
        out.push_face(&face);
    }
    out
}

/// Replaces each triangle by four.
fn subdivided(soup: &PolygonSoup) -> PolygonSoup {
    let mut out = PolygonSoup::new();
    for f in 0..soup.face_count() {
        let face = soup.face(f);
        for k in 1..face.len() - 1 {
            let [a, b, c] = [face[0], face[k], face[k + 1]].map(|v| soup.vertices[v as usize]);
            let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
            for triangle in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                let first = out.vertices.len() as u32;
                out.vertices.extend(triangle);
                out.push_face(&[first, first + 1, first + 2]);
            }
        }
    }
    out
}

fn world(settings: Settings, a: &Arc<Body>, b: &Arc<Body>, place: Pose) -> (World, ToolId) {
    let mut world = World::new(settings).expect("the settings are valid");
    world.add(Object::fixed(b.clone(), place)).expect("the body is added");
    let tool = world.add_tool(a.clone(), settings).expect("the tool is added");
    (world, tool)
}

/// Returns other descriptions of the scene: its bodies, and the pose of the environment's frame.
fn variants(scene: &Scene, a: &Arc<Body>) -> [(&'static str, [Arc<Body>; 2], Pose); 3] {
    let mut random = Random::new(SEED);
    let turn = DQuat::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), 0.7);
    let mut turned = scene.environment.clone();
    turned.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
    let both = |of: &mut dyn FnMut(&PolygonSoup) -> PolygonSoup| {
        [&scene.probe, &scene.environment].map(|soup| body(&of(soup)))
    };
    [
        ("shuffled", both(&mut |soup| shuffled(soup, &mut random)), Pose::IDENTITY),
        ("subdivided", both(&mut subdivided), Pose::IDENTITY),
        ("turned", [a.clone(), body(&turned)], Pose { rotation: turn.inverse(), ..Pose::IDENTITY }),
    ]
}

#[test]
#[expect(clippy::print_stderr, reason = "figures for docs/feel.md")]
fn force_does_not_depend_on_the_triangulation() {
    let names = ["spoon-cup", "peg-hole", "torus-torus", "box-table", "v-groove", "gears"];
    for (name, is_coupled) in names.iter().flat_map(|&name| [(name, true), (name, false)]) {
        // Without a coupling, the gears' teeth overlap so deeply that the shortest separating
        // motion is ambiguous. This case is only printed.
        let bounds = if name == "gears" && !is_coupled { [f64::INFINITY; 2] } else { [0.01, 0.02] };
        let scene = scene(name).expect("the scene is built in");
        let [a, b] = [body(&scene.probe), body(&scene.environment)];
        let settings = settings(&scene, is_coupled);
        let (mut base, tool) = world(settings, &a, &b, Pose::IDENTITY);
        let variants = variants(&scene, &a);
        let mut others = variants.each_ref().map(|(_, [a, b], place)| world(settings, a, b, *place).0);
        let path = scene.path.clone();
        let simulation = SimulationSettings { encoder: Encoder::EXACT, ..SimulationSettings::default() };
        let mut device =
            SimulatedDevice::new(simulation, move |time: f64| path.pose(time)).expect("the settings are valid");
        let (mut forces, mut errors) = (Vec::new(), [const { Vec::new() }; 3]);
        for _ in 0..3000 {
            let state = device.read().expect("the device returns a state");
            let probe = [ProbeState { pose_ba: state.pose, twist: state.twist }];
            base.step(&probe, TICK, &NoClock);
            let felt = base.tick(tool).commanded;
            device.write(&felt).expect("the wrench is accepted");
            let is_felt = felt.force.length() > 0.05;
            forces.extend(is_felt.then_some(felt.force.length()));
            for (world, errors) in others.iter_mut().zip(&mut errors) {
                world.step(&probe, TICK, &NoClock);
                errors.extend(is_felt.then_some(world.tick(tool).commanded.force.distance(felt.force)));
            }
        }
        assert!(forces.len() > 10, "{name}: there must be a force");
        let mean = forces.iter().sum::<f64>() / forces.len() as f64;
        for ((what, ..), errors) in variants.iter().zip(errors) {
            let [most, largest] =
                [0.99, 1.0].map(|share| quantile(&mut errors.clone(), share).expect("there are errors"));
            let said = format!(
                "{name}, coupled {is_coupled}, {what}: off by {most:.1e} N at 99 %, {largest:.1e} N at most, of {mean:.3} N"
            );
            eprintln!("{said}");
            assert!(most < bounds[0] * mean && largest < bounds[1] * mean, "{said}, seed {SEED:#x}");
        }
    }
}
