//! How far a direction is from all that a piece owns.
//!
//! A piece owns a set of directions that turns with it. A direction at an angle from all of them
//! cannot be one of them before the piece has turned by that angle, whatever its place. The angle
//! is bounded from below, part by part:
//!
//! * a normal: by the chord to it;
//! * an arc: by the sine of the angle to its circle between the ends, else by the chord to the
//!   nearer end;
//! * what a vertex owns: by how high its highest neighbour on the mesh lies along the direction.
//!   The sine of that elevation changes by no more than the angle by which the direction turns.

use glam::DVec3;

use super::OwnNormals;
use crate::algebra::tolerance::ADMISSIBLE_ANGLE;
use crate::body::decompose::facet::NONE;

impl OwnNormals<'_> {
    /// At most the angle (rad) between `direction` (unit, in the piece's frame) and every
    /// direction that the piece owns; not above 0 if it owns the direction or nearly so.
    pub fn angle_to(&self, direction: DVec3) -> f64 {
        // The slack with which directions are owned, and as much again for the rounding of the
        // given ones.
        const SLACK: f64 = 2.0 * ADMISSIBLE_ANGLE;
        let planes = self.faces.iter().map(|own| self.polytope.plane(own.face));
        let planes = planes.chain(self.borrowed.iter().map(|borrowed| borrowed.plane));
        let mut least = planes.map(|plane| plane.normal.distance(direction)).fold(f64::INFINITY, f64::min);
        for arc in self.arcs {
            if least <= SLACK {
                return 0.0;
            }
            least = least.min(self.angle_to_arc(self.ends(arc), arc.edge, direction));
        }
        for v in 0..self.polytope.vertices().len() as u32 {
            if least <= SLACK {
                return 0.0;
            }
            least = least.min(self.angle_to_vertex(v, direction));
        }
        least - SLACK
    }

    fn angle_to_arc(&self, [left, right]: [DVec3; 2], edge: u32, direction: DVec3) -> f64 {
        let edge = self.polytope.edge(edge);
        let along = (self.polytope.vertex(edge.head) - self.polytope.vertex(edge.tail)).normalize_or_zero();
        let is_between = along.dot(left.cross(direction)) >= 0.0
            && along.dot(direction.cross(right)) >= 0.0
            && direction.dot(left + right) > 0.0;
        if is_between { along.dot(direction).abs() } else { left.distance(direction).min(right.distance(direction)) }
    }

    /// Infinite at a vertex that owns nothing.
    fn angle_to_vertex(&self, vertex: u32, direction: DVec3) -> f64 {
        let corner = self.corners[vertex as usize];
        if corner == NONE {
            return f64::INFINITY;
        }
        let own = self.polytope.ring(vertex).iter().filter(|spoke| self.own_face(spoke.left).is_some());
        let facing = own.map(|spoke| self.polytope.plane(spoke.left).normal.dot(direction)).reduce(f64::max);
        let Some(facing) = facing else { return f64::INFINITY };
        let (mesh, all) = (self.mesh, self.all);
        let at = mesh.vertices()[corner as usize];
        let ring = all.ring_starts[corner as usize] as usize..all.ring_starts[corner as usize + 1] as usize;
        let highest = all.ring[ring].iter().map(|&w| {
            let edge = mesh.vertices()[w as usize] - at;
            (edge.dot(direction) - all.noise) / edge.length()
        });
        highest.fold(-facing, f64::max)
    }
}
