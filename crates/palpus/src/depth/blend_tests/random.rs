//! Random bodies that move a little, and random pairs.

use super::*;

/// Standing on its base, lying on a side, or turned anyhow; then tilted a little.
fn some_turn(random: &mut Random, sides: u32) -> DQuat {
    let tilt = [0.0, 1e-9, 1e-5, 1e-3, 0.03][(5.0 * random.unit()) as usize % 5];
    let rest = match (3.0 * random.unit()) as u32 {
        0 => DQuat::from_rotation_x(0.25 * TAU),
        1 => DQuat::from_rotation_y(0.5 * TAU / f64::from(sides)),
        _ => turn(random),
    };
    let spin = DQuat::from_rotation_z([0.0, 1e-4, TAU][(3.0 * random.unit()) as usize % 3] * random.unit());
    DQuat::from_axis_angle(random.vector().normalize(), tilt) * spin * rest
}

#[test]
fn random_prisms_that_move_a_little() {
    let mut random = Random(SEED);
    let mut scratch = WalkScratch::new();
    let mut figures = Figures::NONE;
    for _ in 0..3000 {
        let sides = |random: &mut Random| 3 + (10.0 * random.unit()) as u32;
        let size = |random: &mut Random| 0.005 + 0.05 * random.unit();
        let (m, n) = (sides(&mut random), sides(&mut random));
        let a = prism(m, size(&mut random), size(&mut random));
        let ground = prism(n, size(&mut random), size(&mut random));
        let turn = some_turn(&mut random, n);
        let b = solid(&ground.vertices().iter().map(|v| turn * *v).collect::<Vec<_>>());
        let turn = some_turn(&mut random, m);
        let side = DVec3::new(0.06 * (random.unit() - 0.5), 0.06 * (random.unit() - 0.5), 0.0);
        let mut pose = Pose::new(turn, side + DVec3::Z * 0.2);
        // To a height: along the line of sight first, and then along the normal.
        let height = HEIGHTS[(6.0 * random.unit()) as usize % 6];
        let there = felt(&a, &b, &pose.placement(), None, &mut scratch);
        pose.translation.z -= (there.separation / there.normal.z.max(0.1)).min(0.2);
        for _ in 0..3 {
            let there = felt(&a, &b, &pose.placement(), None, &mut scratch);
            pose.translation += there.normal * (height - there.separation);
        }
        let mut place = pose.placement();
        let mut there = felt(&a, &b, &place, None, &mut scratch);
        let step = 10f64.powf(-3.0 - 5.0 * random.unit());
        for _ in 0..5 {
            pose.translation += random.vector() * step;
            pose.rotation = DQuat::from_axis_angle(random.vector().normalize(), step / a.radius()) * pose.rotation;
            let next = pose.placement();
            let here = felt(&a, &b, &next, Some(&there), &mut scratch);
            figures.add(&Figures::step(&a, &b, (&place, &there), (&next, &here)), 1.0 / 15_000.0);
            (place, there) = (next, here);
        }
    }
    check(&format!("random prisms, seed {SEED:#x}"), &figures);
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
    let (mut exact, mut farthest, mut lift, mut rounds) = (0, 0.0f64, 0.0f64, 0);
    for round in 0..4000 {
        let (a, b) = (&shapes[round % shapes.len()], &shapes[(round / 7) % shapes.len()]);
        let place = Pose::new(turn(&mut random), random.vector() * 0.06).placement();
        let here = felt(a, b, &place, None, &mut scratch);
        let shift = here.midpoint - here.exact;
        exact += u32::from(shift.length() < 1e-12);
        farthest = farthest.max(shift.length());
        rounds = rounds.max(here.rounds);
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
    assert!(exact > 1000 && rounds < 200 && lift < 0.005, "seed {SEED:#x}: {exact} {rounds} {lift}");
    eprintln!("exact in {exact} of 4000, farthest {farthest:.4}, off the body by {lift:.5} at most, rounds {rounds}");
}
