//! Computes per-corner normals for force shading, split at creases \[MS96\].
//!
//! The normal at a corner of a triangle is the mean of the normals of the faces around that vertex.
//! Each normal is weighted by the face's angle at the vertex. Therefore the result does not depend
//! on how a flat face is cut into triangles (G. Thürmer, C. Wüthrich, *Computing vertex normals
//! from polygonal facets*, 1998).
//!
//! The mean includes only the faces that can be reached around the vertex without crossing a
//! crease. Therefore sharp edges stay sharp. If a triangle has creases at both sides of a corner,
//! the normal at this corner is its face normal. An edge is a crease if the normal turns across it
//! by more than the crease angle. An edge is also a crease unless exactly two triangles share it
//! and agree about the outer side.

use glam::DVec3;

use crate::body::{HalfEdges, Mesh};

/// The normals at the corners of all triangles of a mesh.
#[derive(Clone, Debug)]
pub struct ShadingNormals {
    corners: Vec<[DVec3; 3]>,
}

impl ShadingNormals {
    /// Computes the normals of `mesh`. An edge is a crease if the normal turns across it by more
    /// than `crease_angle` (rad). With 0, every bent edge is a crease. With π, no bent edge is a
    /// crease.
    pub fn new(mesh: &Mesh, edges: &HalfEdges, crease_angle: f64) -> Self {
        let count = mesh.triangles().len() as u32;
        let fans = Fans {
            edges,
            normals: (0..count).map(|t| mesh.triangle_normal(t)).collect(),
            least_cosine: crease_angle.clamp(0.0, std::f64::consts::PI).cos(),
        };
        let mut corners: Vec<[DVec3; 3]> = fans.normals.iter().map(|&n| [n; 3]).collect();
        let mut done = vec![false; 3 * count as usize];
        let mut fan = Vec::new();
        for (t, k) in (0..count).flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
            if done[3 * t as usize + k] {
                continue;
            }
            fans.collect((t, k), &mut fan);
            let sum: DVec3 = fan.iter().map(|&(t, k)| fans.normals[t as usize] * corner_angle(mesh, t, k)).sum();
            let normal = sum.try_normalize();
            for &(t, k) in &fan {
                done[3 * t as usize + k] = true;
                // If the normals cancel, each triangle gets its face normal.
                corners[t as usize][k] = normal.unwrap_or(fans.normals[t as usize]);
            }
        }
        Self { corners }
    }

    /// Returns the unit normal at corner `k` of triangle `t`.
    #[inline]
    pub fn corner(&self, t: u32, k: usize) -> DVec3 {
        self.corners[t as usize][k]
    }

    /// Returns the interpolated unit normal at a point of triangle `t`. `weights` are the
    /// barycentric coordinates of the point: numbers that are not negative and have the sum 1.
    pub fn at(&self, t: u32, weights: DVec3) -> DVec3 {
        let corners = &self.corners[t as usize];
        let sum = corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
        // Opposite normals can cancel only between needles. Then the normal of the nearest corner
        // is used.
        sum.try_normalize().unwrap_or(corners[weights.max_position()])
    }

    /// Returns the interpolated unit normal at the point of triangle `t` that is nearest to `p`.
    pub fn at_point(&self, mesh: &Mesh, t: u32, p: DVec3) -> DVec3 {
        self.at(t, mesh.corner_weights(t, p))
    }
}

/// Returns the angle (rad) of triangle `t` at its corner `k`.
fn corner_angle(mesh: &Mesh, t: u32, k: usize) -> f64 {
    let p = mesh.triangle_points(t);
    let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
    u.angle_between(v)
}

/// The data for walks around vertices.
struct Fans<'a> {
    edges: &'a HalfEdges,
    normals: Vec<DVec3>,
    least_cosine: f64,
}

impl Fans<'_> {
    /// Collects the corners around the vertex of corner `start` that can be reached without
    /// crossing a crease.
    fn collect(&self, start: (u32, usize), fan: &mut Vec<(u32, usize)>) {
        fan.clear();
        let mut first = start;
        // Walks clockwise to the first crease, if there is one. Then walks counter-clockwise to the
        // next crease.
        while let Some(before) = self.clockwise(first) {
            first = before;
            if first == start {
                break;
            }
        }
        fan.push(first);
        let mut last = first;
        while let Some(after) = self.counter_clockwise(last).filter(|&after| after != first) {
            fan.push(after);
            last = after;
        }
    }

    /// Returns the next corner at the vertex, clockwise as seen from outside. This corner lies
    /// across the side that starts at the vertex. `None` if this side is a crease.
    fn clockwise(&self, (t, k): (u32, usize)) -> Option<(u32, usize)> {
        let (other, j) = self.edges.neighbour(t, k)?;
        self.smooth(t, other).then_some((other, (j + 1) % 3))
    }

    /// Returns the next corner at the vertex, counter-clockwise as seen from outside. This corner
    /// lies across the side that ends at the vertex. `None` if this side is a crease.
    fn counter_clockwise(&self, (t, k): (u32, usize)) -> Option<(u32, usize)> {
        let (other, j) = self.edges.neighbour(t, (k + 2) % 3)?;
        self.smooth(t, other).then_some((other, j))
    }

    fn smooth(&self, t: u32, other: u32) -> bool {
        self.normals[t as usize].dot(self.normals[other as usize]) >= self.least_cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use crate::body::shapes::{cuboid, torus};

    #[test]
    fn box_is_shaded_round_only_above_90_degrees() {
        let mesh = cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
        let edges = HalfEdges::new(&mesh);
        let sharp = ShadingNormals::new(&mesh, &edges, 1.5);
        let round = ShadingNormals::new(&mesh, &edges, 1.6);
        for t in 0..12 {
            for k in 0..3 {
                assert!((sharp.corner(t, k) - mesh.triangle_normal(t)).length() < 1e-15);
                let outward = mesh.triangle_points(t)[k] - DVec3::new(0.5, 1.0, 1.5);
                let expected = outward.signum() / 3.0_f64.sqrt();
                // The result is symmetric because the weights are angles. The diagonals of the
                // faces are not symmetric.
                assert!((round.corner(t, k) - expected).length() < 1e-15);
            }
        }
    }

    #[test]
    fn fine_torus_normals_are_accurate_and_continuous() {
        let mesh = torus(1.0, 0.4, 64, 48);
        let edges = HalfEdges::new(&mesh);
        let shading = ShadingNormals::new(&mesh, &edges, 0.6);
        let truth = |p: DVec3| (p - DVec3::new(p.x, p.y, 0.0).normalize()).normalize();
        let mut random = Random::new(0x0b5e);
        for t in 0..mesh.triangles().len() as u32 {
            let p = mesh.triangle_points(t);
            for k in 0..3 {
                assert!(shading.corner(t, k).angle_between(truth(p[k])) < 0.02);
                let (other, j) = edges.neighbour(t, k).unwrap();
                let along = random.signed().abs();
                let x = p[k].lerp(p[(k + 1) % 3], along);
                let jump = shading.at_point(&mesh, t, x) - shading.at_point(&mesh, other, x);
                assert!(jump.length() < 1e-9, "side {k} of triangle {t}, side {j} of {other}");
            }
        }
    }

    #[test]
    fn ridge_keeps_face_normals_of_both_slopes() {
        // Two slopes meet in a ridge of 90°. Along the ridge each slope keeps its face normal.
        let mesh = {
            let mut soup = crate::body::PolygonSoup::new();
            soup.vertices.extend(
                [[0., 0., 1.], [0., 1., 1.], [1., 0., 0.], [1., 1., 0.], [-1., 0., 0.], [-1., 1., 0.]].map(DVec3::from),
            );
            soup.push_face(&[0, 2, 3, 1]);
            soup.push_face(&[0, 1, 5, 4]);
            Mesh::from_soup(&soup).unwrap().0
        };
        let shading = ShadingNormals::new(&mesh, &HalfEdges::new(&mesh), 1.0);
        for t in 0..4 {
            assert!((0..3).all(|k| (shading.corner(t, k) - mesh.triangle_normal(t)).length() < 1e-15));
        }
    }
}
