//! A cap of directions that holds all normals of a piece: most normals of another piece are
//! outside of it.
//!
//! Faces, borrowed normals and the arcs between them lie in every cap of less than a half sphere
//! that holds the ends. A vertex owns the directions along which no neighbour on the mesh is
//! higher. These lie between the normals of the triangles around it: the triangles from the vertex
//! to a plane below it close a cone whose areas, as vectors, add up to the area of its base, which
//! faces in that direction. So the direction is a sum of the triangles' normals. The slack of
//! vertices is added to the cap's angle twice, and is larger where a triangle has a wide angle.
//!
//! A piece with a vertex where the mesh ends, or whose normals need half a sphere or more, has the
//! whole sphere.

use glam::DVec3;

use super::{Admissible, OwnNormals};
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, CAP_LEAST, CAP_SLACK};
use crate::body::decompose::facet::NONE;
use crate::body::{HalfEdges, Mesh, Polytope};

/// Directions that form an angle with an axis whose cosine is not less than `least`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cap {
    /// Unit, in the piece's frame.
    pub axis: DVec3,
    /// Below −1: all directions.
    pub least: f64,
}

impl Cap {
    /// All directions.
    pub(super) const WHOLE: Self = Self { axis: DVec3::Z, least: -2.0 };

    /// The same cap with another axis.
    #[inline]
    pub fn about(self, axis: DVec3) -> Self {
        Self { axis, ..self }
    }

    /// True if the unit vector lies in it.
    #[inline]
    pub fn holds(&self, direction: DVec3) -> bool {
        self.axis.dot(direction) >= self.least
    }

    /// False if no direction on the arc from `left` to `right` (unit, less than half a turn apart)
    /// lies in it.
    #[inline]
    pub fn may_meet(&self, left: DVec3, right: DVec3) -> bool {
        let most = self.axis.dot(left).max(self.axis.dot(right));
        // On the arc, a product is a sum of those at the ends over the length of a sum of the ends:
        // at the most over |l + r| / 2.
        most >= self.least
            || most > 0.0 && 4.0 * most * most >= self.least * self.least * (left + right).length_squared()
    }
}

impl Admissible {
    /// The caps of all pieces. The rings are there.
    pub(super) fn find_caps(&mut self, mesh: &Mesh, half_edges: &HalfEdges, polytopes: &[Polytope]) {
        let around = Around::new(mesh, half_edges);
        let caps =
            polytopes.iter().enumerate().map(|(k, polytope)| self.cap(&around, &self.of(k as u32, polytope, mesh)));
        self.caps = caps.collect();
    }

    fn cap(&self, around: &Around<'_>, own: &OwnNormals<'_>) -> Cap {
        let faces = || own.faces().iter().map(|face| own.plane(face.face).normal);
        let planes = || faces().chain(own.borrowed().iter().map(|borrowed| borrowed.plane.normal));
        let axis = planes().sum::<DVec3>().normalize_or_zero();
        let mut least = planes().map(|normal| axis.dot(normal)).fold(1.0, f64::min).acos();
        for v in 0..own.polytope().vertices().len() as u32 {
            let corner = own.corners[v as usize];
            if corner == NONE || own.polytope().ring(v).iter().all(|spoke| own.own_face(spoke.left).is_none()) {
                continue;
            }
            let Some((most, narrow)) = around.most(corner, axis) else { return Cap::WHOLE };
            least = least.max(most.acos() + 2.0 * self.slack(around.mesh, corner) / narrow);
        }
        let least = (least + CAP_SLACK).cos();
        if least.is_nan() || least < CAP_LEAST { Cap::WHOLE } else { Cap { axis, least } }
    }

    /// Radians by which a neighbour of mesh vertex `v` may be higher.
    fn slack(&self, mesh: &Mesh, v: u32) -> f64 {
        let at = mesh.vertices()[v as usize];
        let ring = &self.ring[self.ring_starts[v as usize] as usize..self.ring_starts[v as usize + 1] as usize];
        let shortest = ring.iter().map(|&w| mesh.vertices()[w as usize].distance(at)).fold(f64::INFINITY, f64::min);
        ADMISSIBLE_ANGLE + self.noise / shortest
    }
}

/// The triangles around each mesh vertex.
struct Around<'m> {
    mesh: &'m Mesh,
    starts: Vec<u32>,
    triangles: Vec<u32>,
    /// The mesh ends at the vertex.
    open: Vec<bool>,
}

impl<'m> Around<'m> {
    fn new(mesh: &'m Mesh, half_edges: &HalfEdges) -> Self {
        let mut starts = vec![0_u32; mesh.vertices().len() + 1];
        let mut open = vec![false; mesh.vertices().len()];
        for (t, triangle) in mesh.triangles().iter().enumerate() {
            for k in 0..3 {
                starts[triangle[k] as usize + 1] += 1;
                if half_edges.neighbour(t as u32, k).is_none() {
                    open[triangle[k] as usize] = true;
                    open[triangle[(k + 1) % 3] as usize] = true;
                }
            }
        }
        for v in 0..mesh.vertices().len() {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0; 3 * mesh.triangles().len()];
        for (t, triangle) in mesh.triangles().iter().enumerate() {
            for &v in triangle {
                triangles[next[v as usize] as usize] = t as u32;
                next[v as usize] += 1;
            }
        }
        Self { mesh, starts, triangles, open }
    }

    /// The least cosine between `axis` and the normals around mesh vertex `v`, and the cosine of
    /// half the widest angle of a triangle there. Slack at two neighbours turns the direction
    /// between them by the slack over this cosine. `None` where the mesh ends.
    fn most(&self, v: u32, axis: DVec3) -> Option<(f64, f64)> {
        let some = self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize;
        let (mut most, mut narrow) = (1.0_f64, 1.0_f64);
        for &t in &self.triangles[some] {
            most = most.min(axis.dot(self.mesh.triangle_normal(t)));
            let others = self.mesh.triangles()[t as usize].into_iter().filter(|&w| w != v);
            let at = |w: u32| self.mesh.vertices()[w as usize];
            let middle = others.map(|w| (at(w) - at(v)).normalize_or_zero()).sum::<DVec3>() / 2.0;
            narrow = narrow.min(middle.length());
        }
        (!self.open[v as usize]).then(|| (most.max(-1.0), narrow))
    }
}
