//! Computes winding numbers of points, and tests whether points are inside.
//!
//! * On closed surfaces the result is exact. The winding number is the number of signed
//!   crossings of the ray from the point along +x. The point is moved symbolically by (0, ε, ε²),
//!   so the ray never meets an edge or a vertex (H. Edelsbrunner, E. Mücke, *Simulation of
//!   simplicity*, 1990). All signs are computed exactly.
//! * On open surfaces the result is the generalised winding number, a sum of solid angles (A.
//!   Jacobson, L. Kavan, O. Sorkine-Hornung, *Robust inside-outside segmentation using generalized
//!   winding numbers*, 2013). Distant boxes are approximated by a dipole with its first-order
//!   correction (G. Barill and others, *Fast winding numbers for soups and clouds*, 2018).

use std::ops::ControlFlow;

use glam::{DMat3, DVec2, DVec3};

use super::{Node, Stack, TriangleTree};
use crate::algebra::tolerance;
use crate::body::Aabb;
use crate::body::mesh::triangle_pair::{holds_coplanar_point, side_of_plane, turn};

/// Far-field approximation of a node's triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dipole {
    /// Sum of the triangles' normals times their areas.
    moment: DVec3,
    /// Sum of (normal times area) ⊗ (centroid − centre): the first-order correction of the dipole.
    spread: DMat3,
    /// Area-weighted centroid.
    center: DVec3,
    area: f64,
    /// Square of the distance from the centre to the farthest corner of the node's box.
    radius_squared: f64,
}

impl Dipole {
    /// Computes the dipoles of all nodes. The children of a node come after it.
    pub(super) fn of_nodes(nodes: &[Node], corners: &[[DVec3; 3]]) -> Vec<Self> {
        let nothing =
            Self { moment: DVec3::ZERO, spread: DMat3::ZERO, center: DVec3::ZERO, area: 0.0, radius_squared: 0.0 };
        let mut dipoles = vec![nothing; nodes.len()];
        for (index, node) in nodes.iter().enumerate().rev() {
            let sum = if node.is_leaf() {
                Self::sum(corners[node.slots()].iter().map(Self::of_triangle))
            } else {
                Self::sum([dipoles[index + 1], dipoles[node.second as usize]].into_iter())
            };
            let reach = (node.bounds.max - sum.center).abs().max((sum.center - node.bounds.min).abs());
            dipoles[index] = Self { radius_squared: reach.length_squared(), ..sum };
        }
        dipoles
    }

    fn of_triangle(&[a, b, c]: &[DVec3; 3]) -> Self {
        let moment = (b - a).cross(c - a) * 0.5;
        let center = (a + b + c) / 3.0;
        Self { moment, spread: DMat3::ZERO, center, area: moment.length(), radius_squared: 0.0 }
    }

    /// Combines `parts` into one dipole about their area-weighted centroid.
    fn sum(parts: impl Iterator<Item = Self> + Clone) -> Self {
        let area: f64 = parts.clone().map(|part| part.area).sum();
        let moment = parts.clone().map(|part| part.moment).sum();
        let center = parts.clone().map(|part| part.center * (part.area / area)).sum();
        let spread = parts.map(|part| part.spread + outer(part.moment, part.center - center)).sum();
        Self { moment, spread, center, area, radius_squared: 0.0 }
    }

    /// Returns the approximate solid angle (sr) as seen from a point. `offset` is the vector from
    /// the point to the centre.
    fn solid_angle(&self, offset: DVec3) -> f64 {
        let squared = offset.length_squared();
        let trace = self.spread.x_axis.x + self.spread.y_axis.y + self.spread.z_axis.z;
        let bend = 3.0 * offset.dot(self.spread * offset) / squared;
        (self.moment.dot(offset) + trace - bend) / (squared * squared.sqrt())
    }
}

impl TriangleTree {
    /// Returns true if `p` is inside the surface: its winding number is at least one half. On
    /// closed surfaces the result is exact, and points on the surface count as inside. On open
    /// surfaces the result is an estimate, as if the openings were covered.
    pub fn inside(&self, p: DVec3) -> bool {
        if !self.bounds().holds(p) {
            return false;
        }
        if self.closed {
            self.crossings(p).is_none_or(|winding| winding >= 1)
        } else {
            self.winding_number_fast(p) >= tolerance::INSIDE_WINDING
        }
    }

    /// Returns the sum of the solid angles of all triangles as seen from `p`, divided by 4π. The
    /// result is 1 inside a closed surface, 0 outside, and about one half in an opening. The result
    /// is undefined on the surface. This function visits every triangle.
    pub fn winding_number(&self, p: DVec3) -> f64 {
        self.corners.iter().map(|corners| solid_angle(p, corners)).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// Returns the winding number with distant boxes approximated by dipoles. The result differs
    /// from [`Self::winding_number`] by at most about 0.02.
    pub fn winding_number_fast(&self, p: DVec3) -> f64 {
        let mut sum = 0.0;
        let mut stack = Stack::from_root(&self.nodes);
        while let Some(index) = stack.pop() {
            let (node, dipole) = (&self.nodes[index as usize], &self.dipoles[index as usize]);
            let offset = dipole.center - p;
            if offset.length_squared() > tolerance::DIPOLE_REACH * tolerance::DIPOLE_REACH * dipole.radius_squared {
                sum += dipole.solid_angle(offset);
            } else if node.is_leaf() {
                sum += self.corners[node.slots()].iter().map(|corners| solid_angle(p, corners)).sum::<f64>();
            } else {
                stack.push(node.second);
                stack.push(index + 1);
            }
        }
        sum / (4.0 * std::f64::consts::PI)
    }

    /// Returns the winding number of `p`, computed from the signed crossings of the ray along +x.
    /// The result is exact for closed surfaces. Returns `None` if `p` lies on the surface.
    pub(in crate::body) fn crossings(&self, p: DVec3) -> Option<i32> {
        let mut winding = 0;
        let reached = |b: &Aabb| b.max.x >= p.x && b.min.y <= p.y && p.y <= b.max.y && b.min.z <= p.z && p.z <= b.max.z;
        let flow = self.descend(reached, |slot| {
            let corners = &self.corners[slot];
            let bounds = Aabb::around(*corners);
            if !reached(&bounds) {
                return ControlFlow::Continue(());
            }
            let direction = pierced(corners, p);
            let near = bounds.min.x <= p.x;
            if direction == 0 && !near {
                return ControlFlow::Continue(());
            }
            let side = if near { side_of_plane(corners[0], corners[1], corners[2], p) } else { f64::from(-direction) };
            if side == 0.0 && holds_coplanar_point(corners, p) {
                return ControlFlow::Break(());
            }
            // The triangle is ahead of the point in two cases: the point is below a triangle that
            // faces along the ray, or above a triangle that faces against the ray.
            if side * f64::from(direction) < 0.0 {
                winding += direction;
            }
            ControlFlow::Continue(())
        });
        flow.is_continue().then_some(winding)
    }
}

/// Returns the matrix a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Returns +1 if the line through `p` along x crosses the triangle in the direction of its normal,
/// −1 if the line crosses against the normal, and 0 if the line misses. `p` is moved by (0, ε, ε²),
/// so the line never meets an edge. The test of an edge has the same result for both adjacent
/// triangles.
fn pierced(corners: &[DVec3; 3], p: DVec3) -> i32 {
    let flat = corners.map(|c| DVec2::new(c.y, c.z));
    let p = DVec2::new(p.y, p.z);
    let left = |u: DVec2, v: DVec2| {
        let exact = turn(u, v, p);
        if exact != 0.0 {
            exact > 0.0
        } else if u.y != v.y {
            v.y < u.y
        } else {
            v.x > u.x
        }
    };
    match [left(flat[0], flat[1]), left(flat[1], flat[2]), left(flat[2], flat[0])] {
        [true, true, true] => 1,
        [false, false, false] => -1,
        _ => 0,
    }
}

/// Returns the signed solid angle (sr) of a triangle as seen from `p`. The angle is positive if `p`
/// is behind the triangle (A. van Oosterom, J. Strackee, *The solid angle of a plane triangle*,
/// 1983).
fn solid_angle(p: DVec3, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|corner| corner - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use crate::body::shapes::{cuboid, torus};
    use crate::body::{Mesh, PolygonSoup};

    const SEED: u64 = 0x2204_c0de;

    #[test]
    fn crossings_agree_with_solid_angles() {
        let mesh = torus(1.0, 0.4, 24, 12);
        let tree = mesh.tree();
        let mut random = Random::new(SEED);
        for case in 0..2000 {
            // Points with the y and z of a vertex are the hardest cases, because their rays along x
            // meet vertices and edges of the torus.
            let v = mesh.vertices()[random.below(mesh.vertices().len())];
            let p = if case % 2 == 0 { DVec3::new(random.signed() * 1.5, v.y, v.z) } else { random.vector() * 1.5 };
            let winding = tree.winding_number(p);
            assert!((winding - winding.round()).abs() < 1e-9, "seed {SEED}, case {case}");
            assert_eq!(tree.inside(p), winding > 0.5, "seed {SEED}, case {case}: {p}");
            assert!((tree.winding_number_fast(p) - winding).abs() < 0.02, "seed {SEED}, case {case}");
        }
    }

    #[test]
    fn surface_points_are_inside_and_adjacent_floats_outside() {
        let tree = cuboid(DVec3::ZERO, DVec3::ONE).tree();
        let levels = [-0.5, 0.0_f64.next_down(), 0.0, 0.25, 0.5, 1.0, 1.0_f64.next_up(), 2.0];
        for x in levels {
            for y in levels {
                for z in levels {
                    let expected = [x, y, z].iter().all(|c| (0.0..=1.0).contains(c));
                    assert_eq!(tree.inside(DVec3::new(x, y, z)), expected, "{x} {y} {z}");
                }
            }
        }
    }

    #[test]
    fn overlapping_solids_and_open_boxes_have_an_inside() {
        let (a, b) = (cuboid(DVec3::ZERO, DVec3::ONE), cuboid(DVec3::splat(0.5), DVec3::splat(1.5)));
        let vertices = a.vertices().iter().chain(b.vertices()).copied().collect();
        let triangles: Vec<[u32; 3]> =
            a.triangles().iter().copied().chain(b.triangles().iter().map(|t| t.map(|v| v + 8))).collect();
        let both = Mesh::from_soup(&PolygonSoup::from_triangles(vertices, &triangles)).unwrap().0.tree();
        for (x, expected) in [(0.2, true), (0.7, true), (1.2, true), (1.6, false), (-0.1, false)] {
            assert_eq!(both.inside(DVec3::splat(x)), expected);
        }
        let open = PolygonSoup::from_triangles(a.vertices().to_vec(), &a.triangles()[..11]);
        let open = Mesh::from_soup(&open).unwrap().0;
        assert!(!open.is_closed());
        assert!(open.tree().inside(DVec3::splat(0.4)));
        assert!(!open.tree().inside(DVec3::new(0.5, 0.5, -0.4)));
    }
}
