//! How far the blended witness moves when a body moves, over the contacts that make exact witnesses jump.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::*;
use crate::algebra::tolerance::SKIRT_SLOPE;
use crate::algebra::{Placement, Pose};
use crate::body::{FeaturePair, Polytope, Provenance, convex_hull};
use crate::collision::{Proximity, initial_features, march};

const ANGLE: f64 = 5.0 * TAU / 360.0;
const TOLERANCE: f64 = 1e-3;

fn solid(points: &[DVec3]) -> Polytope {
    convex_hull(points, 1e-10).unwrap().into_polytope().unwrap().0
}

fn cuboid(half: DVec3) -> Polytope {
    let sign = |bit: u32| if bit == 0 { -1.0 } else { 1.0 };
    solid(&(0..8).map(|k| DVec3::new(sign(k & 1), sign(k & 2), sign(k & 4)) * half).collect::<Vec<_>>())
}

/// A prism along y.
fn prism(sides: u32, radius: f64, half: f64) -> Polytope {
    let corner = |k: u32| {
        let angle = TAU * f64::from(k / 2) / f64::from(sides);
        DVec3::new(radius * angle.sin(), if k.is_multiple_of(2) { half } else { -half }, -radius * angle.cos())
    };
    solid(&(0..2 * sides).map(corner).collect::<Vec<_>>())
}

/// Its top is z = 0.
fn table() -> Polytope {
    let points: Vec<DVec3> =
        cuboid(DVec3::new(0.2, 0.2, 0.025)).vertices().iter().map(|v| *v - DVec3::Z * 0.025).collect();
    solid(&points)
}

fn the_box() -> Polytope {
    cuboid(DVec3::new(0.05, 0.04, 0.03))
}

/// One contact, as the pair query finds it.
#[derive(Clone, Copy)]
struct Felt {
    exact: DVec3,
    midpoint: DVec3,
    normal: DVec3,
    separation: f64,
    features: FeaturePair,
    walked: Option<Seed>,
    pivots: u32,
}

fn felt(a: &Polytope, b: &Polytope, place: &Placement, last: Option<&Felt>, scratch: &mut WalkScratch) -> Felt {
    let start = last.map_or_else(|| initial_features(a, b, place), |last| last.features);
    let marched = march(a, b, place, start);
    let mut walked = None;
    let (touch, separation) = match marched.proximity {
        Proximity::Disjoint(closest) => {
            let crate::collision::Closest { point_a, point_b, normal, distance, features } = closest;
            (Touch { features, point_a, point_b, normal }, distance)
        }
        Proximity::Overlapping(overlap) => {
            let witness = Seed::Witness { direction: overlap.direction };
            let deep = match last.and_then(|last| last.walked) {
                Some(seed) => depth(a, b, place, &[seed, witness], scratch),
                None => depth(a, b, place, &[witness, Seed::CentroidLine], scratch),
            };
            walked = Some(deep.seed());
            let Depth { point_a, point_b, normal, depth, antipodal, .. } = deep;
            (Touch { features: antipodal.features(), point_a, point_b, normal }, -depth)
        }
    };
    let blend = blend(a, b, place, &touch, ANGLE);
    assert!(blend.converged, "{touch:?}");
    assert!(blend.shift.dot(touch.normal).abs() < 1e-15);
    let exact = (touch.point_a + touch.point_b) * 0.5;
    let midpoint = exact + blend.shift;
    let features = marched.features;
    Felt { exact, midpoint, normal: touch.normal, separation, features, walked, pivots: blend.pivots }
}

/// The largest figures along a path.
#[derive(Clone, Copy, Debug, Default)]
#[allow(dead_code, reason = "printed")]
struct Figures {
    /// Of a witness step to the motion of the farthest vertex, in the plane.
    ratio: f64,
    /// The same of the exact witness: how it jumps.
    exact_ratio: f64,
    /// Of a witness step to what the module promises: for the motion, and for the turn of the normal times a's size.
    promised: f64,
    /// Largest turn of the normal in a step, rad.
    turn: f64,
    separation: [f64; 2],
    pivots: f64,
    most_pivots: u32,
}

fn follow(a: &Polytope, b: &Polytope, steps: u32, path: impl Fn(f64) -> Pose) -> Figures {
    let mut scratch = WalkScratch::new();
    let mut figures = Figures { separation: [f64::INFINITY, f64::NEG_INFINITY], ..Figures::default() };
    let mut last: Option<(Placement, Felt)> = None;
    for k in 0..=steps {
        let place = path(f64::from(k) / f64::from(steps)).placement();
        let here = felt(a, b, &place, last.as_ref().map(|last| &last.1), &mut scratch);
        assert!(here.midpoint.is_finite());
        if let Some((before, there)) = last {
            let moved = |v: &DVec3| place.point(*v).distance(before.point(*v));
            let motion = a.vertices().iter().map(moved).fold(0.0, f64::max);
            let step = |p: DVec3, q: DVec3| (p - q).reject_from_normalized(here.normal).length() / motion;
            figures.ratio = figures.ratio.max(step(here.midpoint, there.midpoint));
            figures.exact_ratio = figures.exact_ratio.max(step(here.exact, there.exact));
            let turn = here.normal.angle_between(there.normal);
            let allowed = promise() * motion + 2.0 * a.radius() * turn;
            figures.promised = figures.promised.max(step(here.midpoint, there.midpoint) * motion / allowed);
            figures.turn = figures.turn.max(turn);
        }
        figures.separation[0] = figures.separation[0].min(here.separation);
        figures.separation[1] = figures.separation[1].max(here.separation);
        figures.pivots += f64::from(here.pivots) / f64::from(steps);
        figures.most_pivots = figures.most_pivots.max(here.pivots);
        last = Some((place, here));
    }
    figures
}

/// What the module promises while the normal stays.
fn promise() -> f64 {
    let steepest = 1.26 * SKIRT_SLOPE + 0.5 * ANGLE.tan();
    1.62 * (1.0 + steepest * steepest).sqrt() / ANGLE.tan()
}

#[allow(clippy::print_stderr, reason = "figures for the record")]
fn check(name: &str, figures: &Figures, bound: f64) {
    eprintln!("{name}: {figures:?}");
    assert!(figures.ratio < bound.min(promise()), "{name}: {figures:?}");
}

#[allow(clippy::print_stderr, reason = "figures for the record")]
fn check_turning(name: &str, figures: &Figures) {
    eprintln!("{name}: {figures:?}");
    assert!(figures.promised < 1.0, "{name}: {figures:?}");
}

/// Turned about `axis` by `angle`, with its lowest vertex at height `height`.
fn resting(polytope: &Polytope, turn: DQuat, height: f64) -> Pose {
    let lowest = polytope.vertices().iter().map(|v| (turn * *v).z).fold(f64::INFINITY, f64::min);
    Pose::new(turn, DVec3::Z * (height - lowest))
}

#[test]
fn a_box_tilting_through_flat_on_a_table() {
    let (a, b) = (the_box(), table());
    let tilt = |s: f64| (4.0 * s - 2.0).to_radians();
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        for (way, axis) in [("y", DVec3::Y), ("oblique", DVec3::new(0.6, 0.8, 0.0))] {
            let path = |s: f64| resting(&a, DQuat::from_axis_angle(axis, tilt(s)), height);
            check(&format!("tilt about {way}, {name}"), &follow(&a, &b, 40_000, path), 20.0);
        }
    }
    // The middle stays, the corners go from apart to deep and back.
    let path = |s: f64| Pose::new(DQuat::from_rotation_y(tilt(s)), DVec3::Z * (0.03 + 0.3 * TOLERANCE));
    let figures = follow(&a, &b, 40_000, path);
    assert!(figures.separation[0] < 0.0 && figures.separation[1] > 0.0);
    check("tilt about y, through zero", &figures, 20.0);
}

#[test]
fn a_box_sliding_over_the_edge_of_a_table() {
    let (a, b) = (the_box(), table());
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        for twist in [0.0, 1e-3, 0.1, 3.0, 30.0] {
            let turn = DQuat::from_rotation_z(f64::to_radians(twist));
            // Until little more than the depth overlaps: beyond, the way out is sideways.
            let reach = a.vertices().iter().map(|v| (turn * *v).x).fold(0.0, f64::max);
            let path = |s: f64| Pose::new(turn, DVec3::new(0.1 + (0.099 + reach) * s, 0.01, 0.03 + height));
            check(&format!("slide at {twist}°, {name}"), &follow(&a, &b, 20_000, path), 21.0);
            let path = |s: f64| Pose::new(turn, DVec3::new(0.199 + reach + 0.002 * s, 0.01, 0.03 + height.max(1e-5)));
            // The normal turns by 1 rad while the box moves by the separation, and the witness with it.
            check_turning(&format!("over the edge at {twist}°, {name}"), &follow(&a, &b, 20_000, path));
        }
    }
}

#[test]
fn edges_rolling_over_a_face() {
    let b = table();
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        for sides in [3, 6, 32] {
            let a = prism(sides, 0.02, 0.04);
            for axis in [DVec3::Y, DVec3::new(0.02, 1.0, 0.0).normalize()] {
                let path = |s: f64| {
                    let roll = TAU * s;
                    Pose::new(
                        DQuat::from_axis_angle(axis, roll),
                        resting(&a, DQuat::from_axis_angle(axis, roll), height).translation
                            + DVec3::X * (0.02 * (roll - 3.0)),
                    )
                };
                check(&format!("{sides} sides rolling, {name}"), &follow(&a, &b, 20_000, path), 21.0);
            }
            let path = |s: f64| {
                let roll = DQuat::from_rotation_x((8.0 * s - 4.0).to_radians()) * DQuat::from_rotation_y(0.3);
                resting(&a, roll, height)
            };
            check(&format!("{sides} sides pitching, {name}"), &follow(&a, &b, 20_000, path), 21.0);
        }
    }
}

#[test]
fn edges_crossing_through_parallel() {
    // Two roofs, edge against edge.
    let (a, b) = (prism(4, 0.02, 0.04), prism(4, 0.03, 0.06));
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        for offset in [DVec3::ZERO, DVec3::new(0.0, 0.03, 0.0), DVec3::new(1e-5, 0.02, 0.0)] {
            let path = |s: f64| {
                let turn = DQuat::from_rotation_z((40.0 * s - 20.0).to_radians());
                Pose::new(turn, offset + DVec3::Z * (0.05 + height))
            };
            let figures = follow(&a, &b, 40_000, path);
            if figures.turn < 1e-2 {
                check(&format!("roofs turning at {offset}, {name}"), &figures, 21.0);
            } else {
                // Sideways is the nearer way out as soon as the roofs cross enough.
                check_turning(&format!("roofs turning at {offset}, {name}"), &figures);
            }
        }
    }
    // One edge pitching over the other. (Not deep: there the ways out to both sides tie, and the normal must jump.)
    for offset in [DVec3::ZERO, DVec3::new(0.0, 0.03, 0.0), DVec3::new(1e-5, 0.02, 0.0)] {
        let path = |s: f64| {
            let mut pose = resting(&a, DQuat::from_rotation_x((4.0 * s - 2.0).to_radians()), 0.03 + 0.5 * TOLERANCE);
            pose.translation += offset;
            pose
        };
        check(&format!("roofs pitching at {offset}"), &follow(&a, &b, 40_000, path), 21.0);
    }
}

#[test]
fn a_plate_on_edge_pitching_over_a_table() {
    let corners = [DVec3::new(0.0, -0.04, 0.0), DVec3::new(0.0, 0.04, 0.0), DVec3::new(0.0, 0.03, 0.05)];
    let a = Polytope::from_polygon(corners.to_vec(), DVec3::X, Provenance::Original).unwrap();
    let b = table();
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        let path = |s: f64| resting(&a, DQuat::from_rotation_x((20.0 * s - 10.0).to_radians()), height);
        check(&format!("plate pitching, {name}"), &follow(&a, &b, 20_000, path), 21.0);
        let path = |s: f64| resting(&a, DQuat::from_rotation_y((40.0 * s - 20.0).to_radians()), height);
        check(&format!("plate leaning, {name}"), &follow(&a, &b, 20_000, path), 21.0);
    }
}

/// A random polygon as a plate in z = 0.
fn polygon(random: &mut Random, corners: usize) -> Polytope {
    let mut angles: Vec<f64> = (0..corners).map(|_| TAU * random.unit()).collect();
    angles.sort_by(f64::total_cmp);
    let squeeze = 0.05 + random.unit();
    let points = angles.iter().map(|t| DVec3::new(t.cos(), squeeze * t.sin(), 0.0)).collect();
    Polytope::from_polygon(points, DVec3::Z, Provenance::Original).unwrap()
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn flush_polygons_touch_in_the_middle_of_their_overlap_whatever_the_frame() {
    let mut random = Random(SEED);
    let floor = cuboid(DVec3::new(3.0, 3.0, 0.5));
    let (mut outside, mut spread, mut from_centroid) = (0.0f64, 0.0f64, 0.0f64);
    for round in 0..300 {
        let plate = polygon(&mut random, 3 + round % 4);
        let points = plate.vertices();
        let mut scratch = WalkScratch::new();
        let at = Pose::from_translation(DVec3::Z * 0.5).placement();
        let here = felt(&plate, &floor, &at, None, &mut scratch);
        let middle = here.midpoint - DVec3::Z * here.midpoint.z;
        for k in 0..points.len() {
            let (from, to) = (points[k], points[(k + 1) % points.len()]);
            outside = outside.max((to - from).normalize().cross(DVec3::Z).dot(middle - from));
        }
        from_centroid = from_centroid.max(middle.distance(here.exact - DVec3::Z * here.exact.z));
        // The same with the floor's frame turned.
        let turn = random.turn();
        let moved: Vec<DVec3> = floor.vertices().iter().map(|v| turn * *v).collect();
        let there = (Pose::new(turn, DVec3::ZERO) * Pose::from_translation(DVec3::Z * 0.5)).placement();
        let again = felt(&plate, &solid(&moved), &there, None, &mut scratch);
        spread = spread.max((turn.inverse() * again.midpoint).distance(here.midpoint));
    }
    eprintln!(
        "outside {outside:.4}, spread with the frame {spread:.4}, from the centroid {from_centroid:.4}, of radius 1"
    );
    assert!(outside < 0.02 && spread < 0.15, "seed {SEED:#x}");
}

const SEED: u64 = 0xB1E4D;

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - DVec3::ONE
    }

    fn turn(&mut self) -> DQuat {
        DQuat::from_axis_angle(self.vector().normalize(), TAU * self.unit())
    }
}

#[test]
#[allow(clippy::print_stderr, reason = "figures for the record")]
fn random_pairs_are_blended_where_they_are_flat_and_nowhere_else() {
    let mut random = Random(SEED);
    let mut shapes = vec![the_box(), prism(3, 0.03, 0.05), prism(32, 0.03, 0.002), prism(8, 0.0005, 0.05)];
    for n in [8, 40, 400] {
        let points: Vec<DVec3> = (0..n).map(|_| random.vector().normalize() * DVec3::new(0.05, 0.03, 0.02)).collect();
        shapes.push(solid(&points));
    }
    let mut scratch = WalkScratch::new();
    let (mut exact, mut farthest, mut lift, mut pivots) = (0, 0.0f64, 0.0f64, 0);
    for round in 0..4000 {
        let (a, b) = (&shapes[round % shapes.len()], &shapes[(round / 7) % shapes.len()]);
        let place = Pose::new(random.turn(), random.vector() * 0.06).placement();
        let here = felt(a, b, &place, None, &mut scratch);
        let shift = here.midpoint - here.exact;
        exact += u32::from(shift.length() < 1e-12);
        farthest = farthest.max(shift.length());
        pivots = pivots.max(here.pivots);
        // Along the normal, how far below the moved point does the body begin?
        if here.separation > 0.0 {
            let on_b = here.midpoint - here.normal * (0.5 * here.separation);
            let probe = Polytope::from_polygon(
                [DVec3::X, DVec3::Y, -DVec3::ONE].map(|v| v * 1e-7).to_vec(),
                DVec3::ONE.normalize(),
                Provenance::Original,
            )
            .unwrap();
            let at = Pose::from_translation(on_b).placement();
            if let Proximity::Disjoint(closest) = march(&probe, b, &at, initial_features(&probe, b, &at)).proximity {
                lift = lift.max(closest.distance);
            }
        }
    }
    assert!(exact > 1000 && pivots < 200 && lift < 0.005, "seed {SEED:#x}: {exact} {pivots} {lift}");
    eprintln!("exact in {exact} of 4000, farthest {farthest:.4}, off the body by {lift:.5} at most, pivots {pivots}");
}
