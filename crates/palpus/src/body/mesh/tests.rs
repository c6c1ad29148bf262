//! Tests of building meshes from soups.

use super::*;

const BOX_FACES: [[u32; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [0, 4, 7, 3], [1, 2, 6, 5]];

fn push_box(soup: &mut PolygonSoup, low: DVec3, high: DVec3, inward: bool) {
    let base = soup.vertices.len() as u32;
    for z in [low.z, high.z] {
        for (x, y) in [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)] {
            soup.vertices.push(DVec3::new(x, y, z));
        }
    }
    for face in BOX_FACES {
        let mut face = face.map(|v| v + base);
        if inward {
            face.reverse();
        }
        soup.push_face(&face);
    }
}

fn six_volumes(mesh: &Mesh) -> f64 {
    (0..mesh.triangles().len() as u32).map(|t| mesh.triangle_points(t)).map(|[a, b, c]| a.dot(b.cross(c))).sum()
}

#[test]
fn separate_triangles_become_a_closed_box() {
    let mut quads = PolygonSoup::new();
    push_box(&mut quads, DVec3::ZERO, DVec3::ONE, false);
    let mut loose = PolygonSoup::new();
    for face in BOX_FACES {
        for corners in [[face[0], face[1], face[2]], [face[0], face[2], face[3]]] {
            let base = loose.vertices.len() as u32;
            let jitter = DVec3::new(1e-10, -1e-10, 1e-10) * f64::from(base % 5);
            loose.vertices.extend(corners.map(|v| quads.vertices[v as usize] + jitter));
            loose.push_face(&[base, base + 1, base + 2]);
        }
    }
    let (mesh, cleaning) = Mesh::from_soup(&loose).unwrap();
    assert_eq!((mesh.vertices().len(), mesh.triangles().len()), (8, 12));
    assert_eq!(cleaning, Cleaning { welded_vertices: 28, ..Cleaning::default() });
    assert!(mesh.is_closed());
    assert!((six_volumes(&mesh) - 6.0).abs() < 1e-8);
    let (mesh, cleaning) = Mesh::from_soup(&quads).unwrap();
    assert_eq!((mesh.triangles().len(), cleaning), (12, Cleaning::default()));
}

#[test]
fn invalid_input_names_the_vertex_or_face() {
    let good = PolygonSoup::from_triangles(vec![DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]]);
    let mut bad = good.clone();
    bad.vertices[1].y = f64::NAN;
    assert!(matches!(Mesh::from_soup(&bad), Err(MeshError::NotFinite { vertex: 1, .. })));
    bad.vertices[1].y = 1e60;
    assert!(matches!(Mesh::from_soup(&bad), Err(MeshError::TooFar { vertex: 1, .. })));
    let mut bad = good.clone();
    bad.push_face(&[0, 1, 3]);
    let expected = MeshError::IndexOutOfRange { face: 1, index: 3, vertices: 3 };
    assert_eq!(Mesh::from_soup(&bad).unwrap_err(), expected);
    assert_eq!(Mesh::from_soup(&PolygonSoup::new()).unwrap_err(), MeshError::Empty);
    assert_eq!(Mesh::from_soup(&PolygonSoup::default()).unwrap_err(), MeshError::Empty);
    let line = PolygonSoup::from_triangles(vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], &[[0, 1, 2]]);
    assert_eq!(Mesh::from_soup(&line).unwrap_err(), MeshError::NoArea { faces: 1 });
    let mut broken = good;
    broken.face_starts = vec![0, 7, 3];
    assert!(matches!(Mesh::from_soup(&broken), Err(MeshError::BrokenFaces { face: 0 })));
}

#[test]
fn dropped_faces_triangles_and_vertices_are_counted() {
    let mut soup = PolygonSoup::new();
    push_box(&mut soup, DVec3::ZERO, DVec3::ONE, false);
    soup.vertices.push(DVec3::splat(1e9));
    soup.push_face(&[0, 3, 2, 1]);
    soup.push_face(&[0, 0, 1]);
    soup.push_face(&[4, 2]);
    let (mesh, cleaning) = Mesh::from_soup(&soup).unwrap();
    let expected = Cleaning { unused_vertices: 1, duplicate_triangles: 2, degenerate_faces: 2, ..Cleaning::default() };
    assert_eq!(cleaning, expected);
    assert!(mesh.is_closed());
}

#[test]
fn replacing_a_cap_leaves_no_gap() {
    // A tetrahedron with an extra corner 4 in the middle of edge 0–1. Triangle 0–1–4 has no area.
    let vertices = vec![DVec3::ZERO, DVec3::new(1.0, 0.0, 0.0), DVec3::Y, DVec3::Z, DVec3::new(0.5, 0.0, 0.0)];
    let triangles = [[0, 2, 1], [0, 4, 3], [4, 1, 3], [0, 1, 4], [1, 2, 3], [2, 0, 3]];
    let (mesh, cleaning) = Mesh::from_soup(&PolygonSoup::from_triangles(vertices, &triangles)).unwrap();
    assert_eq!(cleaning, Cleaning { exchanged_triangles: 1, ..Cleaning::default() });
    assert!(mesh.is_closed());
    assert_eq!(mesh.triangles().len(), 6);
    assert!((six_volumes(&mesh) - 1.0).abs() < 1e-15);
}

#[test]
fn inconsistent_and_inverted_triangles_are_flipped() {
    for inward in [false, true] {
        let mut soup = PolygonSoup::new();
        push_box(&mut soup, DVec3::splat(3.0), DVec3::splat(4.0), inward);
        soup.face_vertices[..4].reverse();
        let (mesh, cleaning) = Mesh::from_soup(&soup).unwrap();
        assert_eq!((cleaning.turned_triangles, cleaning.inverted_components), (2, usize::from(inward)));
        assert!((six_volumes(&mesh) - 6.0).abs() < 1e-12);
    }
}

#[test]
fn cavities_keep_their_orientation() {
    // Columns: normals of the outer box point inward, normals of the inner box point inward,
    // expected volume, expected number of inverted components.
    for (outer, inner, volume, inverted) in [
        (false, true, 27.0 - 1.0, 0),
        (true, false, 27.0 - 1.0, 2),
        (false, false, 27.0 + 1.0, 0),
        (true, true, 27.0 + 1.0, 2),
    ] {
        let mut soup = PolygonSoup::new();
        push_box(&mut soup, DVec3::ONE, DVec3::splat(2.0), inner);
        push_box(&mut soup, DVec3::ZERO, DVec3::splat(3.0), outer);
        push_box(&mut soup, DVec3::splat(4.0), DVec3::splat(5.0), false);
        let (mesh, cleaning) = Mesh::from_soup(&soup).unwrap();
        assert_eq!(mesh.component_count(), 3);
        assert_eq!(cleaning.inverted_components, inverted);
        assert!((six_volumes(&mesh) / 6.0 - volume - 1.0).abs() < 1e-12);
        assert_eq!(mesh.tree().inside(DVec3::splat(1.5)), volume > 27.0);
        assert!(mesh.tree().inside(DVec3::splat(0.5)));
    }
}

#[test]
fn a_moebius_band_is_counted_as_one_sided() {
    let mut soup = PolygonSoup::new();
    let n = 12_u32;
    for i in 0..n {
        let angle = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        let rim = DVec3::new(angle.cos(), angle.sin(), 0.0);
        let across = (rim * (angle / 2.0).cos() + DVec3::Z * (angle / 2.0).sin()) * 0.3;
        soup.vertices.extend([rim - across, rim + across]);
    }
    for i in 0..n {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
        soup.push_face(&[a, b, d]);
        soup.push_face(&[a, d, c]);
    }
    let (mesh, cleaning) = Mesh::from_soup(&soup).unwrap();
    assert_eq!(cleaning.one_sided_components, 1);
    assert!(!mesh.is_closed());
}

/// Returns a box of size 1 whose top has a square hole with sides of `hole`. With 1, the top is
/// missing.
fn box_with_hole(hole: f64) -> Mesh {
    let mut soup = PolygonSoup::new();
    push_box(&mut soup, DVec3::ZERO, DVec3::ONE, false);
    let mut open = PolygonSoup::new();
    open.vertices = soup.vertices.clone();
    for face in BOX_FACES.iter().filter(|face| **face != [4, 5, 6, 7]) {
        open.push_face(face);
    }
    if hole < 1.0 {
        let rim = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        open.vertices.extend(rim.map(|(x, y)| DVec3::new(0.5 + 0.5 * hole * x, 0.5 + 0.5 * hole * y, 1.0)));
        for k in 0..4 {
            let next = (k + 1) % 4;
            open.push_face(&[4 + k, 4 + next, 8 + next, 8 + k]);
        }
    }
    Mesh::from_soup(&open).unwrap().0
}

#[test]
fn a_component_with_a_wide_opening_is_a_sheet() {
    let mut closed = PolygonSoup::new();
    push_box(&mut closed, DVec3::ZERO, DVec3::ONE, false);
    let closed = Mesh::from_soup(&closed).unwrap().0;
    assert!(closed.is_component_closed(0) && !closed.is_sheet(0));
    for (hole, sheet) in [(1.0, true), (0.1, true), (0.01, false)] {
        let mesh = box_with_hole(hole);
        assert_eq!(mesh.component_count(), 1);
        assert!(!mesh.is_component_closed(0));
        assert_eq!(mesh.is_sheet(0), sheet, "a hole of {hole}");
    }
}
