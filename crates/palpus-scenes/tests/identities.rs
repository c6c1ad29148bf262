//! Tests identities that hold for every result in every scene.

mod bodies;

use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Random, Wrench};
use palpus::body::{Hierarchy, PolygonSoup, Polytope};
use palpus::collision::{Closest, Front, LeafPair, LeafPairs, PlacedPair, Proximity, Side, gjk, initial_features};
use palpus::detect::{ContactQuery, QuerySettings};
use palpus::render::{ProbeState, Renderer, Settings};
use palpus_scenes::{Scene, scene, scenes};

/// Seed of all random numbers here.
const SEED: u64 = 0x1de7_717e;

fn settings(scene: &Scene) -> Settings {
    Settings {
        contact_tolerance: scene.contact.tolerance,
        cluster_radius: scene.contact.cluster_radius,
        stiffness: scene.contact.stiffness,
        ..Settings::default()
    }
}

/// Returns `count` poses along the scene's path.
fn poses(scene: &Scene, count: usize) -> Vec<Pose> {
    (0..count).map(|k| scene.path.pose(scene.path.duration() * k as f64 / count as f64)).collect()
}

fn shuffled(count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    Random::new(SEED).shuffle(&mut order);
    order
}

/// Returns the distances of the leaf pairs, sorted, so that the order of the search does not
/// matter.
fn answers(found: &[LeafPair], name_a: &[usize], name_b: &[usize]) -> Vec<(usize, usize, Option<f64>)> {
    let mut answers: Vec<_> = found
        .iter()
        .map(|leaf| {
            let distance = match leaf.proximity {
                Proximity::Disjoint(Closest { distance, .. }) => Some(distance),
                Proximity::Overlapping(_) => None,
            };
            (name_a[leaf.piece_a as usize], name_b[leaf.piece_b as usize], distance)
        })
        .collect();
    answers.sort_by_key(|answer| (answer.0, answer.1));
    answers
}

fn assert_same(found: &[(usize, usize, Option<f64>)], expected: &[(usize, usize, Option<f64>)], size: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "seed {SEED:#x}, {what}");
    for (x, y) in found.iter().zip(expected) {
        assert_eq!((x.0, x.1, x.2.is_some()), (y.0, y.1, y.2.is_some()), "seed {SEED:#x}, {what}");
        let gap = (x.2.unwrap_or(0.0) - y.2.unwrap_or(0.0)).abs();
        assert!(gap < 1e-9 * size, "seed {SEED:#x}, {what}: distances differ by {gap}");
    }
}

#[test]
fn contacts_and_forces_satisfy_their_identities() {
    // In scenes with two tools, the first tool need not touch the environment.
    for entry in scenes().iter().filter(|entry| entry.build().is_of_two_bodies()) {
        let scene = entry.build();
        let settings = settings(&scene);
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        let mut renderer = Renderer::new(a, b, settings).expect("a scene's settings are valid");
        let mut contacts = 0;
        for pose in poses(&scene, 300) {
            let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
            for contact in &tick.contacts {
                let size = contact.point_a.length().max(contact.separation.abs()).max(1e-2);
                let off = contact.point_a - contact.point_b - contact.separation * contact.normal;
                assert!(off.length() < 1e-10 * size, "{}: {contact:?}", entry.name);
                assert!((contact.normal.length() - 1.0).abs() < 1e-12, "{}: {contact:?}", entry.name);
                assert!(contact.separation < settings.contact_tolerance, "{}: {contact:?}", entry.name);
            }
            contacts += tick.contacts.len();
            let net = &tick.forces.net;
            assert!((net.on_a.force + net.on_b.force).length() < 1e-9, "{}", entry.name);
            assert!(tick.commanded.is_finite(), "{}", entry.name);
            assert!(tick.commanded.force.length() <= settings.limits.force * (1.0 + 1e-12), "{}", entry.name);
            assert!(tick.commanded.torque.length() <= settings.limits.torque * (1.0 + 1e-12), "{}", entry.name);
        }
        assert!(contacts > 0, "{} makes no contact", entry.name);
    }
}

#[test]
fn front_equals_all_pairs_for_any_piece_order() {
    let scene = scene("spoon-cup").expect("a built-in scene");
    let (a, b) = (body(&scene.probe), body(&scene.environment));
    let (order_a, order_b) = (shuffled(a.polytopes().len()), shuffled(b.polytopes().len()));
    let pick = |pieces: &[Polytope], order: &[usize]| order.iter().map(|&k| pieces[k].clone()).collect::<Vec<_>>();
    let (pieces_a, pieces_b) = (pick(a.polytopes(), &order_a), pick(b.polytopes(), &order_b));
    let build = |pieces: &[Polytope]| Hierarchy::build(pieces, 1e-12).expect("the pieces form a hierarchy");
    let (tree_a, tree_b) = (build(&pieces_a), build(&pieces_b));
    let side_a = Side { hierarchy: &tree_a, pieces: &pieces_a };
    let side_b = Side { hierarchy: &tree_b, pieces: &pieces_b };
    let plain_a = Side { hierarchy: a.hierarchy(), pieces: a.polytopes() };
    let plain_b = Side { hierarchy: b.hierarchy(), pieces: b.polytopes() };
    let identity: Vec<usize> = (0..order_a.len().max(order_b.len())).collect();
    let mut plain = Front::new(plain_a, plain_b, 1 << 15);
    let mut permuted = Front::new(side_a, side_b, 1 << 15);
    let mut found = LeafPairs::new(1 << 12);
    let (tolerance, size) = (scene.contact.tolerance, a.size());
    let mut touching = 0;
    for pose in poses(&scene, 40) {
        let place = pose.placement();
        plain.within(&PlacedPair::new(plain_a, plain_b, &place, tolerance), &mut found);
        let first = answers(found.as_slice(), &identity, &identity);
        permuted.within(&PlacedPair::new(side_a, side_b, &place, tolerance), &mut found);
        assert_same(&answers(found.as_slice(), &order_a, &order_b), &first, size, "permuted pieces");
        let mut all = Vec::new();
        for (i, p) in a.polytopes().iter().enumerate() {
            for (j, q) in b.polytopes().iter().enumerate() {
                match gjk(p, q, &place, initial_features(p, q, &place)).proximity {
                    Proximity::Disjoint(Closest { distance, .. }) if distance < tolerance => {
                        all.push((i, j, Some(distance)));
                    }
                    Proximity::Disjoint(_) => {}
                    Proximity::Overlapping(_) => all.push((i, j, None)),
                }
            }
        }
        assert_same(&first, &all, size, "all pairs by GJK");
        touching += all.len();
    }
    assert!(touching > 100, "the path must make more contacts: {touching}");
}

#[test]
fn cached_data_does_not_change_distances() {
    for name in ["spoon-cup", "torus-torus"] {
        let scene = scene(name).expect("a built-in scene");
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        let settings = QuerySettings { tolerance: 0.0, ..QuerySettings::default() };
        let mut warm = ContactQuery::new(a.clone(), b.clone(), settings);
        for pose in poses(&scene, 200) {
            let mut cold = ContactQuery::new(a.clone(), b.clone(), settings);
            let [remembered, fresh] =
                [&mut warm, &mut cold].map(|query| query.nearest(&pose).expect("every body has pieces").separation);
            assert_eq!(remembered > 0.0, fresh > 0.0, "{name}");
            assert!(fresh <= 0.0 || (remembered - fresh).abs() < 1e-10, "{name}: {remembered} and {fresh}");
        }
    }
}

#[test]
fn moving_the_scene_moves_the_wrench() {
    for name in ["pen-sphere", "box-table"] {
        let scene = scene(name).expect("a built-in scene");
        let moved = Pose::new(DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(-1.9), DVec3::new(0.3, -0.2, 0.5));
        let mut environment = scene.environment.clone();
        environment.vertices.iter_mut().for_each(|v| *v = moved.point(*v));
        let probe = body(&scene.probe);
        let renderer = |soup: &PolygonSoup| {
            Renderer::new(Arc::clone(&probe), body(soup), settings(&scene)).expect("valid settings")
        };
        let (mut here, mut there) = (renderer(&scene.environment), renderer(&environment));
        for (k, pose) in poses(&scene, 200).into_iter().enumerate() {
            let wrench = here.step(&ProbeState::at(pose), 1e-3, &NoClock).commanded;
            let same: Wrench = there.step(&ProbeState::at(moved * pose), 1e-3, &NoClock).commanded;
            let expected = wrench.rotated(&moved);
            // A flat contact has many witness points, and rounding decides which one is used. So
            // only its force is unique.
            let flat = name == "box-table";
            assert!((same.force - expected.force).length() < 1e-6, "{name}, {k}: {same:?}, expected {expected:?}");
            assert!(
                flat || (same.torque - expected.torque).length() < 1e-7,
                "{name}, {k}: {same:?}, expected {expected:?}"
            );
        }
    }
}
