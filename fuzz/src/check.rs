//! Checks of the guarantees of the readers and the engine. Each function panics if a guarantee is
//! violated.

use glam::DVec3;
use palpus::body::{Body, PolygonSoup};
use palpus::detect::Contact;

/// Checks that an error of a reader is a single line of moderate length that names the file.
pub fn error(text: &str, file: &str) {
    assert!(text.contains(file), "an error that does not name the file: {text}");
    assert!(!text.contains('\n'), "an error of many lines: {text}");
    assert!(text.len() < 700 + file.len(), "a long error: {text}");
}

/// Checks that the coordinates of a soup are finite, its indices are in range, and each face has at
/// least three corners.
pub fn soup(soup: &PolygonSoup) {
    assert!(soup.vertices.iter().all(|v| v.is_finite()));
    assert!(soup.face_vertices.iter().all(|&v| (v as usize) < soup.vertices.len()));
    assert!(soup.face_count() > 0 && (0..soup.face_count()).all(|f| soup.face(f).len() >= 3));
    assert_eq!(soup.face_starts.last(), Some(&(soup.face_vertices.len() as u32)));
}

/// Checks that the pieces of a body are valid and refer to its triangles, and that its numbers are
/// finite.
pub fn body(body: &Body) {
    assert!(!body.polytopes().is_empty() && body.polytopes().len() == body.pieces().len());
    for polytope in body.polytopes().iter().chain(body.hierarchy().hulls()) {
        assert_eq!(polytope.validate_topology(), Ok(()));
        assert!(polytope.centroid().is_finite() && polytope.radius().is_finite());
    }
    let triangles = body.mesh().triangles().len() as u32;
    assert!(body.pieces().iter().flat_map(|piece| piece.triangles()).all(|&t| t < triangles));
    assert!(body.mesh().vertices().iter().all(|v| v.is_finite()) && body.size().is_finite() && body.size() > 0.0);
    let mass = body.mass();
    assert!(mass.volume.is_finite() && mass.center_of_mass.is_finite(), "{mass:?}");
}

/// Allowed rounding error of `point_a − point_b = separation · normal`, relative to the size of the
/// bodies.
const IDENTITY_SLACK: f64 = 1e-9;

/// Checks that contacts are finite, closer than `tolerance`, and satisfy `point_a − point_b =
/// separation · normal`. `size` is the sum of the sizes of the bodies and the length of the pose's
/// translation.
pub fn contacts(contacts: &[Contact], tolerance: f64, size: f64) {
    for contact in contacts {
        let Contact { point_a, point_b, normal, separation, slope, .. } = *contact;
        assert!(point_a.is_finite() && point_b.is_finite() && normal.is_finite(), "{contact:?}");
        assert!(separation.is_finite() && slope.is_finite() && slope >= 0.0, "{contact:?}");
        assert!((normal.length() - 1.0).abs() < 1e-9, "{contact:?}");
        let gap: DVec3 = point_a - point_b - separation * normal;
        assert!(gap.length() <= IDENTITY_SLACK * size, "off by {:e} of {size}: {contact:?}", gap.length());
        assert!(separation <= tolerance + IDENTITY_SLACK * size, "beyond the tolerance {tolerance}: {contact:?}");
        // The depth of an overlap does not exceed the total size of both bodies.
        assert!(separation >= -2.0 * size, "{contact:?}");
    }
}

/// Returns true if `v` is not longer than `most`. The squared length of a finite vector may be
/// infinite.
pub fn within(v: DVec3, most: f64) -> bool {
    let largest = v.abs().max_element();
    largest <= 0.0 || (v / largest).length() * largest <= most
}
