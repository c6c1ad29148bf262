//! Tests that front tracking gives the same results as the full traversal, in every scene and for
//! every kind of motion.

mod bodies;
mod judge;

use std::path::Path;

use bodies::body;
use glam::{DQuat, DVec3};
use palpus::algebra::{Placement, Pose, Random};
use palpus::body::Body;
use palpus::collision::{Front, LeafPairs, PlacedPair, Side, TraversalCounters};
use palpus_scenes::{Scene, scene, scenes};

/// Seed of all random numbers here.
const SEED: u64 = 0xf207_7e57;

/// Uncertainty of the tolerance, relative to the bodies' size. Hulls may be smaller than their
/// bodies by the merge distance. So if a distance differs from the tolerance by less than this,
/// both results are allowed.
const SLACK: f64 = 1e-8;

/// Allowed difference of two distance searches with different starts, relative to the bodies' size.
const ROUNDING: f64 = 1e-11;

/// Number of ticks between two searches for the nearest pair.
const NEAREST_EVERY: usize = 7;

fn side(body: &Body) -> Side<'_> {
    Side { hierarchy: body.hierarchy(), pieces: body.polytopes() }
}

/// Returns the pairs in the order of their pieces.
fn sorted(mut pairs: Vec<(u32, u32, f64)>) -> Vec<(u32, u32, f64)> {
    pairs.sort_by_key(|pair| (pair.0, pair.1));
    pairs
}

/// Compares the results of front tracking and full traversal tick by tick.
struct Duel<'a> {
    a: &'a Body,
    b: &'a Body,
    front: Front,
    by_front: LeafPairs,
    ticks: usize,
    contacts: usize,
    restarts: usize,
    unsplit: usize,
    merged: usize,
    work: [u64; 2],
}

impl<'a> Duel<'a> {
    fn new(a: &'a Body, b: &'a Body, places: usize) -> Self {
        let by_front = LeafPairs::new(1 << 16);
        let front = Front::new(side(a), side(b), places);
        Self { a, b, front, by_front, ticks: 0, contacts: 0, restarts: 0, unsplit: 0, merged: 0, work: [0; 2] }
    }

    fn tick(&mut self, pose: &Pose, tolerance: f64, what: &str) {
        let place = pose.placement();
        let counters =
            self.front.within(&PlacedPair::new(side(self.a), side(self.b), &place, tolerance), &mut self.by_front);
        let (expected, marches) = judge::within(side(self.a), side(self.b), &place, tolerance);
        assert_eq!(counters.dropped, 0);
        let ours = self.by_front.as_slice().iter();
        let found = sorted(ours.map(|leaf| (leaf.piece_a, leaf.piece_b, judge::distance(&leaf.proximity))).collect());
        let expected_pairs = sorted(expected.iter().map(|(p, q, near)| (*p, *q, judge::distance(near))).collect());
        self.hold_nearest(&place, tolerance, &expected_pairs);
        let size = self.a.size() + self.b.size();
        let context = || format!("{what}, seed {SEED:#x}, tick {}, {pose:?}, tolerance {tolerance:e}", self.ticks);
        let (mut k, mut l) = (0, 0);
        while k < found.len() || l < expected_pairs.len() {
            let name = |pairs: &[(u32, u32, f64)], i: usize| pairs.get(i).map_or((u32::MAX, 0), |p| (p.0, p.1));
            let (ours, theirs) = (name(&found, k), name(&expected_pairs, l));
            if ours == theirs {
                let (p, q) = (found[k].2, expected_pairs[l].2);
                assert!((p - q).abs() <= ROUNDING * size, "{ours:?}: {p:e} but {q:e}; {}", context());
                (k, l) = (k + 1, l + 1);
                continue;
            }
            let (odd, who) = if ours < theirs { (found[k], "front") } else { (expected_pairs[l], "full traversal") };
            assert!((odd.2 - tolerance).abs() <= SLACK * size, "only the {who} finds {odd:?}; {}", context());
            if ours < theirs { k += 1 } else { l += 1 }
        }
        self.ticks += 1;
        self.contacts += found.len();
        self.restarts += counters.restarted as usize;
        self.unsplit += counters.unsplit as usize;
        self.merged += counters.merged as usize;
        self.work[0] += u64::from(counters.hull_tests + counters.leaf_tests);
        self.work[1] += marches;
    }

    /// Compares the nearest pair with the pairs within the tolerance. If no pair is within the
    /// tolerance, compares it with pairs that are slightly farther away.
    fn hold_nearest(&mut self, place: &Placement, tolerance: f64, within: &[(u32, u32, f64)]) {
        if !self.ticks.is_multiple_of(NEAREST_EVERY) {
            return;
        }
        let mut counters = TraversalCounters::default();
        let placed = PlacedPair::new(side(self.a), side(self.b), place, tolerance);
        let mut found = LeafPairs::new(1);
        self.front.nearest(&placed, 0.0, &mut found, &mut counters);
        let nearest = found.as_slice().first().expect("every body has pieces");
        let ours = judge::distance(&nearest.proximity);
        let size = self.a.size() + self.b.size();
        let least = |pairs: &mut dyn Iterator<Item = f64>| pairs.fold(f64::INFINITY, f64::min);
        let theirs = match within {
            [] => {
                let (near, _) = judge::within(side(self.a), side(self.b), place, ours + ROUNDING * size);
                least(&mut near.iter().map(|(_, _, near)| judge::distance(near)))
            }
            _ => least(&mut within.iter().map(|pair| pair.2)),
        };
        let slack = if within.is_empty() { SLACK } else { ROUNDING };
        assert!((ours - theirs).abs() <= slack * size, "seed {SEED:#x}, tick {}: {ours:e}, {theirs:e}", self.ticks);
        assert!(within.is_empty() == (ours >= tolerance) || (ours - tolerance).abs() <= SLACK * size);
    }
}

/// Moves the probe by drift, tremor, rest and jumps. The tolerance changes, and the front is
/// sometimes cleared.
fn wander(duel: &mut Duel<'_>, around: impl Fn(f64) -> Pose, tolerance: f64, ticks: usize, what: &str) {
    let mut random = Random::new(SEED);
    let reach = duel.a.size().min(duel.b.size());
    let (mut phase, mut speed, mut t) = (random.unit(), 2e-4, tolerance);
    let mut offset = Pose::IDENTITY;
    for _ in 0..ticks {
        if random.below(150) == 0 {
            phase = random.unit();
        }
        if random.below(100) == 0 {
            // From rest and slow motion to motion faster than a hand.
            speed = [0.0, 1e-6, 2e-4, 2e-3, 1e-2][(random.unit() * 5.0) as usize];
        }
        if random.below(60) == 0 {
            t = tolerance * 4f64.powf(random.unit() * 2.0 - 1.0);
        }
        if random.below(300) == 0 {
            duel.front.clear();
        }
        phase = (phase + 0.3 * speed) % 1.0;
        let turn = DQuat::from_scaled_axis(random.vector() * speed);
        offset = Pose::new(turn * offset.rotation, offset.translation * 0.99 + random.vector() * speed * reach);
        offset.rotation = DQuat::IDENTITY.slerp(offset.rotation, 0.99);
        let path = around(phase);
        let pose = Pose::new(path.rotation * offset.rotation, path.translation + offset.translation);
        duel.tick(&pose, t, what);
    }
}

fn wander_on(name: &str, places: usize, ticks: usize) -> (usize, usize) {
    let scene = scene(name).expect("a built-in scene");
    let (a, b) = (body(&scene.probe), body(&scene.environment));
    let mut duel = Duel::new(&a, &b, places);
    let duration = scene.path.duration();
    wander(&mut duel, |phase| scene.path.pose(phase * duration), scene.contact.tolerance, ticks, name);
    assert!(duel.contacts > ticks / 10, "{name}: {} contacts in {ticks} ticks", duel.contacts);
    assert!(duel.restarts > ticks / 1000, "{name}: {} restarts", duel.restarts);
    (duel.unsplit, duel.merged)
}

#[test]
fn front_equals_full_traversal_in_every_scene() {
    // In scenes with two tools, the first tool need not touch the environment.
    for entry in scenes().iter().filter(|entry| entry.build().is_of_two_bodies()) {
        wander_on(entry.name, 1 << 15, 600);
    }
}

#[test]
fn full_front_is_slower_but_correct() {
    for places in [2, 32, 96] {
        let (unsplit, _) = wander_on("torus-torus", places, 200);
        assert!(unsplit > 20, "{places} places: {unsplit} unsplit pairs");
    }
}

/// Returns the poses of a hand-held camera, recorded at 300 Hz (TUM RGB-D, freiburg2_desk),
/// relative to the first pose. `None` if the file is missing.
fn recorded() -> Option<Vec<Pose>> {
    let name = "../../../shared/models/trajectories/tum_fr2_desk_300hz.txt";
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).ok()?;
    let rows = text.lines().filter(|line| !line.starts_with('#')).map(|line| {
        let row: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        Pose::new(DQuat::from_xyzw(row[4], row[5], row[6], row[7]), DVec3::new(row[1], row[2], row[3]))
    });
    let poses: Vec<Pose> = rows.collect();
    let first = poses[0].inverse();
    Some(poses.iter().map(|pose| first * *pose).collect())
}

/// Follows the recording, starting at the pose of the scene's path at `phase`. One metre of the
/// recording becomes the size of the smaller body.
fn follow(duel: &mut Duel<'_>, scene: &Scene, phase: f64, ticks: usize) {
    let Some(recorded) = recorded() else { return };
    let start = scene.path.pose(phase * scene.path.duration());
    let scale = duel.a.size().min(duel.b.size());
    for (k, pose) in recorded.iter().take(ticks).enumerate() {
        // The recorded hand moves away, so the motion starts again at the scene's pose every
        // thousand rows.
        let back = recorded[k / 1000 * 1000].inverse() * *pose;
        let pose = Pose::new(back.rotation * start.rotation, start.translation + back.translation * scale);
        duel.tick(&pose, scene.contact.tolerance, "a recorded hand");
    }
    assert!(duel.contacts > ticks / 10, "{} contacts in {ticks} ticks", duel.contacts);
}

#[test]
fn front_equals_full_traversal_along_a_recorded_hand() {
    let scene = scene("torus-torus").expect("a built-in scene");
    let (a, b) = (body(&scene.probe), body(&scene.environment));
    follow(&mut Duel::new(&a, &b, 1 << 15), &scene, 0.4, 1500);
}

#[test]
#[ignore = "minutes: 20 000 ticks on each scene"]
fn front_equals_full_traversal_long() {
    // In scenes with two tools, the first tool need not touch the environment.
    for entry in scenes().iter().filter(|entry| entry.build().is_of_two_bodies()) {
        let (_, merged) = wander_on(entry.name, 1 << 15, 20_000);
        assert!(merged > 0 || entry.name == "pen-sphere" || entry.name == "box-table", "{}", entry.name);
    }
}

#[test]
#[ignore = "minutes: 20 000 ticks"]
fn front_equals_full_traversal_along_a_recorded_hand_long() {
    for name in ["torus-torus", "spoon-cup", "intestine"] {
        let scene = scene(name).expect("a built-in scene");
        let (a, b) = (body(&scene.probe), body(&scene.environment));
        let mut duel = Duel::new(&a, &b, 1 << 15);
        follow(&mut duel, &scene, 0.4, 20_000);
        assert!(2 * duel.work[0] < duel.work[1], "{name}: marches {:?}", duel.work);
    }
}
