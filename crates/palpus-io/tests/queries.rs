//! Tests of the files of poses, results and contacts.

use std::path::Path;

use glam::{DQuat, DVec3};
use palpus::body::{Feature, FeaturePair};
use palpus::detect::Contact;
use palpus_io::query::read_poses_from;
use palpus_io::{ContactWriter, QueryRow, QueryWriter, read_poses};

#[test]
fn pose_columns_are_found_by_name() {
    let text = "\u{FEFF}# from a tracker\n time , qw,qx,qy,qz,tz,ty,tx\r\n\r\n0, 1,0,0,0,3,2,1\r\n1,0.707,0,0.707,0, -0,1e-3,+5\r\n";
    let poses = read_poses_from(text.as_bytes(), "poses.csv").unwrap();
    assert_eq!(poses.len(), 2);
    assert_eq!(poses[0].translation, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(poses[0].rotation, DQuat::IDENTITY);
    assert!(poses[1].is_valid() && poses[1].translation.z.is_sign_negative());
    assert!((poses[1].vector(DVec3::X) - DVec3::NEG_Z).length() < 1e-12);
}

#[test]
fn pose_errors_name_line_and_column() {
    let expected = "tx,ty,tz,qx,qy,qz,qw";
    let cases = [
        ("".to_owned(), format!("p.csv: the file has no header; the first line must be {expected}")),
        ("0,0,0,0,0,0,1\n".to_owned(), format!("p.csv, line 1: the header has no column tx; it must be {expected}")),
        (
            format!("{expected}\n0,0,0,0,0,0\n"),
            "p.csv, line 2: there are 6 cells but should be 7; correct or remove the line".to_owned(),
        ),
        (
            format!("{expected}\n\n0,0,inf,0,0,0,1\n"),
            "p.csv, line 3, column tz: \"inf\" is not a finite number; correct it".to_owned(),
        ),
        (
            format!("{expected}\n0,0,0,0,,0,1\n"),
            "p.csv, line 2, column qy: \"\" is not a finite number; correct it".to_owned(),
        ),
        (
            format!("{expected}\n0,0,0,1,0,0,1\n"),
            "p.csv, line 2, column qx: the quaternion has length 1.4142135623730951 but must have 1; \
             normalise it (the order is x, y, z, w)"
                .to_owned(),
        ),
        (
            format!("{expected}\n0,0,0,1e200,0,0,1\n"),
            "p.csv, line 2, column qx: the quaternion has length inf but must have 1; \
             normalise it (the order is x, y, z, w)"
                .to_owned(),
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(read_poses_from(text.as_bytes(), "p.csv").unwrap_err().to_string(), expected);
    }
    let error = read_poses_from(b"tx,ty\n\xFF\n", "p.csv").unwrap_err().to_string();
    assert_eq!(error, "p.csv, line 2: the file is not UTF-8 text; is it a CSV file?");
}

#[test]
fn results_have_documented_columns_and_are_read_back() {
    let row = QueryRow {
        frame: 3,
        separation: -0.1 - 0.2,
        normal: DVec3::new(0.0, -0.0, 1.0),
        point_a: DVec3::new(1.0 / 3.0, 1e-20, 2.0),
        point_b: DVec3::splat(1e22),
        contacts: 4,
        certified: true,
        query_us: 12.5,
        contained: palpus::depth::Containment::AInB,
    };
    let mut writer = QueryWriter::new(Vec::new()).unwrap();
    writer.write(&row).unwrap();
    let text = String::from_utf8(writer.finish().unwrap()).unwrap();
    assert_eq!(
        text,
        "frame,separation,normal_x,normal_y,normal_z,point_a_x,point_a_y,point_a_z,point_b_x,point_b_y,point_b_z,contacts,certified,query_us,contained\n\
         3,-0.30000000000000004,0.0,-0.0,1.0,0.3333333333333333,1e-20,2.0,1e22,1e22,1e22,4,true,12.5,1\n"
    );
}

#[test]
fn contacts_have_documented_columns() {
    let contact = Contact {
        piece_a: 5,
        piece_b: 6,
        features: FeaturePair { a: Feature::Vertex(7), b: Feature::Face(8) },
        point_a: DVec3::X,
        point_b: DVec3::Y,
        normal: DVec3::Z,
        separation: 0.5,
        slope: 0.0,
        count: 1.0,
        inside: false,
    };
    let mut writer = ContactWriter::new(Vec::new()).unwrap();
    writer.write(2, &[contact, contact]).unwrap();
    let text = String::from_utf8(writer.finish().unwrap()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0].split(',').count(), lines[1].split(',').count());
    assert_eq!(lines[2], "2,1,0.5,0.0,0.0,1.0,1.0,0.0,0.0,0.0,1.0,0.0,5,6,v7,f8");
}

#[test]
fn reference_poses_are_read_if_present() {
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|above| above.join("shared/reference"));
    let Some(reference) = above.filter(|folder| folder.is_dir()).last() else { return };
    let mut files = 0;
    for folder in std::fs::read_dir(reference.join("convex")).unwrap().chain(std::fs::read_dir(&reference).unwrap()) {
        let Ok(entries) = std::fs::read_dir(folder.unwrap().path()) else { continue };
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.extension().is_some_and(|extension| extension == "csv") {
                assert!(!read_poses(&path).unwrap_or_else(|error| panic!("{error}")).is_empty());
                files += 1;
            }
        }
    }
    assert!(files > 20, "{files}");
}
