//! Tests open surfaces: they are felt from both sides, and along their rims.

mod bodies;

use std::f64::consts::TAU;
use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose, Random};
use palpus::body::{Body, PolygonSoup};
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::render::{Limits, ProbeState, Renderer, Settings};
use palpus_scenes::shape::cuboid;

const SEED: u64 = 0x5EE7;
/// Contact tolerance, m.
const TOLERANCE: f64 = 2e-3;
/// Number of cells along each side of a surface.
const CELLS: usize = 24;

/// Returns a surface of triangles over the unit square. Cells for which `is_hole` is true are
/// missing. `other_side` turns all triangles over.
fn surface(at: impl Fn(f64, f64) -> DVec3, is_hole: impl Fn(usize, usize) -> bool, other_side: bool) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    let share = |k: usize| k as f64 / CELLS as f64;
    for i in 0..=CELLS {
        soup.vertices.extend((0..=CELLS).map(|j| at(share(i), share(j))));
    }
    let vertex = |i: usize, j: usize| (i * (CELLS + 1) + j) as u32;
    for (i, j) in (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j))).filter(|&(i, j)| !is_hole(i, j)) {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        for [p, q, r] in [[a, b, c], [a, c, d]] {
            soup.push_face(&if other_side { [r, q, p] } else { [p, q, r] });
        }
    }
    body(&soup)
}

/// Returns a wavy sheet of 60 mm.
fn wavy(x: f64, y: f64) -> DVec3 {
    DVec3::new(0.06 * x - 0.03, 0.06 * y - 0.03, 4e-3 * (7.0 * x + 1.0).sin() * (5.0 * y).cos())
}

/// Returns most of a tube of 24 mm.
fn tube(x: f64, y: f64) -> DVec3 {
    let angle = 0.9 * TAU * x;
    DVec3::new(0.012 * angle.cos(), 0.012 * angle.sin(), 0.06 * y - 0.03)
}

/// The surfaces, as they are and turned over.
fn sheets() -> Vec<(&'static str, [Arc<Body>; 2])> {
    let no_hole = |_, _| false;
    let holes = |i: usize, j: usize| i % 4 == 2 && j % 4 == 1;
    let both = |of: &dyn Fn(bool) -> Arc<Body>| [of(false), of(true)];
    vec![
        ("a wavy sheet", both(&|other| surface(wavy, no_hole, other))),
        ("a wavy sheet with holes", both(&|other| surface(wavy, holes, other))),
        ("a tube with a slot", both(&|other| surface(tube, no_hole, other))),
    ]
}

fn random_pose(random: &mut Random) -> Pose {
    let place = DVec3::new(random.signed(), random.signed(), random.signed()) * 0.035;
    Pose::new(DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0)), place)
}

/// Returns separation, normal and point of each contact, sorted.
fn sorted(contacts: &[Contact]) -> Vec<[f64; 7]> {
    let mut all: Vec<[f64; 7]> = contacts
        .iter()
        .map(|c| {
            let ([nx, ny, nz], [x, y, z]) = (c.normal.to_array(), c.midpoint().to_array());
            // Rounded, so that the order does not depend on rounding errors.
            [c.separation, nx, ny, nz, x, y, z].map(|value| (value * 1e8).round() * 1e-8)
        })
        .collect();
    all.sort_by(|one, other| {
        one.iter().zip(other).map(|(x, y)| x.total_cmp(y)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    });
    all
}

#[test]
fn nearest_points_are_a_contact_on_both_sides_and_at_the_rim() {
    let block = body(&cuboid(DVec3::new(6e-3, 9e-3, 4e-3)));
    let settings = QuerySettings { tolerance: TOLERANCE, ..QuerySettings::default() };
    let mut random = Random::new(SEED);
    for (what, sides) in sheets() {
        let mut queries = sides.map(|sheet| ContactQuery::new(block.clone(), sheet, settings));
        let mut near = 0;
        for _ in 0..4000 {
            let pose = random_pose(&mut random);
            for query in &mut queries {
                query.clear();
                let Some(nearest) = query.nearest(&pose) else { panic!("{what}: nothing near, seed {SEED:#x}") };
                if nearest.separation <= 0.0 || nearest.separation > 0.99 * TOLERANCE {
                    continue;
                }
                near += 1;
                let least = query.found().iter().map(|contact| contact.separation).fold(f64::INFINITY, f64::min);
                assert!((least - nearest.separation).abs() < 1e-9, "{what}: {least} and {nearest:?}, seed {SEED:#x}");
            }
        }
        assert!(near > 200, "{what}: {near}");
    }
}

#[test]
fn contacts_do_not_depend_on_the_side_that_the_file_calls_outside() {
    let block = body(&cuboid(DVec3::new(6e-3, 9e-3, 4e-3)));
    let settings = QuerySettings { tolerance: TOLERANCE, ..QuerySettings::default() };
    let mut random = Random::new(SEED ^ 1);
    for (what, sides) in sheets() {
        let mut queries = sides.map(|sheet| ContactQuery::new(block.clone(), sheet, settings));
        let mut touching = 0;
        for _ in 0..1000 {
            let pose = random_pose(&mut random);
            let [one, other] = queries.each_mut().map(|query| {
                query.clear();
                sorted(query.contacts(&pose))
            });
            touching += usize::from(!one.is_empty());
            assert_eq!(one.len(), other.len(), "{what} at {pose:?}, seed {SEED:#x}");
            for (x, y) in one.as_flattened().iter().zip(other.as_flattened()) {
                assert!((x - y).abs() < 3e-8, "{what} at {pose:?}: {one:?} and {other:?}, seed {SEED:#x}");
            }
        }
        assert!(touching > 100, "{what}: {touching}");
    }
}

/// A long bar overlaps a sheet that is much smaller. All contacts must be at the sheet, not at a
/// distant corner of the bar.
#[test]
fn depths_in_a_sheet_are_at_the_sheet() {
    let bar = body(&cuboid(DVec3::new(0.1, 0.07, 4e-3)));
    let settings = QuerySettings { patch_angle: Some(0.1), ..QuerySettings::default() };
    let mut random = Random::new(SEED ^ 2);
    for (what, sides) in sheets() {
        for sheet in sides {
            let mut queries =
                [[&bar, &sheet], [&sheet, &bar]].map(|[a, b]| ContactQuery::new(a.clone(), b.clone(), settings));
            let mut overlaps = 0;
            for _ in 0..300 {
                let reach =
                    DVec3::new(random.signed(), random.signed(), random.signed()) * DVec3::new(0.06, 0.05, 5e-3);
                let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0));
                let at = DVec3::new(random.signed(), random.signed(), 0.0) * 0.03;
                let pose = Pose::new(turn, at + turn * reach);
                for (query, (pose_ba, to_sheet)) in
                    queries.iter_mut().zip([(pose, Pose::IDENTITY), (pose.inverse(), pose)])
                {
                    query.clear();
                    for contact in query.contacts(&pose_ba).iter().filter(|contact| contact.separation < 1e-5) {
                        overlaps += 1;
                        let off = [contact.point_a, contact.point_b]
                            .map(|point| sheet.tree().nearest(to_sheet.point(point)).unwrap().distance);
                        let off = off[0].min(off[1]);
                        // Beside a valley, a contact may be off the sheet by the tolerance.
                        assert!(
                            off <= 2.0 * contact.separation.abs() + settings.tolerance,
                            "{what}: a contact is {off} m beside it, {contact:?}, seed {SEED:#x}"
                        );
                    }
                }
            }
            assert!(overlaps > 1000, "{what}: {overlaps}");
        }
    }
}

/// Two open surfaces cross each other in small steps. They have no inside that could confirm a
/// depth, but a depth cannot grow faster than the surfaces move.
#[test]
fn depths_between_open_surfaces_grow_with_the_motion() {
    let [wavy, holes, tube] = sheets().try_into().map(|all: [_; 3]| all.map(|(_, [sheet, _])| sheet)).unwrap();
    let settings = QuerySettings { patch_angle: Some(0.1), ..QuerySettings::default() };
    let mut random = Random::new(SEED ^ 3);
    for (one, other) in [(&holes, &tube), (&wavy, &holes), (&tube, &tube)] {
        let mut query = ContactQuery::new(one.clone(), other.clone(), settings);
        let mut deep = 0;
        for _ in 0..10 {
            query.clear();
            let turn = DQuat::from_axis_angle(random.direction(), random.between(0.0, 3.0));
            let (from, axis) = (random.direction() * 0.09, random.direction());
            let mut last = 0.0_f64;
            for tick in 0..600 {
                let time = 1e-3 * f64::from(tick);
                let pose = Pose::new(DQuat::from_axis_angle(axis, time) * turn, from * (1.0 - 2.0 * time));
                let least = query.contacts(&pose).iter().map(|contact| contact.separation).fold(0.0, f64::min);
                // The corners of the sheets are at most 45 mm from their origins. A depth may
                // exceed the motion by a quarter, and by the tolerance.
                let motion = 1e-3 * (2.0 * 0.09 + 0.045);
                let most = 1.25 * (last + motion) + 1.1 * settings.tolerance;
                assert!(-least < most, "{last} m, then {} m, seed {SEED:#x}", -least);
                deep += u32::from(least < -1e-4);
                last = -least;
            }
        }
        assert!(deep > 100, "{deep}");
    }
}

/// A block inside the tube is pressed against the wall, turned around along it, and taken away.
#[test]
fn a_tube_is_felt_from_inside() {
    let block = body(&cuboid(DVec3::splat(2e-3)));
    let limits = Limits { force: 8.5, torque: 0.19 };
    let settings = Settings::coupled(limits, 1e-3, 1e-4);
    for sheet in [false, true].map(|other_side| surface(tube, |_, _| false, other_side)) {
        let mut renderer = Renderer::new(block.clone(), sheet, settings).unwrap();
        let (mut last, mut most) = (DVec3::ZERO, 0.0_f64);
        for tick in 0..4000 {
            let time = f64::from(tick) * 1e-3;
            // Radius and angle of the hand.
            let out = (0.02 * time).min(0.02 * (4.0 - time)).min(0.0125);
            let angle = 0.4 + 0.8 * TAU * time / 4.0;
            let pose = Pose::from_translation(DVec3::new(out * angle.cos(), out * angle.sin(), 0.01 * (time - 2.0)));
            let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
            let force = tick.commanded.force;
            assert!(force.distance(last) < 0.1, "{} N in a tick at {time} s", force.distance(last));
            if force.length() > 0.1 {
                let inward = -DVec3::new(angle.cos(), angle.sin(), 0.0);
                assert!(force.normalize().dot(inward) > 0.6, "{force} at {time} s");
            }
            (last, most) = (force, most.max(force.length()));
        }
        assert!(most > 1.0 && most < 4.0 && last.length() < 1e-6, "{most} N");
    }
}
