//! Computes a spherical cap that contains all admissible normals of a piece. The cap allows a quick
//! rejection, because most normals of another piece lie outside it.
//!
//! If a cap is smaller than a half sphere and contains the ends of an arc, it also contains the
//! arc. At a vertex, a direction is admissible if no neighbouring mesh vertex is higher along it.
//! This direction is a non-negative combination of the normals of the triangles around the vertex.
//! To see this, cut the triangles by a plane below the vertex and perpendicular to the direction.
//! The cut triangles form a cone. The sum of their area vectors equals the area vector of the
//! cone's base, which is parallel to the direction.
//!
//! The tolerance of the vertex test is added to the cap's angle twice. The added angle is larger if
//! a triangle at the vertex has a wide angle.
//!
//! The cap is the whole sphere in two cases: a vertex of the piece is on the boundary of the mesh,
//! or the normals need half a sphere or more.

use glam::DVec3;

use super::{Admissible, AdmissibleNormals};
use crate::algebra::tolerance::{ADMISSIBLE_ANGLE, CAP_LEAST, CAP_SLACK, OWNERS_PER_PART};
use crate::algebra::{Workers, map_in_order};
use crate::body::decompose::facet::NONE;
use crate::body::{HalfEdges, Mesh, Polytope};

/// A spherical cap: the unit directions whose dot product with `axis` is at least `least`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cap {
    /// Unit axis in the piece's frame.
    pub axis: DVec3,
    /// Cosine of the cap's half angle. A value below −1 means all directions.
    pub least: f64,
}

impl Cap {
    /// The cap of all directions.
    pub(super) const WHOLE: Self = Self { axis: DVec3::Z, least: -2.0 };

    /// The cap of no direction.
    const EMPTY: Self = Self { axis: DVec3::Z, least: 2.0 };

    /// Returns a cap that contains the unit vectors `directions`.
    pub(super) fn around(directions: &[DVec3]) -> Self {
        if directions.is_empty() {
            return Self::EMPTY;
        }
        let axis = directions.iter().sum::<DVec3>().normalize_or_zero();
        let least = directions.iter().map(|direction| axis.dot(*direction)).fold(1.0, f64::min);
        if axis == DVec3::ZERO { Self::WHOLE } else { Self { axis, least: least - CAP_SLACK } }
    }

    /// Returns this cap with another axis.
    #[inline]
    pub fn about(self, axis: DVec3) -> Self {
        Self { axis, ..self }
    }

    /// Returns a cap that contains this cap after each turn by at most `angle` (rad).
    #[inline]
    pub fn widened(self, angle: f64) -> Self {
        // The axis moves by at most the angle, and so does its product with a direction.
        Self { least: self.least - angle, ..self }
    }

    /// Returns true if the unit vector `direction` lies in the cap.
    #[inline]
    pub fn holds(&self, direction: DVec3) -> bool {
        self.axis.dot(direction) >= self.least
    }

    /// Returns false only if no direction on the arc from `left` to `right` lies in the cap. May
    /// also return true in this case. `left` and `right` are unit vectors, and the angle between
    /// them is less than π.
    #[inline]
    pub fn may_meet(&self, left: DVec3, right: DVec3) -> bool {
        let most = self.axis.dot(left).max(self.axis.dot(right));
        // A direction on the arc is (1 − s) l + s r, divided by the length of this vector. The
        // length is at least |l + r| / 2. Therefore the dot product with the axis is at most `most`
        // divided by |l + r| / 2.
        most >= self.least
            || most > 0.0 && 4.0 * most * most >= self.least * self.least * (left + right).length_squared()
    }
}

impl Admissible {
    /// Computes the caps of all pieces. The caller must compute the rings first.
    pub(super) fn find_caps(
        &mut self,
        mesh: &Mesh,
        half_edges: &HalfEdges,
        polytopes: &[Polytope],
        workers: &dyn Workers,
    ) {
        let around = Around::new(mesh, half_edges);
        let cap = |k: usize| self.cap(&around, &self.of(k as u32, &polytopes[k], mesh));
        self.caps = map_in_order(workers, polytopes.len(), OWNERS_PER_PART, cap, &mut |_| ());
    }

    fn cap(&self, around: &Around<'_>, own: &AdmissibleNormals<'_>) -> Cap {
        let faces = || own.faces().iter().map(|face| own.plane(face.face).normal);
        let planes = || faces().chain(own.borrowed().iter().map(|borrowed| borrowed.plane.normal));
        let axis = planes().sum::<DVec3>().normalize_or_zero();
        let mut least = planes().map(|normal| axis.dot(normal)).fold(1.0, f64::min).acos();
        for v in 0..own.polytope().vertices().len() as u32 {
            let corner = own.corner(v);
            if corner == NONE || own.polytope().ring(v).iter().all(|spoke| own.surface_face(spoke.left).is_none()) {
                continue;
            }
            let Some((most, narrow)) = around.most(corner, axis) else { return Cap::WHOLE };
            least = least.max(most.acos() + 2.0 * self.slack(corner) / narrow);
        }
        let least = (least + CAP_SLACK).cos();
        if least.is_nan() || least < CAP_LEAST { Cap::WHOLE } else { Cap { axis, least } }
    }

    /// Returns the elevation (rad) by which a neighbour of mesh vertex `v` may be higher than `v`.
    fn slack(&self, v: u32) -> f64 {
        let shortest = self.edges(v).iter().map(|edge| edge.length()).fold(f64::INFINITY, f64::min);
        ADMISSIBLE_ANGLE + self.noise / shortest
    }
}

/// The triangles around each mesh vertex.
struct Around<'m> {
    mesh: &'m Mesh,
    starts: Vec<u32>,
    triangles: Vec<u32>,
    /// True for each vertex on the boundary of the mesh.
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

    /// Returns two cosines for the triangles around mesh vertex `v`: the smallest cosine between
    /// `axis` and their normals, and the cosine of half of their widest angle at `v`. If
    /// neighbours of `v` may be higher by a tolerance (rad), an admissible direction can tilt
    /// toward their triangle by the tolerance divided by the second cosine. Returns `None` if `v`
    /// is on the boundary of the mesh.
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
