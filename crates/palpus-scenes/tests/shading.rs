//! Tests that shading turns forces and changes nothing else: contacts, depths and magnitudes stay
//! the same, and creases stay sharp.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, Feature, Polytope};
use palpus::force::ShadingSettings;
use palpus::render::{Clustering, ProbeState, Renderer, Settings};
use palpus_scenes::{scene, shape};

const SHADING: ShadingSettings = ShadingSettings { crease_angle: 0.7, most_turn: 0.5 };
const BOTH: [Clustering; 2] = [Clustering::Linkage, Clustering::Smooth];

/// Returns two renderers: without shading and with shading.
fn both_ways(a: &Arc<Body>, b: &Arc<Body>, settings: Settings) -> [Renderer; 2] {
    [None, Some(SHADING)].map(|shading| {
        Renderer::new(a.clone(), b.clone(), Settings { shading, ..settings }).expect("the settings are valid")
    })
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn shading_keeps_depth_and_magnitude() {
    for name in ["torus-torus", "spoon-cup", "v-groove", "pen-sphere"] {
        let scene = scene(name).expect("a built-in scene");
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        for clustering in BOTH {
            let settings = Settings {
                contact_tolerance: scene.contact.tolerance,
                cluster_radius: scene.contact.cluster_radius,
                clustering,
                ..Settings::default()
            };
            let [mut plain, mut shaded] = both_ways(&a, &b, settings);
            let (mut touched, mut turned, mut worst) = (0, 0.0_f64, 0.0_f64);
            for k in 0..1500 {
                let probe = ProbeState::at(scene.path.pose(scene.path.duration() * f64::from(k) / 1500.0));
                let (plain, shaded) = (plain.step(&probe, 1e-3, &NoClock), shaded.step(&probe, 1e-3, &NoClock));
                assert_eq!(plain.contacts, shaded.contacts, "{name}, {clustering:?}, step {k}");
                assert_eq!(plain.separation(), shaded.separation());
                for (&i, direction) in shaded.forces.members.iter().zip(&shaded.forces.directions) {
                    let turn = shaded.contacts[i as usize].normal.angle_between(*direction);
                    assert!(turn <= SHADING.most_turn + 1e-7, "{name}, {clustering:?}, step {k}: {turn}");
                    turned = turned.max(turn);
                }
                let sum = |forces: &[f64]| forces.iter().sum::<f64>();
                let (before, after) = (&plain.forces.normal_forces, &shaded.forces.normal_forces);
                if !before.is_empty() {
                    touched += 1;
                    worst = worst.max((sum(after) / sum(before) - 1.0).abs());
                }
                if clustering == Clustering::Linkage || before.len() == 1 {
                    assert_eq!(before, after, "{name}, {clustering:?}, step {k}");
                }
            }
            eprintln!(
                "{name}, {clustering:?}: {touched} steps, turned by {turned:.3} rad, magnitudes changed by {:.1} %",
                100.0 * worst
            );
            assert!(touched > 200, "{name} must make more contacts");
            // With smooth clustering, each contact keeps its magnitude before load sharing. Load
            // shares depend on the shaded directions, so magnitudes change a little.
            assert!(worst < 0.05, "{name}, {clustering:?}: {worst}");
        }
    }
}

/// Returns the sine of the angle between `direction` and the range of normals at an edge or a
/// corner.
fn outside(polytope: &Polytope, feature: Feature, direction: DVec3) -> f64 {
    match feature {
        Feature::Edge(edge) => {
            let edge = polytope.edge(edge);
            let along = (polytope.vertex(edge.head) - polytope.vertex(edge.tail)).normalize();
            let faces = [edge.left, edge.right].map(|face| -polytope.plane(face).normal.dot(direction));
            along.dot(direction).abs().max(faces[0]).max(faces[1])
        }
        // The faces of a box are perpendicular.
        Feature::Vertex(vertex) => {
            polytope.ring(vertex).iter().map(|s| -polytope.plane(s.left).normal.dot(direction)).fold(0.0, f64::max)
        }
        Feature::Face(_) => 0.0,
    }
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn edges_of_a_box_stay_sharp() {
    // A coarse ball rolls over the edges and corners of a box. The forces must stay between the
    // normals of the faces that meet there.
    let size = DVec3::new(0.06, 0.04, 0.03);
    let (ball, block) = (body(&shape::sphere(0.008, 1)), body(&shape::cuboid(size)));
    for clustering in BOTH {
        let [_, mut renderer] = both_ways(&ball, &block, Settings { clustering, ..Settings::default() });
        let (mut on_edges, mut turned) = (0, 0.0_f64);
        for k in 0..6000 {
            let s = f64::from(k) / 6000.0;
            // The ball moves around the box and a little up and down, at a small depth.
            let angle = std::f64::consts::TAU * s;
            let outward = DVec3::new(angle.cos(), angle.sin(), 0.9 * (7.0 * angle).sin());
            let reach = (size / 2.0 / outward.abs().max(DVec3::splat(1e-9))).min_element();
            let on_box = outward * reach;
            let nearest = |p: DVec3| p.clamp(-size / 2.0, size / 2.0);
            let away = (on_box * 1.3 - nearest(on_box * 1.3)).normalize();
            let center = nearest(on_box * 1.3) + away * 0.0078;
            let pose = Pose::new(DQuat::from_scaled_axis(DVec3::new(3.0, 2.0, 1.0) * angle), center);
            let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
            for (&i, direction) in tick.forces.members.iter().zip(&tick.forces.directions) {
                let contact = &tick.contacts[i as usize];
                let polytope = &block.polytopes()[contact.piece_b as usize];
                turned = turned.max(contact.normal.angle_between(*direction));
                if let Feature::Face(face) = contact.features.b {
                    let normal = polytope.plane(face).normal;
                    assert!(
                        normal.angle_between(*direction) < 1e-6,
                        "{clustering:?}, step {k}: the force must follow the face's normal"
                    );
                } else {
                    on_edges += 1;
                    let more = outside(polytope, contact.features.b, *direction)
                        - outside(polytope, contact.features.b, contact.normal);
                    assert!(more < 1e-6, "{clustering:?}, step {k}: {more} beyond the normals of the faces");
                }
            }
        }
        eprintln!("{clustering:?}: {on_edges} contacts on edges, turned by {turned:.3}");
        assert!(on_edges > 300 && turned > 0.1);
    }
}
