//! Compares clusters with the clusters of a quadratic single linkage. The two algorithms share only
//! the comparison of distances.

use glam::DVec3;

use super::testing::{Random, contact, moved};
use super::{Linkage, LinkageSettings};
use crate::algebra::tolerance::SMOOTH_CONTACTS;
use crate::detect::Contact;

const SEED: u64 = 0x0C1A_57E2;
const TOLERANCE: f64 = 1e-3;
const RADIUS: f64 = 4e-3;
const PAPER: LinkageSettings = LinkageSettings {
    tolerance: TOLERANCE,
    radius: RADIUS,
    split_angle: None,
    most: usize::MAX,
    contact_offset: TOLERANCE,
};
const CUT: LinkageSettings = LinkageSettings { split_angle: Some(2.269), ..PAPER };

/// Finds the components of eq. 2 by repeated relabelling: each contact within the tolerance gets
/// the smallest index in its component.
fn quadratic(contacts: &[Contact], radius: f64) -> Vec<Vec<u32>> {
    let mut label: Vec<usize> = (0..contacts.len()).collect();
    loop {
        let before = label.clone();
        for i in 0..contacts.len() {
            for j in 0..contacts.len() {
                let near = contacts[i].midpoint().distance_squared(contacts[j].midpoint()) < radius * radius;
                let both = contacts[i].separation < TOLERANCE && contacts[j].separation < TOLERANCE;
                if near && both {
                    label[i] = label[i].min(label[j]);
                }
            }
        }
        if label == before {
            break;
        }
    }
    let mut groups = vec![Vec::new(); contacts.len()];
    for (i, contact) in contacts.iter().enumerate() {
        if contact.separation < TOLERANCE {
            groups[label[i]].push(i as u32);
        }
    }
    groups.retain(|group| !group.is_empty());
    groups
}

fn clusters(linkage: &Linkage) -> Vec<Vec<u32>> {
    (0..linkage.len()).map(|k| linkage.members()[linkage.range(k)].to_vec()).collect()
}

fn sorted(mut groups: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    for group in &mut groups {
        group.sort_unstable();
    }
    groups.sort_unstable();
    groups
}

fn cloud(random: &mut Random, n: usize, half: f64) -> Vec<Contact> {
    (0..n)
        .map(|k| {
            let (p, n) = (random.point(half), random.direction());
            contact((k as u32 / 7, k as u32 % 7), p, n, random.between(-2e-3, 1.1e-3))
        })
        .collect()
}

fn run(contacts: &[Contact], settings: &LinkageSettings) -> Linkage {
    let mut linkage = Linkage::new(contacts.len().max(1));
    linkage.run(contacts, settings, |contact| contact.separation, |contact| contact.normal);
    linkage
}

#[test]
fn clusters_equal_quadratic_single_linkage() {
    let mut random = Random::new(SEED);
    for round in 0..400 {
        let n = 1 + random.below(90);
        // The size of the cloud varies: small clouds have one cluster, and large clouds have a
        // cluster for each contact. Some clouds are far from the origin, and some lie in a plane.
        let half = RADIUS * random.between(0.3, 12.0);
        let mut contacts = cloud(&mut random, n, half);
        let far = if round % 5 == 0 { random.point(1e3) } else { DVec3::ZERO };
        for contact in &mut contacts {
            let flat = if round % 3 == 0 { DVec3::Z * contact.midpoint().z } else { DVec3::ZERO };
            contact.point_a += far - flat;
            contact.point_b += far - flat;
        }
        let answer = sorted(clusters(&run(&contacts, &PAPER)));
        assert_eq!(answer, quadratic(&contacts, RADIUS), "seed {SEED:#x}, round {round}");
    }
}

#[test]
fn chains_join_but_distance_delta_does_not() {
    let line = |spacing: f64| -> Vec<Contact> {
        (0..60u32).map(|k| contact((k, 0), DVec3::X * (spacing * f64::from(k)), DVec3::Z, 0.0)).collect()
    };
    assert_eq!(run(&line(0.999 * RADIUS), &PAPER).len(), 1);
    // Spacing and radius are a power of two, so the distances are exactly δ.
    let exact = LinkageSettings { radius: 0.0625, ..PAPER };
    assert_eq!(run(&line(0.0625), &exact).len(), 60);
    assert_eq!(run(&line(0.0625 - 1e-12), &exact).len(), 1);
    assert_eq!(run(&line(0.0), &LinkageSettings { radius: 0.0, ..PAPER }).len(), 60);
}

#[test]
fn cell_wall_does_not_separate_near_contacts() {
    // Pairs at slightly less than δ, in random directions and at random offsets to the grid, which
    // begins at the first contact.
    let mut random = Random::new(SEED ^ 1);
    for round in 0..2000 {
        let p = random.point(10.0 * RADIUS);
        let q = p + random.direction() * (RADIUS * 0.999_999);
        let contacts = [
            contact((0, 0), DVec3::splat(-11.0 * RADIUS), DVec3::Z, 0.0),
            contact((1, 0), p, DVec3::Z, 0.0),
            contact((2, 0), q, DVec3::Z, 0.0),
        ];
        let groups = clusters(&run(&contacts, &PAPER));
        assert!(groups.contains(&vec![1, 2]), "seed {SEED:#x}, round {round}: {groups:?}");
    }
}

#[test]
fn contacts_outside_the_grid_are_linked() {
    let mut random = Random::new(SEED ^ 2);
    let mut contacts = cloud(&mut random, 80, 3.0 * RADIUS);
    for contact in contacts.iter_mut().skip(1) {
        contact.point_a += DVec3::splat(1e6);
        contact.point_b += DVec3::splat(1e6);
    }
    assert_eq!(sorted(clusters(&run(&contacts, &PAPER))), quadratic(&contacts, RADIUS));
}

#[test]
fn permuting_contacts_changes_no_bit() {
    let mut random = Random::new(SEED ^ 3);
    for round in 0..60 {
        let n = 1 + random.below(120);
        let contacts = cloud(&mut random, n, 4.0 * RADIUS);
        let mut shuffled = contacts.clone();
        random.shuffle(&mut shuffled);
        let (first, second) = (run(&contacts, &CUT), run(&shuffled, &CUT));
        let values = |linkage: &Linkage, contacts: &[Contact]| -> Vec<Vec<Contact>> {
            let of = |group: &Vec<u32>| group.iter().map(|&i| contacts[i as usize]).collect();
            clusters(linkage).iter().map(of).collect()
        };
        assert_eq!(values(&first, &contacts), values(&second, &shuffled), "seed {SEED:#x}, round {round}");
        assert_eq!(first.directions(), second.directions());
    }
}

#[test]
fn moving_the_scene_changes_no_cluster() {
    let mut random = Random::new(SEED ^ 4);
    for round in 0..60 {
        let n = 1 + random.below(60);
        let contacts = cloud(&mut random, n, 4.0 * RADIUS);
        let pose = random.pose(0.3);
        let elsewhere: Vec<_> = contacts.iter().map(|contact| moved(contact, &pose)).collect();
        assert_eq!(clusters(&run(&contacts, &CUT)), clusters(&run(&elsewhere, &CUT)), "seed {SEED:#x}, round {round}");
    }
}

#[test]
fn every_cluster_fits_its_cone_and_refines_single_linkage() {
    let mut random = Random::new(SEED ^ 5);
    for round in 0..200 {
        let n = 1 + random.below(90);
        let contacts = cloud(&mut random, n, 4.0 * RADIUS);
        let whole = quadratic(&contacts, RADIUS);
        let linkage = run(&contacts, &CUT);
        let mut seen = 0;
        for group in clusters(&linkage) {
            seen += group.len();
            assert!(whole.iter().any(|w| group.iter().all(|i| w.contains(i))), "seed {SEED:#x}, round {round}");
            for &i in &group {
                for &j in &group {
                    let cosine = contacts[i as usize].normal.dot(contacts[j as usize].normal);
                    assert!(cosine >= 2.269f64.cos() - 1e-12, "seed {SEED:#x}, round {round}");
                }
            }
            // By eq. 2 alone, the cluster is still connected.
            let members: Vec<_> = group.iter().map(|&i| contacts[i as usize]).collect();
            assert_eq!(quadratic(&members, RADIUS).len(), 1, "seed {SEED:#x}, round {round}");
        }
        assert_eq!(seen, whole.iter().map(Vec::len).sum::<usize>());
    }
}

#[test]
fn opposed_walls_are_in_different_clusters() {
    let slot: Vec<_> = (0..20u32)
        .map(|k| {
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let p = DVec3::new(1e-3 * f64::from(k / 2), 0.5e-3 * side, 0.0);
            contact((k, 0), p, DVec3::Y * side, -1e-4)
        })
        .collect();
    assert_eq!(run(&slot, &PAPER).len(), 1);
    let linkage = run(&slot, &CUT);
    assert_eq!(linkage.len(), 2);
    assert!(linkage.range(0).len() == 10);

    // A peg in a hole: the normals of neighbours differ by 15°, and a chain of links goes all
    // around.
    let ring: Vec<_> = (0..24u32)
        .map(|k| {
            let angle = (15.0 * f64::from(k)).to_radians();
            let inward = -DVec3::new(angle.cos(), angle.sin(), 0.0);
            contact((0, k), inward * -5e-3, inward, -1e-4)
        })
        .collect();
    assert_eq!(run(&ring, &PAPER).len(), 1);
    let linkage = run(&ring, &CUT);
    assert_eq!(linkage.len(), 4);
    let sum = |k: usize| linkage.directions()[linkage.range(k)].iter().sum::<DVec3>().normalize();
    assert!((0..4).map(sum).sum::<DVec3>().length() < 1e-12, "a centred peg must have no force");
    // Contacts in the corner of a box (three walls at right angles) stay one cluster.
    let corner: Vec<_> =
        [DVec3::X, DVec3::Y, DVec3::Z].iter().map(|&n| contact((0, 0), DVec3::ZERO, n, -1e-4)).collect();
    assert_eq!(run(&corner, &CUT).len(), 1);
}

#[test]
fn contacts_above_capacity_are_counted_and_deepest_kept() {
    let mut random = Random::new(SEED ^ 6);
    let mut contacts = cloud(&mut random, 300, RADIUS);
    contacts[3].separation = f64::NAN;
    contacts[4].point_a.x = f64::INFINITY;
    let mut linkage = Linkage::new(20);
    let counters = linkage.run(&contacts, &PAPER, |contact| contact.separation, |contact| contact.normal);
    let finite = |c: &&Contact| c.separation.is_finite() && c.point_a.is_finite();
    let mut depths: Vec<_> = contacts.iter().filter(finite).map(|c| c.separation).filter(|&s| s < TOLERANCE).collect();
    depths.sort_by(f64::total_cmp);
    assert_eq!((counters.admitted, counters.non_finite), (20, 2));
    assert_eq!(counters.dropped as usize, depths.len() - 20);
    let shallowest = linkage.members().iter().map(|&i| contacts[i as usize].separation).fold(-1.0, f64::max);
    assert_eq!(shallowest.to_bits(), depths[19].to_bits());
    assert_eq!(linkage.run(&[], &PAPER, |contact| contact.separation, |contact| contact.normal).admitted, 0);
    assert!(linkage.is_empty());
}

/// A flat square consists of tiles. Each tile is a patch with a corner at each of its vertices.
#[test]
fn contacts_inside_a_flat_face_are_left_out() {
    const TILES: u32 = 12;
    let at = |i: u32| f64::from(i) * 0.01;
    let tiles = (0..TILES).flat_map(|i| (0..TILES).map(move |j| (i, j)));
    let corners = tiles.flat_map(|(i, j)| [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| (i, j, i + x, j + y)));
    let contacts: Vec<Contact> = corners
        .map(|(i, j, x, y)| {
            let place = DVec3::new(at(x), at(y), 0.0);
            Contact { slope: 0.07, ..contact((i, j), place, DVec3::Z, -1e-5) }
        })
        .collect();
    let mut linkage = Linkage::new(contacts.len());
    let settings = LinkageSettings { radius: 0.0, most: 40, ..PAPER };
    let counters = linkage.run(&contacts, &settings, |contact| contact.separation, |contact| contact.normal);
    assert_eq!(counters.dropped, 0);
    let (side, mut bearing) = (at(TILES), 0);
    for (&i, &share) in linkage.members().iter().zip(linkage.tilt_shares().unwrap()) {
        let place = contacts[i as usize].midpoint();
        let is_corner = [place.x, place.y].iter().all(|&x| x == 0.0 || x == side);
        // Along the rim, shares have rounding errors.
        assert!((share - if is_corner { 0.25 } else { 0.0 }).abs() < 1e-9, "{place}: {share}");
        bearing += usize::from(is_corner);
    }
    assert_eq!(bearing, 4);
    assert!(linkage.run(&contacts, &PAPER, |contact| contact.separation, |contact| contact.normal).admitted > 4);
    assert!(linkage.tilt_shares().is_none());
}

/// Returns a contact of its own pair at each of `count` places in a square of 0.1 m. `separation`
/// returns its separation (m) from its place.
fn on_a_square(random: &mut Random, count: u32, separation: impl Fn(DVec3) -> f64) -> Vec<Contact> {
    let mut one = |k| {
        let place = random.point(0.05).with_z(0.0);
        contact((k, k), place, DVec3::Z, separation(place))
    };
    (0..count).map(&mut one).collect()
}

/// Returns the mean place of the chosen contacts, weighted with their loads and shares.
fn mean_place(contacts: &[Contact], settings: &LinkageSettings) -> DVec3 {
    let mut linkage = Linkage::new(contacts.len());
    linkage.run(contacts, settings, |contact| contact.separation, |contact| contact.normal);
    let ones = vec![1.0; linkage.members().len()];
    let shares = linkage.tilt_shares().unwrap_or(&ones);
    let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
    for (&i, share) in linkage.members().iter().zip(shares) {
        let one = &contacts[i as usize];
        let load = share * one.count * (settings.contact_offset - one.separation).max(0.0);
        (sum, weight) = (sum + load * one.midpoint(), weight + load);
    }
    sum / weight
}

/// If a flat face lands flush, the deepest contacts are all at the side to which it is tilted, even
/// if the tilt is tiny.
#[test]
fn a_tiny_tilt_does_not_move_the_load_to_one_side() {
    let settings = LinkageSettings { radius: 0.0, most: 256, ..PAPER };
    let all = LinkageSettings { most: usize::MAX, ..settings };
    for tilt in [1e-9, -1e-9, 1e-6, -1e-6] {
        let mut random = Random::new(SEED ^ 11);
        let contacts = on_a_square(&mut random, 2000, |place| 0.9 * TOLERANCE + tilt * place.x);
        let error = mean_place(&contacts, &settings).distance(mean_place(&contacts, &all));
        assert!(error < 6e-3, "seed {SEED:#x}, tilt {tilt:e}: the load acts {error} m beside its place");
    }
}

/// While the loads change gradually, the load moves in small steps ([`SMOOTH_CONTACTS`]).
#[test]
fn the_load_moves_in_small_steps() {
    let settings = LinkageSettings { radius: 0.0, most: SMOOTH_CONTACTS, ..PAPER };
    let steps = 1000;
    let place = |k: u32| {
        let mut random = Random::new(SEED ^ 12);
        let turn = f64::from(k) / f64::from(steps);
        let wave = |place: DVec3| (40.0 * place.x + 60.0 * place.y + turn).sin();
        let contacts = on_a_square(&mut random, 600, |place| TOLERANCE * (0.5 + 0.4 * wave(place)));
        mean_place(&contacts, &settings)
    };
    let largest = (0..steps).map(|k| place(k).distance(place(k + 1))).fold(0.0, f64::max);
    assert!(largest < 0.1 * 2.0 / SMOOTH_CONTACTS as f64, "seed {SEED:#x}: a step of {largest} m");
}

#[test]
fn deepest_and_differently_directed_contacts_are_kept() {
    let mut random = Random::new(SEED ^ 9);
    let settings = LinkageSettings { radius: 0.0, most: 40, ..PAPER };
    // A hundred contacts press on a floor. Thirty contacts at the ceiling are farther away than all
    // contacts on the floor.
    let contacts: Vec<Contact> = (0..130)
        .map(|k| {
            let (normal, near) = if k < 100 { (DVec3::Z, 0.0) } else { (DVec3::NEG_Z, 5e-4) };
            contact((k, k), random.point(0.05), normal, near + random.between(0.0, 4e-4))
        })
        .collect();
    // The expected separations count.
    let separations = |contact: &Contact| contact.separation;
    let others_first = |contact: &Contact| 1e-3 - contact.separation;
    for expected in [separations as fn(&Contact) -> f64, others_first] {
        let mut linkage = Linkage::new(200);
        let counters = linkage.run(&contacts, &settings, expected, |contact| contact.normal);
        assert_eq!((counters.admitted, counters.dropped), (40, 90));
        for range in [0..100u32, 100..130] {
            let mut by_depth: Vec<u32> = range.collect();
            let separation = |i: &u32| expected(&contacts[*i as usize]);
            by_depth.sort_by(|i, j| separation(i).total_cmp(&separation(j)));
            let kept = by_depth[..10].iter().filter(|i| linkage.members().contains(i)).count();
            assert_eq!(kept, 10, "seed {SEED:#x}");
        }
    }
}

#[test]
fn drawn_contacts_represent_the_others() {
    let settings = LinkageSettings { radius: 0.0, most: 256, ..PAPER };
    let mut worst = 0.0_f64;
    for round in 0..50 {
        let mut random = Random::new(SEED ^ (100 + round));
        let slope = random.vector() * 0.01;
        let contacts = on_a_square(&mut random, 1500, |place| (0.5 * TOLERANCE + slope.dot(place)).max(-TOLERANCE));
        let mut linkage = Linkage::new(contacts.len());
        linkage.run(&contacts, &settings, |contact| contact.separation, |contact| contact.normal);
        let load = |contact: &Contact| (settings.contact_offset - contact.separation).max(0.0);
        let shares = linkage.tilt_shares().unwrap();
        let chosen: f64 =
            linkage.members().iter().zip(shares).map(|(&i, share)| share * load(&contacts[i as usize])).sum();
        let all: f64 = contacts.iter().map(load).sum();
        worst = worst.max((chosen / all - 1.0).abs());
    }
    assert!(worst < 0.2, "seed {SEED:#x}: the loads of the chosen contacts are wrong by {worst}");
}
