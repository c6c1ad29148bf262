//! Flat contact: where its witness is, and what its extent tells.

use glam::DVec2;

use super::*;

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
        let turn = turn(&mut random);
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

#[test]
fn the_extent_of_flat_contact_tells_its_mean_lever() {
    // A sheet over a floor, whose frame is turned anyhow: the mean distance from its middle, by the extent.
    let mut random = Random(SEED ^ 5);
    let oval = |squeeze: f64| (0..24).map(move |k| (DVec2::from_angle(TAU * f64::from(k) / 24.0), squeeze));
    for round in 0..60 {
        let squeeze = 1.0 / (1.0 + f64::from(round % 10));
        let round_sheet = round % 2 == 0;
        let corners: Vec<DVec3> = if round_sheet {
            oval(squeeze).map(|(p, s)| DVec3::new(p.x, s * p.y, 0.0)).collect()
        } else {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, squeeze * y, 0.0)).into()
        };
        let sheet = Polytope::from_polygon(corners, DVec3::Z, Provenance::Original).unwrap();
        let turn = turn(&mut random);
        let floor = cuboid(DVec3::new(3.0, 3.0, 0.5));
        let moved: Vec<DVec3> = floor.vertices().iter().map(|v| turn * *v).collect();
        let there = (Pose::new(turn, DVec3::ZERO) * Pose::from_translation(DVec3::Z * 0.5)).placement();
        let felt = felt(&sheet, &solid(&moved), &there, None, &mut WalkScratch::new());
        let (mut lever, mut count) = (0.0, 0.0);
        for k in 0..10_000 {
            let p = DVec2::new(f64::from(k % 100), f64::from(k / 100)) * 0.02 - DVec2::splat(0.99);
            if !round_sheet || p.length() <= 1.0 {
                lever += DVec2::new(p.x, squeeze * p.y).length();
                count += 1.0;
            }
        }
        let ratio = FRICTION_LEVER * felt.extent / (lever / count);
        assert!((ratio - 1.0).abs() < 0.13, "seed {SEED:#x}, round {round}: {ratio}");
    }
}
