use std::f64::consts::FRAC_PI_4;

use glam::DQuat;

use super::*;
use crate::refined::push;
use crate::shape::cuboid;

const DEPTH: f64 = 1e-4;

fn boxes() -> Features {
    Features::new(&cuboid(DVec3::new(0.02, 0.01, 0.006)), &cuboid(DVec3::splat(0.04)), 0.006).expect("boxes")
}

/// Returns a pose of the small box in which its lowest point is `DEPTH` below the large box's
/// top.
fn turned(rotation: DQuat, x: f64) -> Pose {
    let corners = [0.01, -0.01]
        .into_iter()
        .flat_map(|x| [0.005, -0.005].into_iter().flat_map(move |y| [0.003, -0.003].map(|z| DVec3::new(x, y, z))));
    let lowest = corners.map(|corner| (rotation * corner).z).fold(0.0, f64::min);
    Pose::new(rotation, DVec3::new(x, 0.0, 0.02 - lowest - DEPTH))
}

#[test]
fn flat_box_has_contacts_at_the_corners_of_the_overlap() {
    let boxes = boxes();
    for (x, middle) in [(0.0, 0.0), (0.015, 0.0125)] {
        let pose = turned(DQuat::IDENTITY, x);
        let contacts = boxes.contacts(&pose, 1e-5).expect("not deep");
        // The contacts are at corners of the small box, and at crossings of its edges with
        // edges of the large box.
        assert_eq!(contacts.len(), 4, "{contacts:?}");
        let (force, torque) = push(&contacts, 0.0, DVec3::new(middle, 0.0, 0.0));
        assert!((force - DVec3::Z * DEPTH).length() < 1e-12, "{force}");
        assert!(torque.expect("known").length() < 1e-12, "{torque:?}");
    }
}

#[test]
fn slightly_tilted_box_may_stand_on_all_corners_of_its_face() {
    let pose = turned(DQuat::from_rotation_y(0.02), 0.0);
    assert_eq!(boxes().contacts(&pose, 1e-3).expect("not deep").len(), 2);
    let supports = boxes().supports(&pose, 1e-3);
    assert!(supports.len() == 4 && supports.iter().all(|contact| contact.normal == DVec3::Z), "{supports:?}");
}

#[test]
fn tilted_box_has_a_contact_at_its_lowest_corner() {
    let pose = turned(DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.3, 0.2), 0.0);
    let contacts = boxes().contacts(&pose, 1e-5).expect("not deep");
    let [contact] = contacts[..] else { panic!("{contacts:?}") };
    assert!((contact.separation + DEPTH).abs() < 1e-12 && contact.normal == DVec3::Z, "{contact:?}");
    // The same pose, moved up: the boxes are `DEPTH` apart.
    let above = Pose { translation: pose.translation + DVec3::Z * (2.0 * DEPTH), ..pose };
    let apart = boxes().contacts(&above, 2.0 * DEPTH).expect("apart");
    assert!(apart.len() == 1 && (apart[0].separation - DEPTH).abs() < 1e-12, "{apart:?}");
}

#[test]
fn crossing_edges_push_across_both() {
    let rod = cuboid(DVec3::new(0.05, 0.01, 0.01));
    let rods = Features::new(&rod, &rod, 0.01).expect("rods");
    let half = 0.005 * std::f64::consts::SQRT_2;
    let below = Pose::new(DQuat::from_rotation_x(FRAC_PI_4), DVec3::ZERO);
    let above = Pose::new(
        DQuat::from_rotation_z(2.0 * FRAC_PI_4) * DQuat::from_rotation_x(FRAC_PI_4),
        DVec3::Z * (2.0 * half - DEPTH),
    );
    let contacts = rods.contacts(&(below.inverse() * above), 1e-5).expect("not deep");
    let [contact] = contacts[..] else { panic!("{contacts:?}") };
    assert!((contact.separation + DEPTH).abs() < 1e-12, "{contact:?}");
    assert!(below.vector(contact.normal).dot(DVec3::Z) > 1.0 - 1e-12, "{contact:?}");
}

#[test]
fn shorter_of_two_translations_is_used() {
    // A small box overlaps the edge of a large box. The boxes are separated by 0.2 mm up, or by
    // `aside` to the side.
    let (small, large) = (cuboid(DVec3::splat(0.01)), cuboid(DVec3::splat(0.04)));
    let boxes = Features::new(&small, &large, 0.02).expect("boxes");
    let over = |aside: f64| {
        let pose = Pose::from_translation(DVec3::new(0.025 - aside, 0.001, 0.025 - 2e-4));
        boxes.contacts(&pose, 1e-5)
    };
    for aside in [5e-4, 5e-3] {
        let found = over(aside).expect("up is much shorter");
        assert!(!found.is_empty() && found.iter().all(|contact| contact.normal.z > 0.5), "{found:?}");
    }
    let found = over(2.5e-4);
    assert!(found.is_none(), "up and aside are equally far: {found:?}");
}

#[test]
fn contact_deeper_than_half_a_wall_is_none() {
    let pose = Pose { translation: DVec3::Z * 0.0195, ..turned(DQuat::IDENTITY, 0.0) };
    assert!(boxes().contacts(&pose, 1e-5).is_none());
}
