//! A body for drawing: triangles, the normal at each of their corners, and the convex piece of each
//! triangle.
//!
//! 1. *Whole*: the mesh's own triangles. The normal at a corner is the mean normal of the triangles
//!    around the vertex that turn by less than [`CREASE`]. Other triangles form a visible edge.
//! 2. *Apart*: the faces of every convex piece, moved away from the body's middle.

use glam::DVec3;
use palpus::body::{Body, Polytope};

/// cos 40°: a larger angle between triangles looks like an edge.
const CREASE: f64 = 0.766;
/// Vertices with more triangles than this are not smoothed, because the work grows with the
/// square of the number.
const MOST_ROUND: usize = 96;

/// Triangles of one body, in the body's frame.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    /// Positions of the vertices, m.
    pub vertices: Vec<DVec3>,
    /// Indices into the vertices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Unit outward normals at the three corners of each triangle.
    pub normals: Vec<[DVec3; 3]>,
    /// The convex piece of each triangle.
    pub pieces: Vec<u32>,
}

impl Solid {
    /// Makes a solid from the mesh of a body.
    pub fn of_body(body: &Body) -> Self {
        let mesh = body.mesh();
        let triangles = mesh.triangles().to_vec();
        let mut pieces = vec![0; triangles.len()];
        for (k, piece) in body.pieces().iter().enumerate() {
            for &t in piece.triangles() {
                pieces[t as usize] = k as u32;
            }
        }
        let flat: Vec<DVec3> = (0..triangles.len() as u32).map(|t| mesh.triangle_normal(t)).collect();
        let areas: Vec<f64> = (0..triangles.len() as u32).map(|t| mesh.triangle_area(t)).collect();
        let normals = corner_normals(mesh.vertices().len(), &triangles, &flat, &areas);
        Self { vertices: mesh.vertices().to_vec(), triangles, normals, pieces }
    }

    /// Makes a solid from the convex pieces of a body, each moved away from the middle of the
    /// body's box by `spread` times its own distance.
    pub fn exploded(body: &Body, spread: f64) -> Self {
        let mut solid = Self::default();
        for (k, piece) in body.polytopes().iter().enumerate() {
            solid.add_faces(piece, k as u32, Self::shift(body, k as u32, spread), |_| true);
        }
        solid
    }

    /// Returns the displacement of a piece when pieces are apart.
    pub(crate) fn shift(body: &Body, piece: u32, spread: f64) -> DVec3 {
        let bounds = body.mesh().bounds();
        let middle = (bounds.min + bounds.max) * 0.5;
        (body.polytopes()[piece as usize].centroid() - middle) * spread
    }

    /// Makes a solid without the triangles of one piece.
    #[cfg(feature = "gui")]
    pub(crate) fn without(mut self, piece: u32) -> Self {
        let keep: Vec<bool> = self.pieces.iter().map(|k| *k != piece).collect();
        let (mut triangle, mut normals) = (keep.iter().copied(), keep.iter().copied());
        self.triangles.retain(|_| triangle.next().unwrap_or(true));
        self.normals.retain(|_| normals.next().unwrap_or(true));
        self.pieces.retain(|k| *k != piece);
        self
    }

    /// Returns the first triangle on a ray, from either side: the distance along `direction`, and
    /// the triangle's piece.
    #[cfg(feature = "gui")]
    pub(crate) fn first_met(&self, origin: DVec3, direction: DVec3) -> Option<(f64, u32)> {
        let met = self.triangles.iter().zip(&self.pieces).filter_map(|(triangle, piece)| {
            let [a, b, c] = triangle.map(|v| self.vertices[v as usize]);
            // T. Möller, B. Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997.
            let (side, other) = (b - a, c - a);
            let across = direction.cross(other);
            let determinant = side.dot(across);
            let from = origin - a;
            let u = from.dot(across) / determinant;
            let lift = from.cross(side);
            let v = direction.dot(lift) / determinant;
            let t = other.dot(lift) / determinant;
            (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t.is_finite()).then_some((t, *piece))
        });
        met.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Adds the faces of a piece that `which` selects, moved by `shift`.
    pub(crate) fn add_faces(&mut self, piece: &Polytope, k: u32, shift: DVec3, which: impl Fn(u32) -> bool) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(piece.vertices().iter().map(|v| *v + shift));
        // A rim has no width.
        for f in (0..piece.face_count() as u32).filter(|&f| !piece.is_rim(f) && which(f)) {
            let normal = piece.plane(f).normal;
            let corners: Vec<u32> = piece.face_vertices(f).iter().collect();
            for pair in corners.windows(2).skip(1) {
                self.triangles.push([first + corners[0], first + pair[0], first + pair[1]]);
                self.normals.push([normal; 3]);
                self.pieces.push(k);
            }
        }
    }

    /// Returns the lower and the upper corner of the box around all vertices.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.vertices.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
    }
}

/// Returns the normal at each corner of each triangle.
fn corner_normals(vertex_count: usize, triangles: &[[u32; 3]], flat: &[DVec3], areas: &[f64]) -> Vec<[DVec3; 3]> {
    let mut starts = vec![0u32; vertex_count + 1];
    for &v in triangles.iter().flatten() {
        starts[v as usize + 1] += 1;
    }
    for k in 0..vertex_count {
        starts[k + 1] += starts[k];
    }
    let mut next = starts.clone();
    let mut around = vec![0u32; triangles.len() * 3];
    for (t, corners) in triangles.iter().enumerate() {
        for &v in corners {
            around[next[v as usize] as usize] = t as u32;
            next[v as usize] += 1;
        }
    }
    let at = |t: usize, v: u32| {
        let own = flat[t];
        let round = &around[starts[v as usize] as usize..starts[v as usize + 1] as usize];
        if round.len() > MOST_ROUND {
            return own;
        }
        let alike = round.iter().map(|&u| u as usize).filter(|&u| flat[u].dot(own) > CREASE);
        alike.map(|u| flat[u] * areas[u]).sum::<DVec3>().normalize_or(own)
    };
    triangles.iter().enumerate().map(|(t, corners)| corners.map(|v| at(t, v))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "gui")]
    #[test]
    fn ray_meets_the_nearest_face_and_skips_removed_pieces() {
        let side = |k: usize, bit: usize| (k >> bit & 1) as f64;
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
        let solid = Solid::of_body(&Body::from_convex(&points).expect("the box has a hull"));
        let (origin, ahead) = (DVec3::new(0.4, 0.3, 5.0), -DVec3::Z);
        let (distance, piece) = solid.first_met(origin, ahead).expect("the ray meets the upper face");
        assert!((distance - 4.0).abs() < 1e-12 && piece == 0);
        assert_eq!((solid.first_met(origin, DVec3::Z), solid.first_met(origin + DVec3::X, ahead)), (None, None));
        assert!(solid.without(0).first_met(origin, ahead).is_none());
    }

    #[test]
    fn box_keeps_its_edges() {
        let side = |k: usize, bit: usize| (k >> bit & 1) as f64;
        let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
        let body = Body::from_convex(&points).expect("the box has a hull");
        for solid in [Solid::of_body(&body), Solid::exploded(&body, 1.0)] {
            assert_eq!(solid.triangles.len(), 12);
            for (triangle, normals) in solid.triangles.iter().zip(&solid.normals) {
                let [a, b, c] = triangle.map(|v| solid.vertices[v as usize]);
                let normal = (b - a).cross(c - a).normalize();
                assert!(normals.iter().all(|n| (*n - normal).length() < 1e-9));
                assert!(normal.dot((a + b + c) / 3.0 - DVec3::splat(0.5)) > 0.0, "the normal must point outward");
            }
            assert_eq!(solid.bounds(), (DVec3::ZERO, DVec3::ONE));
        }
    }
}
