//! Contacts of two meshes, and their depths.
//!
//! `cargo run --release -p palpus-examples --example contacts -- TOOL PART`: two mesh files in
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
        _ => Err("name two mesh files, or none".into()),
    }
}

fn print_contacts(files: [&str; 2]) -> Result<(), Box<dyn Error>> {
    // Metres inside palpus: a model in millimetres is scaled by a thousandth.
    let settings = BodySettings { scale: 1e-3, ..BodySettings::default() };
    let [tool, part] = files.map(|file| -> Result<_, Box<dyn Error>> {
        let body = Body::from_soup(&read_mesh(Path::new(file))?, &settings, &mut |_| ())?;
        println!("{file}: {} triangles, {} convex pieces", body.mesh().triangles().len(), body.pieces().len());
        Ok(Arc::new(body))
    });
    let mut query = ContactQuery::new(tool?, part?, QuerySettings { tolerance: 1e-3, ..QuerySettings::default() });

    // The tool leans in the part's inner corner. Poses that follow each other closely are answered
    // fastest.
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
fn prints() {
    print_contacts(MESHES).unwrap();
}
