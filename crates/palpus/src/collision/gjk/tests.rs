use super::super::oracle::*;
use super::*;

const SEED: u64 = 0x6A6B;

#[test]
fn answers_are_proven_on_every_pair_of_bodies() {
    let mut random = Random::new(SEED);
    let zoo = menagerie(&mut random);
    for (name_a, a) in &zoo {
        for (name_b, b) in &zoo {
            for apart in [0.02, 0.3, 0.5, 0.8, 1.1, 3.0, 30.0] {
                let pose = random_pose(&mut random, a, b, apart);
                let start = FeaturePair { a: random.feature(a), b: random.feature(b) };
                let answer = gjk(a, b, &pose, start);
                assert_eq!(answer.stop, StopReason::Converged, "{name_a}, {name_b}, {apart}, seed {SEED:#x}");
                if let Err(fault) = judge(a, b, &pose, &answer, OFF_GJK) {
                    panic!("{name_a}, {name_b}, {apart}, seed {SEED:#x}: {fault}\n{answer:?}");
                }
            }
        }
    }
}

#[test]
fn distances_equal_the_exhaustive_search() {
    let mut random = Random::new(SEED);
    let zoo: Vec<_> = menagerie(&mut random).into_iter().filter(|(_, p)| p.edges().len() < 40).collect();
    for (name_a, a) in &zoo {
        for (name_b, b) in &zoo {
            for apart in [0.4, 0.8, 1.5] {
                let pose = random_pose(&mut random, a, b, apart);
                let answer = gjk(a, b, &pose, FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) });
                let what = format!("{name_a}, {name_b}, {apart}, seed {SEED:#x}");
                match answer.proximity {
                    Proximity::Disjoint(closest) => {
                        let expected = exhaustive_distance(a, b, &pose);
                        let fault = (closest.distance - expected).abs();
                        assert!(fault <= 1e-10 * expected + 1e-13, "{what}: {} {expected}", closest.distance);
                    }
                    Proximity::Overlapping(_) => {
                        let gap = widest_gap(a, b, &pose);
                        assert!(gap < 1e-12, "{what}: apart by {gap}");
                    }
                }
            }
        }
    }
}

#[test]
fn touching_and_coplanar_bodies_overlap() {
    let unit = cuboid(DVec3::ONE);
    let leaf = plate(5, 0.8);
    let start = FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) };
    for (a, b, shift) in [
        (&unit, &unit, DVec3::new(2.0, 0.3, 0.1)),
        (&unit, &unit, DVec3::new(2.0, 2.0, 0.1)),
        (&unit, &unit, DVec3::splat(2.0)),
        (&unit, &leaf, DVec3::new(0.1, 0.2, 1.0)),
        (&leaf, &leaf, DVec3::new(0.4, 0.1, 0.0)),
        (&leaf, &leaf, DVec3::ZERO),
    ] {
        let pose = Placement { translation: shift, ..Placement::IDENTITY };
        let answer = gjk(a, b, &pose, start);
        assert!(matches!(answer.proximity, Proximity::Overlapping(_)), "{shift}: {answer:?}");
    }
}
