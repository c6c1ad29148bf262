//! Compares tilt shares with exterior angles, with counted areas, and with the claims of the
//! module's description.

use super::super::testing::Random;
use super::*;

const SEED: u64 = 0x7117;
const SLOPE: f64 = 0.0875;

fn at(x: f64, y: f64, separation: f64) -> Tilted {
    Tilted {
        place: DVec3::new(x, y, 0.0),
        direction: DVec3::Z,
        separation,
        engagement: (1e-4 - separation).max(0.0),
        slope: SLOPE,
        count: 1.0,
        pieces: [0; 2],
        inside: false,
    }
}

fn shares(contacts: &[Tilted]) -> Vec<f64> {
    TiltShares::new(contacts.len()).run(contacts).to_vec()
}

fn close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (x, y) in found.iter().zip(expected) {
        assert!((x - y).abs() < 1e-9, "{found:?}, expected {expected:?}");
    }
}

#[test]
fn corners_count_by_exterior_angle() {
    close(&shares(&[at(0.0, 0.0, 0.0)]), &[1.0]);
    close(&shares(&[at(0.0, 0.0, 0.0), at(0.02, 0.0, 0.0)]), &[0.5; 2]);
    let box_corners = [at(0.0, 0.0, 0.0), at(0.04, 0.0, 0.0), at(0.04, 0.01, 0.0), at(0.0, 0.01, 0.0)];
    close(&shares(&box_corners), &[0.25; 4]);
    // A triangle with one angle of 90° and two angles of 45°.
    let triangle = [at(0.0, 0.0, 0.0), at(0.01, 0.0, 0.0), at(0.0, 0.01, 0.0)];
    close(&shares(&triangle), &[0.25, 0.375, 0.375]);
}

#[test]
fn inner_and_double_contacts_have_no_share() {
    let flat = [
        at(0.0, 0.0, 0.0),
        at(0.04, 0.0, 0.0),
        at(0.04, 0.02, 0.0),
        at(0.0, 0.02, 0.0),
        at(0.02, 0.01, 0.0),
        at(0.02, 0.0, 0.0),
        at(0.04, 0.0, 0.0),
    ];
    close(&shares(&flat), &[0.25, 0.25, 0.25, 0.25, 0.0, 0.0, 0.0]);
}

#[test]
fn rim_bears_a_face_of_two_pieces() {
    let half = |x: f64, piece: u32| {
        [(x, 0.0), (x + 0.02, 0.0), (x + 0.02, 0.02), (x, 0.02)]
            .map(|(x, y)| Tilted { pieces: [0, piece], ..at(x, y, 0.0) })
    };
    let [near, beside, far] = [half(0.0, 1), half(0.02, 2), half(0.03, 3)];
    close(&shares(&[near, beside].concat()), &[0.25, 0.0, 0.0, 0.25, 0.0, 0.25, 0.25, 0.0]);
    // Two separate feet have four corners each.
    close(&shares(&[near, far].concat()), &[0.25; 8]);
}

#[test]
fn shares_of_a_patch_without_neighbours_are_its_own() {
    let square = |x: f64, piece: u32| {
        [(x, 0.0, 0.0), (x + 0.02, 0.0, 1e-5), (x + 0.02, 0.02, 3e-5), (x, 0.02, 2e-5)]
            .map(|(x, y, separation)| Tilted { pieces: [0, piece], ..at(x, y, separation) })
    };
    let [near, beside, far] = [square(0.0, 1), square(0.02, 2), square(0.05, 3)];
    let single = [Tilted { slope: 0.0, pieces: [0, 4], ..at(0.1, 0.0, 0.0) }];
    let all = [&near[..], &beside[..], &far[..], &single[..]].concat();
    let mut tilts = TiltShares::new(all.len());
    tilts.run(&all);
    assert_eq!([tilts.of_patch(0..4), tilts.of_patch(4..8)], [None; 2]);
    assert_eq!(tilts.of_patch(8..12), Some(&shares(&far)[..]));
    assert_eq!(tilts.of_patch(12..13), Some(&[1.0][..]));
}

#[test]
fn many_contacts_in_a_plane_across_an_axis_meet_their_neighbours() {
    // All contacts have the same first coordinate, as on a face across the x axis.
    let tile = |k: u32| {
        let y = f64::from(k) * 0.01;
        [(y, 0.0), (y + 0.01, 0.0), (y + 0.01, 0.01), (y, 0.01)].map(|(y, z)| Tilted {
            place: DVec3::new(0.0, y, z),
            direction: DVec3::X,
            pieces: [0, k],
            inside: false,
            ..at(0.0, 0.0, 0.0)
        })
    };
    let row: Vec<Tilted> = (0..20).flat_map(tile).collect();
    let found = shares(&row);
    let rim: Vec<f64> = [0, 3, 77, 78].map(|k| found[k]).to_vec();
    close(&rim, &[0.25; 4]);
    assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-9);
}

#[test]
fn contacts_of_other_directions_are_independent() {
    let mut corner = [at(0.0, 0.0, 0.0), at(0.01, 0.0, 0.0)];
    corner[1].direction = DVec3::X;
    close(&shares(&corner), &[1.0, 1.0]);
    corner[1].direction = -DVec3::Z;
    close(&shares(&corner), &[1.0, 1.0]);
}

#[test]
fn unloaded_contacts_take_no_share() {
    // A crowned face, 0.02 mm high over 20 mm: its corners lie above its top.
    let mut crown = [at(0.0, 0.0, 0.0); 5];
    for (k, corner) in crown.iter_mut().skip(1).enumerate() {
        let sign = |bit: usize| if k >> bit & 1 == 1 { 0.01 } else { -0.01 };
        *corner = at(sign(0), sign(1), 2e-5);
        corner.engagement = 0.0;
    }
    crown[0].engagement = 2e-5;
    assert!((shares(&crown)[0] - 1.0).abs() < 1e-12);
    // If all contacts have equal loads, the corners bear nearly the whole load.
    crown.iter_mut().for_each(|contact| contact.engagement = 1e-3);
    assert!(shares(&crown)[0] < 0.01);
}

#[test]
fn shares_are_continuous_where_a_corner_splits() {
    let square = |cut: f64| {
        vec![at(0.0, 0.0, 0.0), at(0.02 - cut, 0.0, 0.0), at(0.02, cut, 0.0), at(0.02, 0.02, 0.0), at(0.0, 0.02, 0.0)]
    };
    let mean = |contacts: &[Tilted]| -> DVec3 {
        let shares = shares(contacts);
        contacts.iter().zip(&shares).map(|(contact, share)| contact.place * *share).sum()
    };
    let whole = mean(&[at(0.0, 0.0, 0.0), at(0.02, 0.0, 0.0), at(0.02, 0.02, 0.0), at(0.0, 0.02, 0.0)]);
    for cut in [1e-12, 1e-9, 1e-6, 1e-5] {
        assert!(mean(&square(cut)).distance(whole) <= cut, "{cut}");
    }
}

#[test]
fn shares_of_a_patch_sum_to_one_and_turn_with_it() {
    let mut random = Random::new(SEED);
    for round in 0..300 {
        let count = 2 + random.below(10);
        let mut contacts: Vec<Tilted> = (0..count)
            .map(|_| at(random.between(-0.02, 0.02), random.between(-0.02, 0.02), random.between(0.0, 3e-4)))
            .collect();
        contacts.iter_mut().for_each(|contact| contact.engagement = 0.0);
        let before = shares(&contacts);
        assert!((before.iter().sum::<f64>() - 1.0).abs() < 1e-9, "seed {SEED:#x}, round {round}: {before:?}");
        let pose = random.pose(0.1);
        for contact in &mut contacts {
            contact.place = pose.point(contact.place);
            contact.direction = pose.vector(contact.direction);
        }
        let after = shares(&contacts);
        assert!(before.iter().zip(&after).all(|(x, y)| (x - y).abs() < 1e-8), "seed {SEED:#x}, round {round}");
    }
}

/// Returns the fraction of the points of a grid in the disc that are in the cell by its definition.
fn counted(i: usize, contacts: &[Tilted]) -> f64 {
    const SIDE: i32 = 400;
    let (mut inside, mut all) = (0, 0);
    for (x, y) in (0..SIDE).flat_map(|x| (0..SIDE).map(move |y| (x, y))) {
        let slope = DVec3::new(f64::from(2 * x + 1 - SIDE), f64::from(2 * y + 1 - SIDE), 0.0) * SLOPE / f64::from(SIDE);
        if slope.length() <= SLOPE {
            all += 1;
            let one = &contacts[i];
            let lower = |other: &Tilted| slope.dot(other.place - one.place) <= other.separation - one.separation;
            inside += u32::from(contacts.iter().all(lower));
        }
    }
    f64::from(inside) / f64::from(all)
}

#[test]
fn shares_are_areas_of_cells() {
    let mut random = Random::new(SEED ^ 1);
    for round in 0..40 {
        let flat = if round % 2 == 0 { 0.0 } else { 2e-4 };
        let contacts: Vec<Tilted> = (0..1 + random.below(7))
            .map(|_| {
                let (x, y) = (random.between(-5e-3, 5e-3), random.between(-5e-3, 5e-3));
                Tilted { engagement: 0.0, ..at(x, y, random.between(0.0, flat)) }
            })
            .collect();
        for (i, share) in shares(&contacts).into_iter().enumerate() {
            let counted = counted(i, &contacts);
            assert!((share - counted).abs() < 5e-3, "seed {SEED:#x}, round {round}: {share}, counted {counted}");
        }
    }
}

/// Returns the shares beside the rim.
fn beside_rim(contacts: &[Tilted]) -> Vec<f64> {
    let mut tilts = TiltShares::new(contacts.len());
    tilts.run(contacts);
    (0..contacts.len()).map(|i| tilts.beside_rim(i, contacts)).collect()
}

#[test]
fn rim_bears_the_load_of_contacts_inside() {
    let inside = |x: f64, separation: f64| Tilted { inside: true, pieces: [1, 0], ..at(x, 0.0, separation) };
    let alone = [inside(0.0, 0.0), inside(0.01, 0.0)];
    close(&beside_rim(&alone), &[0.5; 2]);
    let rim = Tilted { engagement: 0.5e-4, ..at(0.05, 0.0, 0.5e-4) };
    for (pressing, part) in [(0.0, 1.0), (0.5e-4, 0.125), (1e-4, 0.0), (2e-4, 0.0)] {
        let rim = Tilted { engagement: pressing, ..rim };
        let found = beside_rim(&[alone[0], alone[1], rim]);
        assert!((found[0] - 0.5 * part).abs() < 1e-6 && found[0] > 0.0, "{pressing}: {found:?}");
        assert!((found[2] - 1.0).abs() < 1e-9, "{pressing}: {found:?}");
    }
    // The rim of another surface bears nothing.
    let other = Tilted { direction: DVec3::new(2.0 * SLOPE, 0.0, 1.0).normalize(), engagement: 1e-4, ..rim };
    close(&beside_rim(&[alone[0], alone[1], other])[..2], &[0.5; 2]);
}
