//! The smooth surface that a mesh approximates: its normal and curvature at any point of the mesh.
//!
//! Once per mesh:
//! 1. Compute the curvature of each triangle: the largest rotation of the corner normals per
//!    length, over its sides.
//! 2. Compute the curvature of each corner: the mean over all corners of its vertex with equal
//!    normals. So the curvature is equal on both sides of a smooth edge. The spread of a corner is
//!    the largest distance between its normal and those of these triangles.
//! 3. Find the creases: sides of triangles across which corner normals differ, or at which the mesh
//!    ends, and the vertices of these sides.
//!
//! Per point:
//! 4. Find the triangle nearest to the point, among the triangles on which the feature lies.
//! 5. Return `None` if the vertex or edge is a crease. Otherwise interpolate normal, curvature
//!    and spread between the triangle's corners.

use glam::DVec3;

use super::SmoothNormal;
use crate::algebra::closest_on_triangle;
use crate::algebra::tolerance::{SHADING_SAME, SHADING_TRIANGLES};
use crate::body::{Feature, HalfEdges, Mesh};

/// Normals, curvatures and creases of one mesh.
#[derive(Clone, Debug)]
pub(super) struct SmoothSurface {
    corners: Vec<[SmoothNormal; 3]>,
    /// For each triangle: bit k is set if side k is a crease, and bit 3 + k if vertex k is on a
    /// crease.
    creases: Vec<u8>,
}

impl SmoothSurface {
    /// Returns the smooth surface of `mesh`. Triangle `t` has the unit normal `normal(t, k)` at its
    /// corner `k`. Two corners at one vertex have equal normals if the surface is smooth between
    /// them.
    pub(super) fn new(mesh: &Mesh, half_edges: &HalfEdges, normal: impl Fn(u32, usize) -> DVec3) -> Self {
        let triangles = mesh.triangles().len() as u32;
        let normals: Vec<[DVec3; 3]> = (0..triangles).map(|t| [0, 1, 2].map(|k| normal(t, k))).collect();
        let at_vertex = corners_of_vertices(mesh);
        let mut surface = Self { corners: Vec::with_capacity(normals.len()), creases: vec![0; normals.len()] };
        surface.fill_corners(mesh, &normals, &at_vertex);
        surface.mark_creases(&normals, half_edges, &at_vertex);
        surface
    }

    /// Steps 4 and 5: returns the surface at `point` of a feature that lies on the triangles
    /// `covered`. `None` on a crease, and if there are no triangles or too many.
    pub(super) fn at(
        &self,
        mesh: &Mesh,
        feature: Feature,
        covered: impl Iterator<Item = u32>,
        point: DVec3,
    ) -> Option<SmoothNormal> {
        let mut nearest = None;
        let mut least = f64::INFINITY;
        for (n, t) in covered.enumerate() {
            if n == SHADING_TRIANGLES {
                return None;
            }
            let [p, q, r] = mesh.triangle_points(t);
            let on_triangle = closest_on_triangle(point, p, q, r);
            let distance = on_triangle.distance_squared(point);
            if distance < least {
                least = distance;
                nearest = Some((t, on_triangle));
            }
        }
        let (t, on_triangle) = nearest?;
        let shares = barycentric(on_triangle, mesh.triangle_points(t));
        let creases = self.creases[t as usize];
        let creased = match feature {
            Feature::Face(_) => false,
            // Tests the side opposite the corner with the smallest weight. Side k runs from corner
            // k to corner k + 1.
            Feature::Edge(_) => creases & (1 << ((extreme(shares.map(|s| -s)) + 1) % 3)) != 0,
            Feature::Vertex(_) => creases & (8 << extreme(shares)) != 0,
        };
        if creased { None } else { Some(self.interpolated(t, shares)) }
    }

    fn interpolated(&self, t: u32, shares: [f64; 3]) -> SmoothNormal {
        let corners = &self.corners[t as usize];
        let normal: DVec3 = corners.iter().zip(shares).map(|(corner, share)| share * corner.normal).sum();
        let curvature = corners.iter().zip(shares).map(|(corner, share)| share * corner.curvature).sum();
        let spread = corners.iter().zip(shares).map(|(corner, share)| share * corner.spread).sum();
        SmoothNormal { normal: normal.normalize_or(corners[extreme(shares)].normal), curvature, spread }
    }

    /// Runs steps 1 and 2.
    fn fill_corners(&mut self, mesh: &Mesh, normals: &[[DVec3; 3]], at_vertex: &[Vec<(u32, usize)>]) {
        let curvatures: Vec<f64> = normals
            .iter()
            .zip(0..)
            .map(|(n, t)| {
                let p = mesh.triangle_points(t);
                let turn = |k: usize| n[k].distance(n[(k + 1) % 3]) / p[k].distance(p[(k + 1) % 3]);
                turn(0).max(turn(1)).max(turn(2))
            })
            .collect();
        self.corners
            .extend(normals.iter().map(|n| n.map(|normal| SmoothNormal { normal, curvature: 0.0, spread: 0.0 })));
        for corners in at_vertex {
            for &(t, k) in corners {
                let own = normals[t as usize][k];
                let alike = corners.iter().filter(|&&(t, k)| same(normals[t as usize][k], own));
                let (count, sum, spread) = alike.fold((0.0, 0.0, 0.0_f64), |(n, sum, spread), &(t, _)| {
                    let off = mesh.triangle_normal(t).distance(own);
                    (n + 1.0, sum + curvatures[t as usize], spread.max(off))
                });
                let corner = &mut self.corners[t as usize][k];
                (corner.curvature, corner.spread) = (sum / count, spread);
            }
        }
    }

    /// Runs step 3.
    fn mark_creases(&mut self, normals: &[[DVec3; 3]], half_edges: &HalfEdges, at_vertex: &[Vec<(u32, usize)>]) {
        for (t, n) in normals.iter().enumerate() {
            for k in 0..3 {
                let smooth = half_edges.neighbour(t as u32, k).is_some_and(|(other, side)| {
                    let m = &normals[other as usize];
                    same(n[k], m[(side + 1) % 3]) && same(n[(k + 1) % 3], m[side])
                });
                self.creases[t] |= u8::from(!smooth) << k;
            }
        }
        for corners in at_vertex {
            // A vertex is on a crease if a side at the vertex, in any of its triangles, is a
            // crease.
            let creased = corners.iter().any(|&(t, k)| self.creases[t as usize] & (1 << k | 1 << ((k + 2) % 3)) != 0);
            for &(t, k) in corners {
                self.creases[t as usize] |= u8::from(creased) << (3 + k);
            }
        }
    }
}

fn same(first: DVec3, second: DVec3) -> bool {
    first.dot(second) >= SHADING_SAME
}

fn corners_of_vertices(mesh: &Mesh) -> Vec<Vec<(u32, usize)>> {
    let mut answer = vec![Vec::new(); mesh.vertices().len()];
    for (triangle, t) in mesh.triangles().iter().zip(0..) {
        for (k, &v) in triangle.iter().enumerate() {
            answer[v as usize].push((t, k));
        }
    }
    answer
}

/// Returns the index of the largest value; the first index if several values are equal.
fn extreme(values: [f64; 3]) -> usize {
    let best = usize::from(values[1] > values[0]);
    if values[2] > values[best] { 2 } else { best }
}

/// Returns the barycentric weights of a point of a triangle. Each weight is not negative, and their
/// sum is 1.
fn barycentric(point: DVec3, [p, q, r]: [DVec3; 3]) -> [f64; 3] {
    let normal = (q - p).cross(r - p);
    let area = |from: DVec3, to: DVec3| (from - point).cross(to - point).dot(normal).max(0.0);
    let shares = [area(q, r), area(r, p), area(p, q)];
    let sum: f64 = shares.iter().sum();
    // If the triangle is too thin, its corners get equal weights.
    if sum > 0.0 { shares.map(|share| share / sum) } else { [1.0 / 3.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::PolygonSoup;

    const RADIUS: f64 = 0.05;
    const SIDES: u32 = 24;

    /// Returns a tube of flat quads around the z axis, cut into triangles. The ends of the tube are
    /// open.
    fn tube() -> (Mesh, HalfEdges) {
        let mut vertices = Vec::new();
        for k in 0..SIDES {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(SIDES);
            for z in [-0.1, 0.0, 0.1] {
                vertices.push(DVec3::new(RADIUS * angle.cos(), RADIUS * angle.sin(), z));
            }
        }
        let mut triangles = Vec::new();
        for k in 0..SIDES {
            let (p, q) = (3 * k, 3 * ((k + 1) % SIDES));
            for z in 0..2 {
                triangles.extend([[p + z, q + z, q + z + 1], [p + z, q + z + 1, p + z + 1]]);
            }
        }
        let (mesh, _) = Mesh::from_soup(&PolygonSoup::from_triangles(vertices, &triangles)).unwrap();
        let half_edges = HalfEdges::new(&mesh);
        (mesh, half_edges)
    }

    fn outward(p: DVec3) -> DVec3 {
        DVec3::new(p.x, p.y, 0.0).normalize()
    }

    fn smooth(mesh: &Mesh, half_edges: &HalfEdges) -> SmoothSurface {
        SmoothSurface::new(mesh, half_edges, |t, k| outward(mesh.triangle_points(t)[k]))
    }

    /// Returns the point of the tube's surface at `angle`.
    fn on_tube(angle: f64, z: f64) -> DVec3 {
        let step = std::f64::consts::TAU / f64::from(SIDES);
        let within = angle.rem_euclid(step) - 0.5 * step;
        RADIUS * (0.5 * step).cos() / within.cos() * DVec3::new(angle.cos(), angle.sin(), 0.0) + DVec3::Z * z
    }

    #[test]
    fn the_normal_turns_evenly_around_a_tube() {
        let (mesh, half_edges) = tube();
        let surface = smooth(&mesh, &half_edges);
        let all = || 0..mesh.triangles().len() as u32;
        let mut previous: Option<DVec3> = None;
        for k in 0..4000 {
            let point = on_tube(std::f64::consts::TAU * f64::from(k) / 4000.0, 0.03);
            let answer = surface.at(&mesh, Feature::Face(0), all(), point).unwrap();
            assert!(answer.normal.angle_between(outward(point)) < 2e-3);
            assert!((answer.curvature - 1.0 / RADIUS).abs() < 0.01 / RADIUS);
            // A faceted normal would jump by 0.26 at every edge.
            if let Some(previous) = previous {
                assert!(previous.distance(answer.normal) < 2.0 * std::f64::consts::TAU / 4000.0);
            }
            previous = Some(answer.normal);
        }
    }

    #[test]
    fn crease_has_no_normal_and_its_faces_have_one() {
        let (mesh, half_edges) = tube();
        let sharp = SmoothSurface::new(&mesh, &half_edges, |t, _| mesh.triangle_normal(t));
        let all = || 0..mesh.triangles().len() as u32;
        let edge = on_tube(0.0, 0.03);
        assert_eq!(sharp.at(&mesh, Feature::Edge(0), all(), edge), None);
        assert_eq!(sharp.at(&mesh, Feature::Vertex(0), all(), on_tube(0.0, 0.0)), None);
        let face = sharp.at(&mesh, Feature::Face(0), all(), on_tube(0.01, 0.03)).unwrap();
        assert_eq!(face.curvature, 0.0);
        assert!(face.normal.angle_between(outward(on_tube(std::f64::consts::PI / 24.0, 0.0))) < 1e-7);

        let surface = smooth(&mesh, &half_edges);
        assert!(surface.at(&mesh, Feature::Edge(0), all(), edge).is_some());
        assert!(surface.at(&mesh, Feature::Vertex(0), all(), on_tube(0.0, 0.0)).is_some());
        // The open end is a crease.
        assert_eq!(surface.at(&mesh, Feature::Vertex(0), all(), on_tube(0.0, 0.1)), None);
        assert_eq!(surface.at(&mesh, Feature::Edge(0), all(), on_tube(0.1, 0.1)), None);
        assert_eq!(surface.at(&mesh, Feature::Face(0), std::iter::empty(), edge), None);
    }
}
