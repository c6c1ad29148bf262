//! Compares the direction in which a contact pushes a peg out of a wall with a known answer, and
//! its depth with the proven depth of the whole bodies.

use std::path::Path;
use std::sync::Arc;

use palpus::algebra::Alone;
use palpus::depth::Interior;
use palpus::detect::{Contact, ContactQuery, QuerySettings};
use palpus::glam::{DQuat, DVec3};
use palpus::{Body, BodySettings, GlobalDepth, GlobalMemory, GlobalSettings, Pose};
use palpus_io::read_mesh;

/// Angle between the peg's axis and the vertical, toward the wall (rad).
const LEAN: f64 = 0.2;

fn example(name: &str) -> Arc<Body> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/meshes")).join(name);
    Arc::new(Body::from_soup(&read_mesh(&path).unwrap(), &BodySettings::default(), &mut |_| ()).unwrap())
}

/// Returns the pose of the leaning peg whose foot, 30 mm below its top, has these coordinates (mm).
fn leaning(x: f64, z: f64) -> Pose {
    Pose::new(DQuat::from_rotation_y(-LEAN), DVec3::new(x, 15.0, z))
}

/// Returns how far the rim of the peg's top is beyond the wall's face at x = 6 mm.
fn in_wall(x: f64) -> f64 {
    6.0 - (x - 30.0 * LEAN.sin() - 5.0 * LEAN.cos())
}

fn of_wall(contacts: &[Contact]) -> Option<&Contact> {
    contacts.iter().find(|contact| contact.normal.x.abs() > 0.9)
}

/// The wall is 6 mm thick. Beyond its middle, its far side is nearer to the rim, but the peg must
/// leave through the near side.
#[test]
fn peg_leaves_a_wall_on_the_side_it_entered() {
    let (peg, bracket) = (example("peg.obj"), example("bracket.obj"));
    let mut query =
        ContactQuery::new(peg.clone(), bracket.clone(), QuerySettings { tolerance: 1.0, ..QuerySettings::default() });
    for z in [8.0, 7.0, 6.5, 6.0] {
        for step in 0..50 {
            let x = 16.5 - 0.1 * f64::from(step);
            query.clear();
            let contacts = query.contacts(&leaning(x, z));
            let contact =
                of_wall(contacts).unwrap_or_else(|| panic!("no contact with the wall at ({x}, {z}): {contacts:?}"));
            let off = contact.separation + in_wall(x);
            assert!(contact.normal.x > 0.999 && off.abs() < 1e-9, "at ({x}, {z}), {} mm deep: {contact:?}", in_wall(x));
        }
    }
}

#[test]
fn deepest_contact_of_leaning_peg_is_proven_depth() {
    let (peg, bracket) = (example("peg.obj"), example("bracket.obj"));
    let [inside_peg, inside_bracket] = [&peg, &bracket].map(|body| Interior::new(body, &Alone, &mut |_| ()));
    let whole = GlobalDepth::new(&peg, &inside_peg, &bracket, &inside_bracket);
    let settings = GlobalSettings { gap: 1e-3, ..GlobalSettings::new(&peg, &bracket) };
    let bracketed = whole.run(&leaning(13.0, 8.0), &settings, &mut GlobalMemory::default());
    let mut query = ContactQuery::new(peg, bracket, QuerySettings { tolerance: 1.0, ..QuerySettings::default() });
    let depth = -of_wall(query.contacts(&leaning(13.0, 8.0))).unwrap().separation;
    assert!(depth >= bracketed.lower - 1e-9 && depth <= bracketed.upper + 1e-6, "{depth} mm, proven {bracketed:?}");
}
