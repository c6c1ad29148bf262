//! Tests steps with limited work. Forces must stay finite, bounded, continuous and near the full
//! result, and must reach the full result when the motion stops.

mod bodies;

use std::path::Path;
use std::sync::Arc;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, PolygonSoup};
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::render::{Clustering, Limits, ProbeState, Renderer, Settings, Tick, VirtualCoupling, WorkLimit};
use palpus_scenes::{scene, tour};

/// Differences between a run with limited work and a run without a limit.
#[derive(Debug, Default)]
struct Outcome {
    ticks: u32,
    late: u32,
    held: u32,
    unseen: u32,
    /// Largest force of the full result, N.
    most: f64,
    /// Largest difference from the full result, N.
    worst: f64,
    /// Mean difference from the full result, N.
    mean: f64,
    /// Largest change of the force from tick to tick with the limit, N.
    jump: f64,
    /// Largest change of the force from tick to tick without the limit, N.
    full_jump: f64,
    /// Number of contacts of the full result.
    contacts: u32,
    /// Number of contacts that the limited result lacks.
    lacking: u32,
    /// Number of lacking contacts that are nearer than the reported unseen separation.
    missing: u32,
    /// Number of pairs whose separations are compared.
    compared: u32,
    /// Largest excess of a reported separation over the distance of the pieces, m.
    too_far: f64,
}

/// Cosine of one degree.
const SAME_DIRECTION: f64 = 0.99985;

/// Compares the contacts of the limited tick with the full result, for each pair of pieces.
fn compare_contacts(tick: &Tick, full: &Tick, outcome: &mut Outcome) {
    for contact in &full.contacts {
        outcome.contacts += 1;
        let same = |held: &&Contact| (held.piece_a, held.piece_b) == (contact.piece_a, contact.piece_b);
        if !tick.contacts.iter().any(|held| same(&held)) {
            outcome.lacking += 1;
            outcome.missing += u32::from(contact.separation < tick.unseen_separation);
        }
    }
}

/// Compares the separations of the limited tick with the distances of the pieces. A contact in
/// another direction is at another place of the pieces, and counts as lacking.
fn compare_separations(tick: &Tick, distances: &[Contact], outcome: &mut Outcome) {
    // For overlapping pieces, the two results may be depths along different normals.
    for exact in distances.iter().filter(|exact| exact.separation > 0.0) {
        let same = |held: &&Contact| (held.piece_a, held.piece_b) == (exact.piece_a, exact.piece_b);
        let held = tick.contacts.iter().filter(same);
        let nearest = held.min_by(|one, other| one.separation.total_cmp(&other.separation));
        match nearest {
            Some(held) if held.normal.dot(exact.normal) > SAME_DIRECTION => {
                outcome.compared += 1;
                outcome.too_far = outcome.too_far.max(held.separation - exact.separation);
            }
            Some(_) => outcome.lacking += 1,
            None => {}
        }
    }
}

fn compare(a: &Arc<Body>, b: &Arc<Body>, settings: Settings, work: u64, poses: &[Pose]) -> Outcome {
    let limits = Limits { force: f64::INFINITY, torque: f64::INFINITY };
    // Single linkage is not continuous. Without linkage, forces differ only as much as contacts
    // differ.
    let settings = Settings { limits, cluster_radius: 0.0, ..settings };
    let mut full = Renderer::new(a.clone(), b.clone(), settings).expect("valid settings");
    let mut hurried = Renderer::new(a.clone(), b.clone(), settings).expect("valid settings");
    hurried.allow(WorkLimit::Units(work));
    // The first step starts at the roots of the hierarchies, so it is not compared.
    for _ in 0..400 {
        hurried.step(&ProbeState::at(poses[0]), 1e-3, &NoClock);
    }
    full.step(&ProbeState::at(poses[0]), 1e-3, &NoClock);
    let within = QuerySettings { tolerance: settings.contact_tolerance, ..QuerySettings::default() };
    let mut judge = ContactQuery::new(a.clone(), b.clone(), within);
    let mut outcome = Outcome::default();
    let (mut last, mut full_last): (Option<DVec3>, Option<DVec3>) = (None, None);
    for pose in poses {
        let expected = full.step(&ProbeState::at(*pose), 1e-3, &NoClock);
        let tick = hurried.step(&ProbeState::at(*pose), 1e-3, &NoClock);
        let (force, full_force) = (tick.commanded.force, expected.commanded.force);
        assert!(tick.commanded.is_finite() && tick.counters.non_finite_wrench == 0);
        assert_eq!(tick.is_late(), tick.counters.query.traversal.postponed > 0);
        assert!(tick.is_late() || tick.unseen_separation == f64::INFINITY);
        outcome.ticks += 1;
        outcome.late += u32::from(tick.is_late());
        outcome.held += tick.counters.query.held;
        outcome.unseen += tick.counters.query.unseen;
        outcome.most = outcome.most.max(full_force.length());
        outcome.worst = outcome.worst.max(force.distance(full_force));
        outcome.mean += force.distance(full_force);
        outcome.jump = outcome.jump.max(last.map_or(0.0, |last| last.distance(force)));
        outcome.full_jump = outcome.full_jump.max(full_last.map_or(0.0, |last| last.distance(full_force)));
        compare_contacts(tick, expected, &mut outcome);
        compare_separations(tick, judge.contacts(pose), &mut outcome);
        (last, full_last) = (Some(force), Some(full_force));
    }
    outcome.mean /= f64::from(outcome.ticks);
    outcome
}

#[test]
fn limited_work_gives_nearly_the_same_force() {
    for name in ["torus-torus", "spoon-cup"] {
        let scene = scene(name).expect("a built-in scene");
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        let settings = Settings {
            contact_tolerance: scene.contact.tolerance,
            stiffness: scene.contact.stiffness,
            ..Settings::default()
        };
        let ticks = 1500;
        let begin = 0.3 * scene.path.duration();
        let poses: Vec<Pose> = (0..ticks).map(|k| scene.path.pose(begin + f64::from(k) * 1e-3)).collect();
        let outcome = compare(&a, &b, settings, 40, &poses);
        assert!(outcome.late > 100 && outcome.held > 500, "{name}: {outcome:?}");
        assert_near(&outcome, name);
    }
}

/// Returns the settings of a tool behind a coupling, for contacts nearer than `tolerance` (m).
fn coupled(tolerance: f64) -> Settings {
    let limits = Settings::default().limits;
    Settings {
        contact_tolerance: tolerance,
        stiffness: VirtualCoupling::contact_stiffness(&limits, tolerance).expect("the device has a force limit"),
        coupling: Some(VirtualCoupling::tuned(&limits, 1e-3, tolerance)),
        ..Settings::default()
    }
}

/// Speed of the device, m/s.
const SLAM: f64 = 1.6;

#[test]
fn tool_waits_for_pairs_not_yet_queried() {
    for name in ["torus-torus", "peg-hole", "spoon-cup"] {
        let scene = scene(name).expect("a built-in scene");
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        let tolerance = scene.contact.tolerance;
        let mut renderer = Renderer::new(a.clone(), b.clone(), coupled(tolerance)).expect("valid settings");
        let settings = QuerySettings { tolerance, ..QuerySettings::default() };
        let mut judge = ContactQuery::new(a.clone(), b.clone(), settings);
        let start = scene.path.pose(0.0);
        let goal = scene.path.pose(0.5 * scene.path.duration());
        let way = (goal.translation - start.translation).normalize_or(DVec3::NEG_Z);
        renderer.allow(WorkLimit::Units(12));
        let (mut deepest, mut waited, mut late) = (0.0f64, 0, 0);
        for k in 0..400 {
            let ahead = (f64::from(k) * 1e-3 * SLAM).min(0.1);
            let pose = Pose { translation: start.translation + way * ahead, ..start };
            let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
            waited += tick.counters.tool.bounded;
            late += u32::from(tick.is_late());
            deepest = judge.contacts(&tick.tool_ba).iter().fold(deepest, |most, contact| most.max(-contact.separation));
        }
        assert!(late > 3 && waited > 3, "{name}: {late} late, {waited} waited");
        // The measured depth is 0.07 mm in the hole, where the tool slowly continues along the
        // wall. In the other scenes there is no overlap.
        assert!(deepest < 1e-4, "{name}: {deepest} m deep");
    }
}

#[test]
fn tool_that_is_lifted_off_a_face_is_not_held() {
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models/pairs"));
    let read = |name: &str| obj(&models.join(name));
    let (Ok(a), Ok(b)) = (read("gear_medium.obj"), read("gear_large.obj")) else { return };
    let (a, b) = (body(&a), body(&b));
    let settings = Settings { patch_angle: Some(5f64.to_radians()), ..coupled(0.01 * b.size()) };
    // The hand lowers a gear onto another at 60 mm/s, presses it with 1.2 N, and lifts it off.
    let height = |k: u32| 0.0248 - 6e-5 * f64::from(k.min(100)) + 6e-5 * f64::from(k.saturating_sub(400));
    // A loop at 1 kHz has time for about 1000 units. The landing lasts for some hundred steps.
    for work in [650, 1000, 2000] {
        let mut renderer = Renderer::new(a.clone(), b.clone(), settings).expect("valid settings");
        renderer.allow(WorkLimit::Units(work));
        let (mut last, mut largest, mut deepest, mut late, mut unused) = (DVec3::ZERO, 0.0f64, 0.0f64, 0, 0);
        let mut most = 0;
        for k in 0..600 {
            let pose = Pose::from_translation(DVec3::new(-0.0505, 0.0, height(k)));
            let tick = renderer.step(&ProbeState::at(pose), 1e-3, &NoClock);
            let force = tick.commanded.force;
            largest = largest.max(force.distance(last));
            deepest = tick.contacts.iter().fold(deepest, |most, contact| most.max(-contact.separation));
            late += u32::from(tick.is_late());
            most = most.max(tick.work);
            unused += u32::from(tick.is_late() && tick.work < work * 3 / 4);
            last = force;
        }
        // Measured: 1.5 times the allowed work. It was 4.2 times when the gaps of all due pairs
        // were bounded in each query, also while the gears parted.
        assert!(most < 2 * work, "{work}: {most} in a step");
        // Measured: 0.2 N at most. It was 3.4 N when each part of the query had a fixed share of
        // the work, and when unexamined surfaces stopped a motion in any direction.
        assert!(largest < 0.3, "{work}: {largest} N in a step");
        assert!(late > 200 && unused < 25, "{work}: {late} late, {unused} of them with work left");
        // Measured: 0.4 mm. It was 35 mm when a rejected depth was replaced by a contact without a
        // bound, because the query before had not seen all pairs.
        assert!(deepest < 1e-3, "{work}: {deepest} m deep");
    }
}

/// Seed of the tour.
const TOUR: u64 = 0x1A4D;

#[test]
fn tool_that_lands_on_a_fine_mesh_is_not_held_back() {
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models/parts"));
    // The models are in mm and in cm.
    let read = |name: &str, unit: f64| {
        let mut soup = obj(&models.join(name))?;
        soup.vertices.iter_mut().for_each(|vertex| *vertex *= unit);
        Ok::<_, std::io::Error>(body(&soup))
    };
    let (Ok(a), Ok(b)) = (read("plate_holes.obj", 1e-3), read("fandisk.obj", 1e-2)) else { return };
    let tolerance = 0.01 * b.size();
    let settings =
        Settings { patch_angle: Some(5f64.to_radians()), clustering: Clustering::Smooth, ..coupled(tolerance) };
    let start = Pose::from_translation(DVec3::new(-0.0775, 0.0, 0.2));
    let path = tour(&a, &b, start, tolerance, TOUR).expect("the plate reaches the fan disk");
    for work in [1000, 2000, 3000] {
        let mut renderer = Renderer::new(a.clone(), b.clone(), settings).expect("valid settings");
        renderer.allow(WorkLimit::Units(work));
        let (mut last, mut largest, mut late) = (DVec3::ZERO, 0.0f64, 0);
        // The hand moves at 0.2 m/s, five times the speed of the path.
        for k in 0..4000 {
            let tick = renderer.step(&ProbeState::at(path.pose(5e-3 * f64::from(k))), 1e-3, &NoClock);
            let force = tick.commanded.force;
            largest = largest.max(force.distance(last));
            late += u32::from(tick.is_late());
            last = force;
        }
        // Measured: 0.6 N. It was 1.6 N when the query searched twice as far after each long step,
        // also where its work did not suffice: the tool crept and caught up by turns.
        assert!(largest < 0.7, "seed {TOUR:#x}, {work}: {largest} N in a step");
        assert!(late > 30, "seed {TOUR:#x}, {work}: {late} late");
    }
}

#[test]
fn armadillo_keeps_its_force_with_a_third_of_the_work() {
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models/paper"));
    let read = |name: &str| obj(&models.join(name));
    let (Ok(a), Ok(b)) = (read("armadillo_31240.obj"), read("intestine_colon_male_24846.obj")) else { return };
    let (a, b) = (body(&a), body(&b));
    let settings = Settings { contact_tolerance: 0.01 * b.size(), ..Settings::default() };
    // The armadillo's belly is pressed against the colon's bulge and slides at about 0.1 m/s, for a
    // probe of 10 cm.
    let middle = |body: &Body| body.mesh().bounds().min.midpoint(body.mesh().bounds().max);
    let way = DVec3::new(1.0, 0.3, 0.2).normalize();
    let within = QuerySettings { tolerance: settings.contact_tolerance, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), within);
    let (mut near, mut far) = (0.0, a.size() + b.size());
    for _ in 0..30 {
        let half = 0.5 * (near + far);
        let pose = Pose::from_translation(middle(&b) - middle(&a) + way * half);
        let overlap = query.contacts(&pose).iter().any(|contact| contact.separation < 0.0);
        if overlap { near = half } else { far = half }
    }
    let pose = |k: u32| {
        let phase = std::f64::consts::TAU * f64::from(k) / 700.0;
        let slide = way.cross(DVec3::Z).normalize() * phase.sin() - way * 0.4 * (1.0 - phase.cos());
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.5, 1.0) * 0.02 * phase.sin());
        Pose::new(turn, middle(&b) - turn * middle(&a) + way * far + slide * 0.01 * b.size())
    };
    let poses: Vec<Pose> = (0..700).map(pose).collect();
    let outcome = compare(&a, &b, settings, 800, &poses);
    assert!(outcome.late > 600, "{outcome:?}");
    assert_near(&outcome, "the armadillo");
}

/// Asserts the guaranteed bounds. In the scenes, where the work suffices for a few pairs, the
/// measured errors are 0.13 at most and 0.010 on average, relative to the largest force. On the
/// armadillo, where the work suffices for a third of 140 pairs, they are 0.04 at most and 0.006 on
/// average.
///
/// A contact is lacking if it has moved to a neighbouring piece since its pair was queried (9 % in
/// the cup). Usually that neighbour's contact is present. Up to 7 % of the contacts are lacking and
/// also nearer than the reported unseen separation. A separation is too large if the contact's
/// points have slid along a tilted face.
fn assert_near(outcome: &Outcome, what: &str) {
    assert!(outcome.worst <= 0.2 * outcome.most, "{what}: {outcome:?}");
    assert!(outcome.mean <= 0.02 * outcome.most, "{what}: {outcome:?}");
    assert!(outcome.jump <= 1.6 * outcome.full_jump, "{what}: {outcome:?}");
    assert!(outcome.lacking * 10 <= outcome.contacts, "{what}: {outcome:?}");
    assert!(outcome.missing * 12 <= outcome.contacts, "{what}: {outcome:?}");
    assert!(outcome.compared * 50 >= outcome.contacts, "{what}: {outcome:?}");
    assert!(outcome.too_far <= 6e-5, "{what}: {outcome:?}");
}

fn obj(path: &Path) -> std::io::Result<PolygonSoup> {
    let text = std::fs::read_to_string(path)?;
    let mut soup = PolygonSoup::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let mut number = || words.next().and_then(|word| word.parse().ok()).unwrap_or(f64::NAN);
                soup.vertices.push(DVec3::new(number(), number(), number()));
            }
            Some("f") => {
                let corner =
                    |word: &str| word.split('/').next().and_then(|k| k.parse::<u32>().ok()).map_or(0, |k| k - 1);
                soup.push_face(&words.map(corner).collect::<Vec<_>>());
            }
            _ => {}
        }
    }
    Ok(soup)
}
