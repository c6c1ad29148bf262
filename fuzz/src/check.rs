//! Promises of readers and the engine; each function panics where a promise is broken.

use glam::DVec3;
use palpus::body::{Body, PolygonSoup};
use palpus::detect::Contact;

/// An error of a reader is one line, of a size that a person reads, and names the file.
pub fn error(text: &str, file: &str) {
    assert!(text.contains(file), "an error that does not name the file: {text}");
    assert!(!text.contains('\n'), "an error of many lines: {text}");
    assert!(text.len() < 700 + file.len(), "a long error: {text}");
}

/// A soup's coordinates are finite, its indices in range, its faces have three corners or more.
pub fn soup(soup: &PolygonSoup) {
    assert!(soup.vertices.iter().all(|v| v.is_finite()));
    assert!(soup.face_vertices.iter().all(|&v| (v as usize) < soup.vertices.len()));
    assert!(soup.face_count() > 0 && (0..soup.face_count()).all(|f| soup.face(f).len() >= 3));
    assert_eq!(soup.face_starts.last(), Some(&(soup.face_vertices.len() as u32)));
}

/// A body's pieces are sound and of its triangles, its numbers finite.
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

/// Allowed rounding of `point_a − point_b = separation · normal`, relative to the size of the
/// bodies.
const IDENTITY_SLACK: f64 = 1e-9;

/// Contacts are finite, nearer than `tolerance`, and `point_a − point_b = separation · normal`;
/// `size` is that of bodies and pose together.
pub fn contacts(contacts: &[Contact], tolerance: f64, size: f64) {
    for contact in contacts {
        let Contact { point_a, point_b, normal, separation, slope, .. } = *contact;
        assert!(point_a.is_finite() && point_b.is_finite() && normal.is_finite(), "{contact:?}");
        assert!(separation.is_finite() && slope.is_finite() && slope >= 0.0, "{contact:?}");
        assert!((normal.length() - 1.0).abs() < 1e-9, "{contact:?}");
        let gap: DVec3 = point_a - point_b - separation * normal;
        assert!(gap.length() <= IDENTITY_SLACK * size, "off by {:e} of {size}: {contact:?}", gap.length());
        assert!(separation <= tolerance + IDENTITY_SLACK * size, "beyond the tolerance {tolerance}: {contact:?}");
        // Whatever overlaps, no way out is longer than both bodies together.
        assert!(separation >= -2.0 * size, "{contact:?}");
    }
}

/// True if `v` is no longer than `most`. The square of a finite number need not be finite.
pub fn within(v: DVec3, most: f64) -> bool {
    let largest = v.abs().max_element();
    largest <= 0.0 || (v / largest).length() * largest <= most
}
