//! Contacts of two meshes, with their separations.
//!
//! `cargo run --release -p palpus-examples --example contacts -- TOOL PART`, with two mesh files in
//! millimetres.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use palpus::glam::{DQuat, DVec3};
use palpus::{Body, BodySettings, ContactQuery, Pose, QuerySettings};
use palpus_io::read_mesh;

const MESHES: [&str; 2] = [
    concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/peg.obj"),
    concat!(env!("CARGO_MANIFEST_DIR"), "/meshes/bracket.obj"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let typed: Vec<String> = std::env::args().skip(1).collect();
    match &typed[..] {
        [tool, part] => print_contacts([tool, part]),
        [] => print_contacts(MESHES),
        _ => Err("give two mesh files, or none".into()),
    }
}

fn print_contacts(files: [&str; 2]) -> Result<(), Box<dyn Error>> {
    // palpus uses metres, so a model in millimetres is scaled by 1/1000.
    let settings = BodySettings { scale: 1e-3, ..BodySettings::default() };
    let [tool, part] = files.map(|file| -> Result<_, Box<dyn Error>> {
        let body = Body::from_soup(&read_mesh(Path::new(file))?, &settings, &mut |_| ())?;
        println!("{file}: {} triangles, {} convex pieces", body.mesh().triangles().len(), body.pieces().len());
        Ok(Arc::new(body))
    });
    let mut query = ContactQuery::new(tool?, part?, QuerySettings { tolerance: 1e-3, ..QuerySettings::default() });

    // The tool leans in the part's inner corner. A query is fastest if its pose is close to the
    // previous one.
    for height in [8.0, 6.9, 6.4] {
        let lean = DQuat::from_rotation_y(-0.2);
        let pose = Pose::new(lean, DVec3::new(17.2, 15.0, height) * 1e-3);
        let contacts = query.contacts(&pose);
        println!("foot at {height} mm: {} contacts within 1 mm", contacts.len());
        for contact in contacts {
            let (at, normal) = (contact.point_b * 1e3, contact.normal);
            println!("  {:8.4} mm apart at {at:.2} mm, normal {normal:.3}", contact.separation * 1e3);
        }
    }
    Ok(())
}

#[test]
fn example_prints_contacts() {
    print_contacts(MESHES).unwrap();
}
