//! Finds the triangle across each edge, and the bend of the surface at the edge.
//!
//! Side `k` of a triangle runs from its corner `k` to its corner `k + 1`. Two triangles are
//! neighbours across an edge if no other triangle uses the edge and their sides run along it in
//! opposite directions. There is no neighbour across a boundary, across an edge of three or more
//! triangles, or across an edge of two triangles with opposite orientations.
//!
//! 1. Group the sides of all triangles by their undirected edge ([`EdgeUses`]).
//! 2. Pair the two sides of each manifold edge.
//! 3. Classify each edge. An edge is coplanar if its two triangles lie in one plane within
//!    [`tolerance::COPLANAR`]. Otherwise an exact predicate decides whether the edge is convex or
//!    reflex.

use glam::DVec3;

use crate::algebra::tolerance;
use crate::body::Mesh;
use crate::body::mesh::edge_uses::EdgeUses;
use crate::body::mesh::triangle_pair::side_of_plane;

/// Kind of an edge, by the bend of the surface at the edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeKind {
    /// No other triangle uses the edge.
    Open,
    /// Three or more triangles use the edge, or two triangles that disagree on which side is
    /// outside.
    NonManifold,
    /// The surface bends away from the outside, as at a ridge.
    Convex,
    /// Both triangles lie in one plane, within [`tolerance::COPLANAR`] times the mesh's bounding
    /// diagonal.
    Coplanar,
    /// The surface bends towards the outside, as in a valley.
    Reflex,
}

/// The neighbour of each side of each triangle of a mesh.
#[derive(Clone, Debug)]
pub struct HalfEdges {
    /// For side `3 t + k`, the side on the other triangle; `u32::MAX` if there is no neighbour.
    twins: Vec<u32>,
    kinds: Vec<EdgeKind>,
}

impl HalfEdges {
    /// Finds the neighbours of all triangles of `mesh` and classifies its edges.
    pub fn new(mesh: &Mesh) -> Self {
        let sides = 3 * mesh.triangles().len();
        let mut answer = Self { twins: vec![u32::MAX; sides], kinds: vec![EdgeKind::NonManifold; sides] };
        let height_tolerance = tolerance::COPLANAR * mesh.bounding_diagonal();
        for uses in EdgeUses::new(mesh.vertices().len(), mesh.triangles()).edges() {
            match *uses {
                [side] => answer.kinds[side as usize] = EdgeKind::Open,
                [first, second] if tail(mesh.triangles(), first) != tail(mesh.triangles(), second) => {
                    answer.twins[first as usize] = second;
                    answer.twins[second as usize] = first;
                    let kind = classify(mesh, first, second, height_tolerance);
                    answer.kinds[first as usize] = kind;
                    answer.kinds[second as usize] = kind;
                }
                _ => {}
            }
        }
        answer
    }

    /// Returns the triangle across side `k` of triangle `t`, and the number of the common side
    /// in that triangle; `None` if there is no neighbour.
    #[inline]
    pub fn neighbour(&self, t: u32, k: usize) -> Option<(u32, usize)> {
        let twin = self.twins[3 * t as usize + k];
        (twin != u32::MAX).then_some((twin / 3, (twin % 3) as usize))
    }

    /// Returns the kind of the edge at side `k` of triangle `t`. Both triangles at an edge have the
    /// same result.
    #[inline]
    pub fn kind(&self, t: u32, k: usize) -> EdgeKind {
        self.kinds[3 * t as usize + k]
    }

    /// Returns the angle (rad) by which the normal turns across side `k` of triangle `t`, in (−π,
    /// π]. The angle is positive at a convex edge and negative at a reflex edge. Returns `None` if
    /// there is no neighbour.
    pub fn bend(&self, mesh: &Mesh, t: u32, k: usize) -> Option<f64> {
        let (other, _) = self.neighbour(t, k)?;
        let corners = mesh.triangle_points(t);
        let along = (corners[(k + 1) % 3] - corners[k]).normalize_or_zero();
        let (here, there) = (mesh.triangle_normal(t), mesh.triangle_normal(other));
        Some(here.cross(there).dot(along).atan2(here.dot(there)))
    }
}

/// Returns the vertex at which side `side` (3 t + k) starts.
fn tail(triangles: &[[u32; 3]], side: u32) -> u32 {
    triangles[(side / 3) as usize][(side % 3) as usize]
}

/// Returns the corner points of the triangle of `side`, rotated so that the side runs from the
/// first to the second.
fn turned(mesh: &Mesh, side: u32) -> [DVec3; 3] {
    let p = mesh.triangle_points(side / 3);
    let k = (side % 3) as usize;
    [p[k], p[(k + 1) % 3], p[(k + 2) % 3]]
}

/// Classifies the edge between two triangles. The edge is coplanar under two conditions. Each
/// triangle's opposite corner lies within `height_tolerance` of the other triangle's plane, and the
/// triangles do not fold onto each other. Otherwise an exact predicate finds the side of the
/// opposite corner, which decides the kind. A fold of opening angle zero counts as reflex, so that
/// no patch grows across it.
fn classify(mesh: &Mesh, first: u32, second: u32, height_tolerance: f64) -> EdgeKind {
    let ([a, b, c], [_, _, d]) = (turned(mesh, first), turned(mesh, second));
    let (n_first, n_second) = (mesh.triangle_normal(first / 3), mesh.triangle_normal(second / 3));
    let heights = (n_first.dot(d - a)).abs().max(n_second.dot(c - a).abs());
    if heights <= height_tolerance && n_first.dot(n_second) > 0.0 {
        return EdgeKind::Coplanar;
    }
    if side_of_plane(a, b, c, d) < 0.0 { EdgeKind::Convex } else { EdgeKind::Reflex }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::PolygonSoup;

    fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Mesh {
        let vertices = vertices.iter().map(|&p| DVec3::from(p)).collect();
        Mesh::from_soup(&PolygonSoup::from_triangles(vertices, triangles)).unwrap().0
    }

    #[test]
    fn edge_kind_and_bend_follow_the_apex_height() {
        for (height, kind) in [
            (-1.0, EdgeKind::Convex),
            (1.0, EdgeKind::Reflex),
            (0.0, EdgeKind::Coplanar),
            (-1e-10, EdgeKind::Coplanar),
            (1e-8, EdgeKind::Reflex),
            (-1e-8, EdgeKind::Convex),
        ] {
            let mesh = mesh(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., -1., height]], &[[0, 1, 2], [1, 0, 3]]);
            let edges = HalfEdges::new(&mesh);
            assert_eq!(edges.neighbour(0, 0), Some((1, 0)));
            assert_eq!(edges.neighbour(0, 1), None);
            assert_eq!((edges.kind(0, 0), edges.kind(1, 0), edges.kind(0, 1)), (kind, kind, EdgeKind::Open));
            let bend = edges.bend(&mesh, 0, 0).unwrap();
            assert!((bend + f64::atan(height)).abs() < 1e-12, "{height}: {bend}");
        }
    }

    #[test]
    fn a_fold_of_angle_zero_is_reflex() {
        let mesh = mesh(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]], &[[0, 1, 2], [1, 0, 3]]);
        assert_eq!(HalfEdges::new(&mesh).kind(0, 0), EdgeKind::Reflex);
    }

    #[test]
    fn an_edge_of_three_triangles_has_no_neighbours() {
        let vertices = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.]];
        let edges = HalfEdges::new(&mesh(&vertices, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]));
        assert_eq!((edges.neighbour(0, 0), edges.kind(0, 0)), (None, EdgeKind::NonManifold));
    }
}
