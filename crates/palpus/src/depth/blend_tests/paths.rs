//! Bodies that move along paths on which exact witnesses jump.

use glam::{DQuat, DVec3};

use super::*;

/// Turned about `axis` by `angle`, with its lowest vertex at height `height`.
fn resting(polytope: &Polytope, turn: DQuat, height: f64) -> Pose {
    let lowest = polytope.vertices().iter().map(|v| (turn * *v).z).fold(f64::INFINITY, f64::min);
    Pose::new(turn, DVec3::Z * (height - lowest))
}

#[test]
fn a_box_tilting_through_flat_on_a_table() {
    let (a, b) = (the_box(), table());
    let tilt = |s: f64| (4.0 * s - 2.0).to_radians();
    for height in HEIGHTS {
        let path = |s: f64| resting(&a, DQuat::from_rotation_y(tilt(s)), height);
        check(&format!("tilt about y at {height}"), &follow(&a, &b, 40_000, path));
        let oblique = DVec3::new(0.6, 0.8, 0.0);
        let path = |s: f64| resting(&a, DQuat::from_axis_angle(oblique, tilt(s)), height);
        check(&format!("tilt obliquely at {height}"), &follow(&a, &b, 10_000, path));
    }
    // The middle stays, or sinks, and the corners go from apart to deep and back.
    for sink in [0.0, 1e-3] {
        let path =
            |s: f64| Pose::new(DQuat::from_rotation_y(tilt(s)), DVec3::Z * (0.03 + 0.3 * TOLERANCE + sink * (0.5 - s)));
        let figures = follow(&a, &b, 40_000, path);
        assert!(figures.separation[0] < 0.0 && figures.separation[1] > 0.0);
        check(&format!("tilt about y through zero, sinking {sink}"), &figures);
    }
}

#[test]
fn a_box_sliding_over_the_edge_of_a_table() {
    let (a, b) = (the_box(), table());
    for height in HEIGHTS {
        for twist in [0.0, 1e-3, 1.0, 3.0, 30.0] {
            let turn = DQuat::from_rotation_z(f64::to_radians(twist));
            let reach = a.vertices().iter().map(|v| (turn * *v).x).fold(0.0, f64::max);
            let at = |x: f64| Pose::new(turn, DVec3::new(0.2 + reach + x, 0.01, 0.03 + height));
            let path = |s: f64| at(0.105 * s - 0.1);
            check(&format!("slide at {twist}°, {height}"), &follow(&a, &b, 10_000, path));
            // Over the edge the normal turns, within the separation; or jumps, where the depth is less sideways.
            let near = 4.0 * height.abs().max(1e-5);
            let path = |s: f64| at(near * (2.0 * s - 1.0));
            check(&format!("over the edge at {twist}°, {height}"), &follow(&a, &b, 10_000, path));
        }
    }
    // Sinking below the table's top while it slides off.
    for twist in [0.0, 1e-3, 1.0, 3.0, 30.0] {
        let turn = DQuat::from_rotation_z(f64::to_radians(twist));
        let reach = a.vertices().iter().map(|v| (turn * *v).x).fold(0.0, f64::max);
        let path = |s: f64| Pose::new(turn, DVec3::new(0.195 + reach + 0.006 * s, 0.01, 0.0302 - 4e-4 * s));
        let figures = follow(&a, &b, 20_000, path);
        assert!(figures.separation[0] < 0.0 && figures.separation[1] > 0.0);
        check(&format!("over the edge at {twist}°, sinking through zero"), &figures);
    }
}

#[test]
fn edges_rolling_over_a_face() {
    let b = table();
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        for sides in [3, 6, 32] {
            let a = prism(sides, 0.02, 0.04);
            for axis in [DVec3::Y, DVec3::new(0.02, 1.0, 0.0).normalize()] {
                let path = |s: f64| {
                    let roll = TAU * s;
                    Pose::new(
                        DQuat::from_axis_angle(axis, roll),
                        resting(&a, DQuat::from_axis_angle(axis, roll), height).translation
                            + DVec3::X * (0.02 * (roll - 3.0)),
                    )
                };
                check(&format!("{sides} sides rolling, {name}"), &follow(&a, &b, 20_000, path));
            }
            let path = |s: f64| {
                let roll = DQuat::from_rotation_x((8.0 * s - 4.0).to_radians()) * DQuat::from_rotation_y(0.3);
                resting(&a, roll, height)
            };
            check(&format!("{sides} sides pitching, {name}"), &follow(&a, &b, 20_000, path));
        }
    }
}

#[test]
fn edges_crossing_through_parallel() {
    // Two roofs, edge against edge.
    let (a, b) = (prism(4, 0.02, 0.04), prism(4, 0.03, 0.06));
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        for offset in [DVec3::ZERO, DVec3::new(0.0, 0.03, 0.0), DVec3::new(1e-5, 0.02, 0.0)] {
            let path = |s: f64| {
                let turn = DQuat::from_rotation_z((40.0 * s - 20.0).to_radians());
                Pose::new(turn, offset + DVec3::Z * (0.05 + height))
            };
            // Deep, sideways is the nearer way out as soon as the roofs cross enough.
            check(&format!("roofs turning at {offset}, {name}"), &follow(&a, &b, 40_000, path));
        }
    }
    // One edge pitching over the other. (Not deep: there the ways out to both sides tie, and the normal must jump.)
    for offset in [DVec3::ZERO, DVec3::new(0.0, 0.03, 0.0), DVec3::new(1e-5, 0.02, 0.0)] {
        let path = |s: f64| {
            let mut pose = resting(&a, DQuat::from_rotation_x((4.0 * s - 2.0).to_radians()), 0.03 + 0.5 * TOLERANCE);
            pose.translation += offset;
            pose
        };
        check(&format!("roofs pitching at {offset}"), &follow(&a, &b, 40_000, path));
    }
}

#[test]
fn a_plate_on_edge_pitching_over_a_table() {
    let corners = [DVec3::new(0.0, -0.04, 0.0), DVec3::new(0.0, 0.04, 0.0), DVec3::new(0.0, 0.03, 0.05)];
    let a = Polytope::from_polygon(corners.to_vec(), DVec3::X, Provenance::Original).unwrap();
    let b = table();
    for (name, height) in [("apart", 0.5 * TOLERANCE), ("touching", 0.0), ("deep", -0.5 * TOLERANCE)] {
        let path = |s: f64| resting(&a, DQuat::from_rotation_x((20.0 * s - 10.0).to_radians()), height);
        check(&format!("plate pitching, {name}"), &follow(&a, &b, 20_000, path));
        let path = |s: f64| resting(&a, DQuat::from_rotation_y((40.0 * s - 20.0).to_radians()), height);
        check(&format!("plate leaning, {name}"), &follow(&a, &b, 20_000, path));
    }
}
