//! Face on face, edge on face, and other contacts in which many points could be the witness.

use super::*;

/// The depth of `a` placed in b's frame, cold.
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
fn a_box_on_a_table_is_held_under_the_middle_of_its_overlap() {
    let (cup, table) = (cuboid(DVec3::splat(0.5)), cuboid(DVec3::new(2.0, 2.0, 0.1)));
    let answer = cold(&cup, &table, &Pose::from_translation(DVec3::new(0.3, -0.4, 0.59)));
    assert_near(answer.normal, DVec3::Z);
    assert!((answer.depth - 0.01).abs() < 1e-15);
    assert_near(answer.point_b, DVec3::new(0.3, -0.4, 0.1));
    assert_near(answer.point_a, DVec3::new(0.3, -0.4, 0.09));
    // Half over the edge of the table: the overlap is 0.5 wide and ends at x = 2.
    let answer = cold(&cup, &table, &Pose::from_translation(DVec3::new(2.0, 0.0, 0.59)));
    assert_near(answer.normal, DVec3::Z);
    assert_near(answer.point_b, DVec3::new(1.75, 0.0, 0.1));
}

#[test]
fn a_turning_box_keeps_its_witness_in_place() {
    let (cup, table) = (cuboid(DVec3::splat(0.5)), cuboid(DVec3::new(2.0, 2.0, 0.1)));
    for k in 0..50 {
        let turn = DQuat::from_rotation_z(0.1 * f64::from(k));
        let answer = cold(&cup, &table, &Pose::new(turn, DVec3::new(0.2, 0.1, 0.58)));
        assert_near(answer.point_b, DVec3::new(0.2, 0.1, 0.1));
    }
}

#[test]
fn an_edge_on_a_face_is_held_at_the_middle_of_what_lies_on_it() {
    // A box on one of its edges, which runs along y and reaches over the table's rim.
    let (tool, table) = (cuboid(DVec3::new(0.3, 1.0, 0.3)), cuboid(DVec3::new(2.0, 2.0, 0.5)));
    let low = 0.3 * std::f64::consts::SQRT_2;
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_4);
    let answer = cold(&tool, &table, &Pose::new(turn, DVec3::new(0.5, 1.6, 0.5 + low - 0.01)));
    assert_near(answer.normal, DVec3::Z);
    assert!((answer.depth - 0.01).abs() < 1e-12);
    // The edge covers y from 0.6 to 2.6, the table ends at 2.
    assert_near(answer.point_b, DVec3::new(0.5, 1.3, 0.5));
}

#[test]
fn concentric_and_identical_boxes_part_along_their_thinnest_side() {
    let tile = cuboid(DVec3::new(1.0, 0.7, 0.3));
    for turn in [DQuat::IDENTITY, DQuat::from_rotation_z(std::f64::consts::PI), DQuat::from_rotation_z(1e-15)] {
        let answer = cold(&tile, &tile, &Pose::new(turn, DVec3::ZERO));
        assert!((answer.depth - 0.6).abs() < 1e-14, "{answer:?}");
        assert!(answer.normal.z.abs() > 1.0 - 1e-14, "{answer:?}");
        assert_near(answer.point_b.with_z(0.0), DVec3::ZERO);
    }
}

#[test]
fn round_fans_on_each_other_have_their_common_middle() {
    let (lid, pot) = (prism(60, 0.5, 0.1), prism(64, 1.0, 0.2));
    let answer = cold(&lid, &pot, &Pose::new(DQuat::from_rotation_z(0.2), DVec3::new(0.1, 0.2, 0.29)));
    assert_near(answer.point_b, DVec3::new(0.1, 0.2, 0.2));
    // More corners in sum than the clip keeps: some point of the overlap.
    let (lid, pot) = (prism(90, 0.5, 0.1), prism(100, 1.0, 0.2));
    let answer = cold(&lid, &pot, &Pose::from_translation(DVec3::new(0.1, 0.2, 0.29)));
    assert_near(answer.normal, DVec3::Z);
}

#[test]
fn two_plates_that_cross_part_along_the_shorter_way_out() {
    // A vertical plate through a horizontal one; it stands 0.2 below it.
    let (tool, sheet) = (plate(4, 1.0), plate(4, 2.0));
    let turn = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let answer = cold(&tool, &sheet, &Pose::new(turn, DVec3::new(0.0, 0.0, 0.8)));
    assert!((answer.depth - 0.2).abs() < 1e-12, "{answer:?}");
    assert_near(answer.normal, DVec3::Z);
}

#[test]
fn a_vertex_with_more_edges_than_a_page_is_walked_like_any_other() {
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
