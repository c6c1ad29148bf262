//! Builds a surface from rings of vertices, bands between rings, and caps over rings.
//!
//! Every ring runs counter-clockwise about the direction in which the surface is swept. So the
//! triangles of each band face away from the axis of the sweep.

use std::f64::consts::TAU;

use glam::DVec3;
use palpus::body::PolygonSoup;

/// Diagonals count as equal below this relative difference. So rounding does not decide how a quad
/// is divided.
const EQUAL_DIAGONALS: f64 = 1e-9;

#[derive(Default)]
pub(super) struct Surface {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    pub(super) fn vertex(&mut self, p: DVec3) -> u32 {
        self.vertices.push(p);
        self.vertices.len() as u32 - 1
    }

    /// Returns the position of a vertex.
    pub(super) fn at(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize]
    }

    pub(super) fn ring(&mut self, points: impl IntoIterator<Item = DVec3>) -> Vec<u32> {
        points.into_iter().map(|p| self.vertex(p)).collect()
    }

    pub(super) fn triangle(&mut self, a: u32, b: u32, c: u32) {
        self.triangles.push([a, b, c]);
    }

    /// Adds a quad as two triangles. Divides it along the shorter diagonal, or along `a`–`c` if
    /// both are equal.
    pub(super) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let length = |i: u32, j: u32| self.vertices[i as usize].distance(self.vertices[j as usize]);
        if length(b, d) < length(a, c) * (1.0 - EQUAL_DIAGONALS) {
            self.triangles.extend([[a, b, d], [b, c, d]]);
        } else {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    /// Adds the band from one ring to the next along the sweep. Leaves out the quads whose index
    /// `keep` rejects.
    pub(super) fn band_where(&mut self, from: &[u32], to: &[u32], keep: impl Fn(usize) -> bool) {
        debug_assert_eq!(from.len(), to.len());
        for k in (0..from.len()).filter(|&k| keep(k)) {
            let next = (k + 1) % from.len();
            self.quad([from[k], from[next], to[next], to[k]]);
        }
    }

    /// Adds the band from one ring to the next along the sweep: two triangles per vertex of a ring.
    pub(super) fn band(&mut self, from: &[u32], to: &[u32]) {
        self.band_where(from, to, |_| true);
    }

    /// Closes the far end of the sweep over a convex planar ring, without a new vertex: n − 2
    /// triangles.
    pub(super) fn cap_end(&mut self, ring: &[u32]) {
        for k in 1..ring.len() - 1 {
            self.triangle(ring[0], ring[k], ring[k + 1]);
        }
    }

    /// Closes the near end of the sweep over a convex planar ring: n − 2 triangles that face
    /// against the sweep.
    pub(super) fn cap_start(&mut self, ring: &[u32]) {
        for k in 1..ring.len() - 1 {
            self.triangle(ring[0], ring[k + 1], ring[k]);
        }
    }

    /// Closes the far end of the sweep with a point: n triangles.
    pub(super) fn point_end(&mut self, ring: &[u32], apex: DVec3) {
        let apex = self.vertex(apex);
        for k in 0..ring.len() {
            self.triangle(ring[k], ring[(k + 1) % ring.len()], apex);
        }
    }

    /// Closes the near end of the sweep with a point: n triangles.
    pub(super) fn point_start(&mut self, ring: &[u32], apex: DVec3) {
        let apex = self.vertex(apex);
        for k in 0..ring.len() {
            self.triangle(ring[(k + 1) % ring.len()], ring[k], apex);
        }
    }

    pub(super) fn finish(self) -> PolygonSoup {
        PolygonSoup::from_triangles(self.vertices, &self.triangles)
    }
}

/// Returns `count` points of a circle that runs from axis `n` toward axis `b`, counter-clockwise
/// about `n × b`. The first point is `phase` steps after `n`.
pub(super) fn circle(
    center: DVec3,
    n: DVec3,
    b: DVec3,
    radius: f64,
    count: usize,
    phase: f64,
) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |k| {
        let (sin, cos) = (TAU * (k as f64 + phase) / count as f64).sin_cos();
        center + (n * cos + b * sin) * radius
    })
}
