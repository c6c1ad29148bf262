//! Computes how far a direction is from all admissible normals of a piece.
//!
//! The admissible normals rotate with the piece. If a direction differs from all of them by some
//! angle, it cannot become admissible before the piece has rotated by that angle. The
//! translation of the piece does not matter. This module computes a lower bound of the angle, as
//! the minimum of these bounds:
//!
//! * For a single normal: the length of the chord between the direction and the normal.
//! * For an arc: the sine of the angle to the arc's great circle if the direction is between the
//!   ends of the arc. Otherwise the length of the chord to the nearer end.
//! * For the directions at a vertex: the sine of the elevation of the highest neighbouring mesh
//!   vertex, measured along the direction. If the direction rotates, this sine changes by at most
//!   the angle of the rotation.

use glam::DVec3;

use super::{AdmissibleNormals, Cap};
use crate::algebra::tolerance::ADMISSIBLE_ANGLE;
use crate::body::decompose::facet::NONE;

/// The tolerance of the tests for admissible normals, doubled because the given direction is
/// rounded too.
const SLACK: f64 = 2.0 * ADMISSIBLE_ANGLE;

impl AdmissibleNormals<'_> {
    /// Returns a lower bound of the angle (rad) between `direction` and all admissible normals of
    /// the piece. `direction` is a unit vector in the piece's frame. The result is zero or negative
    /// if the direction is admissible or nearly admissible.
    pub fn angle_to(&self, direction: DVec3) -> f64 {
        self.angle_between(direction, [0.0, f64::INFINITY])
    }

    /// As [`Self::angle_to`], but the result is at most `most`. If it is at most `least`, it may be
    /// any value up to `least`.
    pub(crate) fn angle_between(&self, direction: DVec3, [least, most]: [f64; 2]) -> f64 {
        let (enough, mut angle) = (least + SLACK, most + SLACK);
        let planes = self.faces.iter().map(|own| self.polytope.plane(own.face));
        let planes = planes.chain(self.borrowed.iter().map(|borrowed| borrowed.plane));
        angle = planes.map(|plane| plane.normal.distance(direction)).fold(angle, f64::min);
        for arc in self.arcs {
            if angle <= enough {
                return angle - SLACK;
            }
            let [left, right] = self.ends(arc);
            // Unit vectors at this distance have this product.
            let near = Cap { axis: direction, least: 1.0 - angle * angle / 2.0 };
            if near.may_meet(left, right) {
                angle = angle.min(self.angle_to_arc([left, right], arc.edge, direction));
            }
        }
        for v in 0..self.polytope.vertices().len() as u32 {
            if angle <= enough {
                return angle - SLACK;
            }
            angle = angle.min(self.angle_to_vertex(v, direction, angle));
        }
        angle - SLACK
    }

    /// Returns a lower bound of the angle (rad) by which `outward` must turn before
    /// [`Admissible::may_continue`](super::Admissible::may_continue) is true. `slope` is the
    /// tangent of the angle there.
    pub(crate) fn angle_to_continued(&self, outward: DVec3, slope: f64) -> f64 {
        let Cap { axis, least } = self.all.continued[self.piece as usize];
        // The product with the axis changes by at most the angle.
        least - slope - axis.dot(outward)
    }

    /// Returns true only if no vertex of the piece admits a direction within `angle` (rad) of
    /// `direction` (unit, in the piece's frame).
    pub(crate) fn vertices_differ_from(&self, direction: DVec3, angle: f64) -> bool {
        let enough = angle + SLACK;
        !self.cap().widened(enough).holds(direction)
            || (0..self.polytope.vertices().len() as u32).all(|v| self.angle_to_vertex(v, direction, enough) >= enough)
    }

    fn angle_to_arc(&self, [left, right]: [DVec3; 2], edge: u32, direction: DVec3) -> f64 {
        let edge = self.polytope.edge(edge);
        let along = (self.polytope.vertex(edge.head) - self.polytope.vertex(edge.tail)).normalize_or_zero();
        let is_between = along.dot(left.cross(direction)) >= 0.0
            && along.dot(direction.cross(right)) >= 0.0
            && direction.dot(left + right) > 0.0;
        if is_between { along.dot(direction).abs() } else { left.distance(direction).min(right.distance(direction)) }
    }

    /// Returns the bound for the directions of a vertex; infinite if the vertex has no admissible
    /// directions, or if the bound is not below `least`.
    fn angle_to_vertex(&self, vertex: u32, direction: DVec3, least: f64) -> f64 {
        let corner = self.corner(vertex);
        if corner == NONE {
            return f64::INFINITY;
        }
        let mut highest = f64::NEG_INFINITY;
        for edge in self.all.edges(corner) {
            highest = highest.max((edge.dot(direction) - self.all.noise) / edge.length());
            if highest >= least {
                return f64::INFINITY;
            }
        }
        let own = self.polytope.ring(vertex).iter().filter(|spoke| self.surface_face(spoke.left).is_some());
        let facing = own.map(|spoke| self.polytope.plane(spoke.left).normal.dot(direction)).reduce(f64::max);
        facing.map_or(f64::INFINITY, |facing| highest.max(-facing))
    }
}
