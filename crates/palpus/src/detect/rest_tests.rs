//! Tests queries with hundreds of touching pieces. A sample represents all pairs, and most pairs
//! are not measured. The pressure of the contacts must nearly equal the pressure from a query that
//! measures each pair.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use glam::{DQuat, DVec3};

use super::{Contact, ContactQuery, QuerySettings};
use crate::algebra::{NoClock, Pose, Work};
use crate::body::{Body, BodySettings, Mesh, PolygonSoup};

/// Number of cells along a side of the board.
const CELLS: usize = 36;
/// Length of a cell, m.
const CELL: f64 = 1e-3;
/// Height of the waves, m.
const HEIGHT: f64 = 1e-4;
/// Contact tolerance, m.
const TOLERANCE: f64 = 1e-5;
/// The vertex near the middle that a test raises.
const BURR: usize = 17 * (CELLS + 1) + 20;

/// Returns a board with waves in both directions, on its upper side if `up`, otherwise on its lower
/// side. The two boards fit onto each other.
fn board(up: bool) -> Arc<Body> {
    board_with(up, 0.0)
}

/// Returns a [`board`] whose vertex [`BURR`] is raised by `burr` (m).
fn board_with(up: bool, burr: f64) -> Arc<Body> {
    board_of(CELLS, up, burr)
}

/// Returns such a board with this number of cells along a side.
fn board_of(cells: usize, up: bool, burr: f64) -> Arc<Body> {
    let mut soup = PolygonSoup::new();
    let place = |k: usize| (k as f64 - 0.5 * cells as f64) * CELL;
    let wave = |x: f64, y: f64| HEIGHT * ((x * TAU / 8e-3).sin() + (y * TAU / 7e-3).sin());
    let flat = if up { -3e-3 } else { 3e-3 };
    let side = cells + 1;
    for k in 0..side * side {
        let (x, y) = (place(k / side), place(k % side));
        let raised = if k == BURR { burr } else { 0.0 };
        soup.vertices.push(DVec3::new(x, y, wave(x, y) + raised));
    }
    let flats = soup.vertices.len();
    soup.vertices.extend((0..side * side).map(|k| DVec3::new(place(k / side), place(k % side), flat)));
    let mut face = |corners: &[usize]| {
        let mut corners: Vec<u32> = corners.iter().map(|&k| k as u32).collect();
        if !up {
            corners.reverse();
        }
        soup.push_face(&corners);
    };
    let at = |i: usize, j: usize| i * side + j;
    for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        face(&[a, b, c]);
        face(&[a, c, d]);
        face(&[flats + d, flats + c, flats + b, flats + a]);
    }
    for k in 0..cells {
        let walls = [
            [at(k, 0), at(k + 1, 0)],
            [at(cells, k), at(cells, k + 1)],
            [at(k + 1, cells), at(k, cells)],
            [at(0, k + 1), at(0, k)],
        ];
        for [from, to] in walls {
            face(&[flats + from, flats + to, to, from]);
        }
    }
    let (mesh, _) = Mesh::from_soup(&soup).unwrap();
    assert!(mesh.is_closed());
    Arc::new(Body::build(mesh, &BodySettings::default(), &mut |_| ()).unwrap())
}

/// Returns a pose in which the boards overlap by 10 µm. From tick to tick they slide by at most 5
/// µm and turn a little.
fn pose(tick: u32) -> Pose {
    let phase = f64::from(tick) * 0.05;
    let slide = DVec3::new(1e-4 * phase.sin(), 5e-5 * (0.7 * phase).sin(), -1e-5);
    Pose::new(DQuat::from_rotation_z(1e-3 * (0.4 * phase).sin()), slide)
}

/// Returns the mean of the normals, the mean of the points, and the deepest separation (m). The
/// weight of a contact is its count times its engagement.
fn pressure(contacts: &[Contact]) -> (DVec3, DVec3, f64) {
    let load = |contact: &Contact| contact.count * (TOLERANCE - contact.separation);
    let whole: f64 = contacts.iter().map(load).sum();
    let mean = |of: fn(&Contact) -> DVec3| contacts.iter().map(|c| of(c) * load(c)).sum::<DVec3>() / whole;
    let deepest = contacts.iter().map(|c| c.separation).fold(f64::INFINITY, f64::min);
    (mean(|contact| contact.normal), mean(Contact::midpoint), deepest)
}

#[test]
fn sample_gives_nearly_the_full_pressure() {
    let (lower, upper) = (board(true), board(false));
    let settings = QuerySettings { tolerance: TOLERANCE, capacity: 8192, ..QuerySettings::default() };
    let mut whole = ContactQuery::new(upper.clone(), lower.clone(), settings);
    let mut sampled = ContactQuery::new(upper, lower, QuerySettings { holding: true, ..settings });
    let (mut walks, mut all_walks) = (0, 0);
    let (mut tilt, mut shift, mut depth) = (0.0f64, 0.0f64, 0.0f64);
    for tick in 0..200 {
        let pose = pose(tick);
        let counters = *sampled.run(&pose, &NoClock);
        let (normal, place, deepest) = pressure(sampled.found());
        all_walks += whole.run(&pose, &NoClock).walks;
        walks += counters.walks;
        let (true_normal, true_place, truly_deepest) = pressure(whole.found());
        assert!(whole.found().len() > 600, "{} contacts", whole.found().len());
        assert!(sampled.found().len() < 350, "{} contacts", sampled.found().len());
        assert_eq!(counters.held, 0, "the quota suffices");
        tilt = tilt.max(normal.distance(true_normal));
        shift = shift.max(place.distance(true_place) / (CELLS as f64 * CELL));
        depth = depth.max((deepest - truly_deepest).abs() / (TOLERANCE - truly_deepest));
    }
    assert!(tilt < 0.01 && shift < 0.08 && depth < 0.1, "tilt {tilt}, shift {shift}, depth {depth}");
    assert!(6 * walks < all_walks, "{walks} of {all_walks}");
}

#[test]
fn burr_outside_the_sample_is_found() {
    let burr = 3e-5;
    let (lower, upper) = (board_with(true, burr), board(false));
    let settings = QuerySettings { tolerance: TOLERANCE, capacity: 8192, holding: true, ..QuerySettings::default() };
    let mut query = ContactQuery::new(upper, lower, settings);
    for tick in 0..200 {
        query.run(&pose(tick), &NoClock);
        let burr_found = query.found().iter().any(|contact| contact.separation < -0.9 * burr && contact.count >= 1.0);
        assert!(burr_found, "tick {tick}");
    }
}

#[test]
fn few_contacts_are_measured_in_each_query() {
    let (lower, upper) = (board(true), board(false));
    let settings = QuerySettings { tolerance: TOLERANCE, ..QuerySettings::default() };
    let mut query = ContactQuery::new(upper, lower, QuerySettings { holding: true, ..settings });
    for tick in 0..50 {
        // The boards touch at one end only.
        let tilt = DQuat::from_rotation_y(0.01);
        let tilted = Pose::new(tilt, DVec3::new(1e-6 * f64::from(tick), 0.0, 1.6e-4));
        let counters = *query.run(&tilted, &NoClock);
        assert!(!query.found().is_empty() && query.found().len() < 128, "{}", query.found().len());
        assert_eq!(counters.traversal.resting, 0);
    }
}

/// Three threads take part in the queries of one of two equal pairs of boards.
#[test]
fn helpers_change_no_bit() {
    let (lower, upper) = (board_of(96, true, 0.0), board_of(96, false, 0.0));
    let settings = QuerySettings { tolerance: TOLERANCE, capacity: 8192, holding: true, ..QuerySettings::default() };
    let settings = QuerySettings { guard: true, patch_angle: Some(0.02), ..settings };
    let [mut alone, mut helped] = [(); 2].map(|()| ContactQuery::new(upper.clone(), lower.clone(), settings));
    let helper = helped.helper();
    assert!(helper.is_useful());
    let stop = AtomicBool::new(false);
    let parts = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) {
                    match helper.help() {
                        true => _ = parts.fetch_add(1, Ordering::Relaxed),
                        false => std::thread::yield_now(),
                    }
                }
            });
        }
        let failed = (0..150).find(|&tick| {
            // A part of the ticks has a limit of work, and some ticks jump.
            let work = Work::of((tick % 5 == 4).then_some(3000));
            let pose = pose(if tick % 40 == 39 { 3 * tick } else { tick });
            let counters = *alone.run_within(&pose, &work.all(), &NoClock);
            let work = Work::of((tick % 5 == 4).then_some(3000));
            let same = *helped.run_within(&pose, &work.all(), &NoClock) == counters;
            !same || alone.found() != helped.found() || alone.unseen_separation() != helped.unseen_separation()
        });
        stop.store(true, Ordering::Relaxed);
        assert_eq!(failed, None, "the first tick with other results");
    });
    assert!(parts.into_inner() > 0, "no helper had a part");
}

#[test]
fn query_without_history_is_not_divided() {
    let (lower, upper) = (board(true), board(false));
    let settings = QuerySettings { tolerance: TOLERANCE, ..QuerySettings::default() };
    assert!(!ContactQuery::new(upper, lower, settings).helper().is_useful());
}

#[test]
fn clone_of_a_query_gives_the_same_results() {
    let (lower, upper) = (board_with(true, 3e-5), board(false));
    let settings = QuerySettings { tolerance: TOLERANCE, capacity: 8192, holding: true, ..QuerySettings::default() };
    let mut query = ContactQuery::new(upper, lower, settings);
    let mut copy = query.clone();
    for tick in 0..60 {
        assert_eq!(query.contacts(&pose(tick)), copy.contacts(&pose(tick)), "tick {tick}");
        if tick == 30 {
            copy = query.clone();
        }
    }
}
