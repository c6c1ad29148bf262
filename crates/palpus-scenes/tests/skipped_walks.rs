//! Tests that cached data about overlaps without an admissible normal saves walks and does not
//! change the results.

mod bodies;

use bodies::body;
use palpus::algebra::NoClock;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus_scenes::scene;

/// Times at which sequences of queries begin, relative to the duration of the scene's path.
const PLACES: [f64; 3] = [0.2, 0.6, 0.8];

/// Number of queries per sequence, one millisecond apart.
const TICKS: usize = 300;

#[test]
fn overlaps_without_normal_are_walked_once() {
    let scene = scene("spoon-cup").expect("a built-in scene");
    let [a, b] = [&scene.probe, &scene.environment].map(body);
    let settings = QuerySettings { tolerance: scene.contact.tolerance, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    let mut fresh = ContactQuery::new(a, b, settings);
    let (mut inadmissible, mut cold, mut coherent) = (0, 0, 0);
    for place in PLACES {
        for tick in 0..TICKS {
            let pose = scene.path.pose(place * scene.path.duration() + 1e-3 * tick as f64);
            fresh.clear();
            let expected = *fresh.run(&pose, &NoClock);
            let counters = *query.run(&pose, &NoClock);
            assert_eq!(counters.inadmissible, expected.inadmissible, "place {place}, tick {tick}");
            inadmissible += expected.inadmissible;
            cold += expected.walks;
            coherent += counters.walks;
        }
    }
    assert!(inadmissible > 0, "there must be such overlaps along the path");
    assert!(coherent + inadmissible / 2 < cold, "{coherent} walks instead of {cold}, for {inadmissible} overlaps");
}
