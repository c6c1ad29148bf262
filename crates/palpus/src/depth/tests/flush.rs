//! Tests face on face, edge on face, and other contacts where many points could be the witness.

use super::*;

/// Returns the depth of `a` at `pose` in b's frame, without a previous answer.
fn cold(a: &Polytope, b: &Polytope, pose: &Pose) -> Depth {
    let answer = depth(a, b, &pose.placement(), &[], &mut DepthScratch::new());
    assert_identities(a, b, &pose.placement(), &answer, "flush");
    assert_points_on_bodies(a, b, &pose.placement(), &answer, 2e-9, "flush");
    answer
}

fn assert_near(p: DVec3, q: DVec3) {
    assert!((p - q).length() < 1e-12, "{p} is not {q}");
}

#[test]
fn box_on_table_has_witness_at_overlap_middle() {
    let (cup, table) = (cuboid(DVec3::splat(0.5)), cuboid(DVec3::new(2.0, 2.0, 0.1)));
    let answer = cold(&cup, &table, &Pose::from_translation(DVec3::new(0.3, -0.4, 0.59)));
    assert_near(answer.normal, DVec3::Z);
    assert!((answer.depth - 0.01).abs() < 1e-15);
    assert_near(answer.point_b, DVec3::new(0.3, -0.4, 0.1));
    assert_near(answer.point_a, DVec3::new(0.3, -0.4, 0.09));
    // Half of the box is over the edge of the table. The overlap is 0.5 wide and ends at x = 2.
    let answer = cold(&cup, &table, &Pose::from_translation(DVec3::new(2.0, 0.0, 0.59)));
    assert_near(answer.normal, DVec3::Z);
    assert_near(answer.point_b, DVec3::new(1.75, 0.0, 0.1));
}

#[test]
fn turning_box_keeps_its_witness() {
    let (cup, table) = (cuboid(DVec3::splat(0.5)), cuboid(DVec3::new(2.0, 2.0, 0.1)));
    for k in 0..50 {
        let turn = DQuat::from_rotation_z(0.1 * f64::from(k));
        let answer = cold(&cup, &table, &Pose::new(turn, DVec3::new(0.2, 0.1, 0.58)));
        assert_near(answer.point_b, DVec3::new(0.2, 0.1, 0.1));
    }
}

#[test]
fn edge_on_face_has_witness_at_overlap_middle() {
    // The box stands on an edge along y. This edge extends beyond the table's rim.
    let (tool, table) = (cuboid(DVec3::new(0.3, 1.0, 0.3)), cuboid(DVec3::new(2.0, 2.0, 0.5)));
    let low = 0.3 * std::f64::consts::SQRT_2;
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
    let answer = cold(&tool, &table, &Pose::new(turn, DVec3::new(0.5, 1.6, 0.5 + low - 0.01)));
    assert_near(answer.normal, DVec3::Z);
    assert!((answer.depth - 0.01).abs() < 1e-12);
    // The edge covers y from 0.6 to 2.6. The table ends at y = 2.
    assert_near(answer.point_b, DVec3::new(0.5, 1.3, 0.5));
}

#[test]
fn identical_boxes_separate_along_thinnest_side() {
    let tile = cuboid(DVec3::new(1.0, 0.7, 0.3));
    for turn in [DQuat::IDENTITY, DQuat::from_rotation_z(std::f64::consts::PI), DQuat::from_rotation_z(1e-15)] {
        let answer = cold(&tile, &tile, &Pose::new(turn, DVec3::ZERO));
        assert!((answer.depth - 0.6).abs() < 1e-14, "{answer:?}");
        assert!(answer.normal.z.abs() > 1.0 - 1e-14, "{answer:?}");
        assert_near(answer.point_b.with_z(0.0), DVec3::ZERO);
    }
}

#[test]
fn disk_on_disk_has_witness_at_overlap_middle() {
    let (lid, pot) = (prism(60, 0.5, 0.1), prism(64, 1.0, 0.2));
    let answer = cold(&lid, &pot, &Pose::new(DQuat::from_rotation_z(0.2), DVec3::new(0.1, 0.2, 0.29)));
    assert_near(answer.point_b, DVec3::new(0.1, 0.2, 0.2));
    // The two disks have more corners than the clip buffer can hold. The witness may then be any
    // point of the overlap.
    let (lid, pot) = (prism(90, 0.5, 0.1), prism(100, 1.0, 0.2));
    let answer = cold(&lid, &pot, &Pose::from_translation(DVec3::new(0.1, 0.2, 0.29)));
    assert_near(answer.normal, DVec3::Z);
}

#[test]
fn crossing_plates_separate_along_shortest_direction() {
    // A vertical plate crosses a horizontal plate and extends 0.2 below it.
    let (tool, sheet) = (plate(4, 1.0), plate(4, 2.0));
    let turn = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let answer = cold(&tool, &sheet, &Pose::new(turn, DVec3::new(0.0, 0.0, 0.8)));
    assert!((answer.depth - 0.2).abs() < 1e-12, "{answer:?}");
    assert_near(answer.normal, DVec3::Z);
}

#[test]
fn vertex_with_many_edges_has_global_depth() {
    let cone = |n: u32| solid(&circle(n, 1.0, 0.0).chain([DVec3::new(0.0, 0.0, -1.5)]).collect::<Vec<_>>());
    let (a, b) = (cone(90), cone(70));
    let down = DQuat::from_rotation_x(0.3);
    let up = DQuat::from_rotation_x(std::f64::consts::PI);
    for (turn, z) in [(down, 0.3), (up, -1.0), (down, -1.0), (up * down, -2.0)] {
        let pose = Pose::new(turn, DVec3::new(0.02, -0.01, z));
        let answer = cold(&a, &b, &pose);
        let (exact, _) = super::oracle::exhaustive_depth(&a, &b, &pose.placement());
        assert!((answer.depth - exact).abs() < 1e-9, "{answer:?} is not {exact}");
    }
}
