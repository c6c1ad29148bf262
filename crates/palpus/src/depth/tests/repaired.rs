//! Answers that rest on virtual features, and their repair.

use super::*;
use crate::depth::cso::Cso;

/// Whether the answer's normal is that of an original face, or rests on two original edges.
fn assert_original(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &Depth, what: &str) {
    assert!(is_original(a, b, answer.antipodal), "{what}: {answer:?}");
    let cso = Cso { a, b, pose_ba };
    match cso.face_normal(answer.antipodal) {
        Some(normal) => assert!((normal - answer.normal).length() < 1e-14, "{what}"),
        None => {
            let Antipodal::EdgeEdge { a: e, b: f } = answer.antipodal else { return };
            let (e, f) = (a.edge(e), b.edge(f));
            let along_a = pose_ba.vector(a.vertex(e.head) - a.vertex(e.tail)).normalize();
            let along_b = (b.vertex(f.head) - b.vertex(f.tail)).normalize();
            assert!(answer.normal.dot(along_a).abs() + answer.normal.dot(along_b).abs() < 1e-9, "{what}");
        }
    }
}

fn tagged(polytope: &Polytope, original: impl Fn(&Polytope, u32) -> bool) -> Polytope {
    let of = |p: &Polytope, f| if original(p, f) { Provenance::Original } else { Provenance::Virtual };
    polytope.clone().with_provenance(of)
}

#[test]
fn an_original_answer_stands() {
    let (a, b) = (cuboid(DVec3::ONE), cuboid(DVec3::ONE));
    let placement = Pose::from_translation(DVec3::new(0.1, 0.2, 1.9)).placement();
    let mut scratch = WalkScratch::new();
    let answer = depth(&a, &b, &placement, &[], &mut scratch);
    assert_eq!(repair(&a, &b, &placement, &answer, &mut scratch), Some(answer));
}

#[test]
fn a_plate_pushes_out_of_its_front() {
    // The tip of the tetrahedron points up through the plate from below, 0.1 over it; its base is virtual.
    let tool = tagged(&tetra(1.2), |p, f| p.plane(f).normal.z > -0.9);
    let sheet = plate(4, 4.0);
    let placement = Pose::from_translation(DVec3::new(0.0, 0.0, -1.1)).placement();
    let mut scratch = WalkScratch::new();
    let answer = depth(&tool, &sheet, &placement, &[], &mut scratch);
    assert!((answer.normal + DVec3::Z).length() < 1e-12 && (answer.depth - 0.1).abs() < 1e-12, "{answer:?}");
    let repaired = repair(&tool, &sheet, &placement, &answer, &mut scratch).unwrap();
    assert_original(&tool, &sheet, &placement, &repaired, "plate");
    assert!(repaired.normal.z > -0.9, "out of the back: {repaired:?}");
}

#[test]
fn flush_with_a_virtual_face_the_original_one_counts() {
    let lid = cuboid(DVec3::splat(0.5));
    let table = tagged(&cuboid(DVec3::new(2.0, 2.0, 0.1)), |_, _| false);
    let placement = Pose::from_translation(DVec3::new(0.0, 0.0, 0.59)).placement();
    let mut scratch = WalkScratch::new();
    let answer = depth(&lid, &table, &placement, &[], &mut scratch);
    let repaired = repair(&lid, &table, &placement, &answer, &mut scratch).unwrap();
    assert!(matches!(repaired.antipodal, Antipodal::FaceVertex { .. }), "{repaired:?}");
    assert!((repaired.normal - DVec3::Z).length() < 1e-12 && (repaired.depth - answer.depth).abs() < 1e-12);
}

#[test]
fn without_original_faces_there_is_no_contact() {
    let cube = tagged(&cuboid(DVec3::ONE), |_, _| false);
    let placement = Pose::from_translation(DVec3::new(0.1, 0.2, 1.9)).placement();
    let mut scratch = WalkScratch::new();
    let answer = depth(&cube, &cube, &placement, &[], &mut scratch);
    assert_eq!(repair(&cube, &cube, &placement, &answer, &mut scratch), None);
}

#[test]
fn a_repaired_answer_is_original_and_keeps_the_identities() {
    let shapes = shapes();
    let mut rng = SplitMix64(SEED);
    let mut scratch = WalkScratch::new();
    let mut repaired_count = 0;
    for k in 0..3000 {
        let (name_a, a) = &shapes[rng.below(shapes.len())];
        let (name_b, b) = &shapes[rng.below(shapes.len())];
        let (facing_a, facing_b) = (rng.direction(), rng.direction());
        let a = &tagged(a, |p, f| p.plane(f).normal.dot(facing_a) > 0.5);
        let b = &tagged(b, |p, f| p.plane(f).normal.dot(facing_b) > 0.5);
        let placement = random_pose(&mut rng, a, b).placement();
        let what = format!("{name_a} on {name_b}, pose {k}, seed {SEED:#x}");
        let answer = depth(a, b, &placement, &[], &mut scratch);
        let any = |p: &Polytope| (0..p.face_count() as u32).any(|f| p.face_provenance(f) == Provenance::Original);
        let Some(repaired) = repair(a, b, &placement, &answer, &mut scratch) else {
            assert!(!any(a) && !any(b), "{what}: there are original faces");
            continue;
        };
        assert_identities(a, b, &placement, &repaired, &what);
        assert_original(a, b, &placement, &repaired, &what);
        repaired_count += u32::from(repaired.antipodal != answer.antipodal);
    }
    assert!(repaired_count > 500, "{repaired_count}");
}
