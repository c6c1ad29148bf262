//! Which triangle lies across each edge, and how the surface bends there.
//!
//! Side `k` of a triangle runs from its corner `k` to its corner `k + 1`. Two triangles are
//! neighbours across an edge when they are the only two that use it and run along it in opposite
//! directions; everything else (a boundary, an edge of three or more triangles, two triangles of
//! opposite orientation) has no neighbour, and nothing panics.
//!
//! 1. Sort the sides of all triangles by their undirected edge, in linear time ([`EdgeUses`]).
//! 2. Pair the two sides of each manifold edge.
//! 3. Classify the edge: coplanar within the register's tolerance, else convex or reflex by an
//!    exact predicate.

use glam::DVec3;

use crate::algebra::tolerance;
use crate::body::Mesh;
use crate::body::mesh::edge_uses::EdgeUses;
use crate::body::mesh::triangle_pair::side_of_plane;

/// How the surface bends at one side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EdgeKind {
    /// No other triangle uses the edge.
    Open,
    /// Three or more triangles use the edge, or two that disagree about which side is outside.
    NonManifold,
    /// The neighbour bends away from the outside: a ridge.
    Convex,
    /// The neighbour lies in the same plane, within [`tolerance::COPLANAR`] of the mesh's bounding
    /// diagonal.
    Coplanar,
    /// The neighbour bends towards the outside: a valley.
    Reflex,
}

/// The neighbour of each side of each triangle of a mesh.
#[derive(Clone, Debug)]
pub struct HalfEdges {
    /// For side `3 t + k` the side across, or `u32::MAX`.
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

    /// The triangle across side `k` of triangle `t`, and the index of the common edge there; `None`
    /// if there is no unique neighbour of the same orientation.
    #[inline]
    pub fn neighbour(&self, t: u32, k: usize) -> Option<(u32, usize)> {
        let twin = self.twins[3 * t as usize + k];
        (twin != u32::MAX).then_some((twin / 3, (twin % 3) as usize))
    }

    /// How the surface bends at side `k` of triangle `t`; the same seen from either side.
    #[inline]
    pub fn kind(&self, t: u32, k: usize) -> EdgeKind {
        self.kinds[3 * t as usize + k]
    }

    /// The angle in radians by which the normal turns across side `k` of triangle `t`: positive at
    /// a convex edge, negative at a reflex one, in (−π, π]; `None` where there is no neighbour.
    pub fn bend(&self, mesh: &Mesh, t: u32, k: usize) -> Option<f64> {
        let (other, _) = self.neighbour(t, k)?;
        let corners = mesh.triangle_points(t);
        let along = (corners[(k + 1) % 3] - corners[k]).normalize_or_zero();
        let (here, there) = (mesh.triangle_normal(t), mesh.triangle_normal(other));
        Some(here.cross(there).dot(along).atan2(here.dot(there)))
    }
}

/// The vertex at which side `side` (3 t + k) starts.
fn tail(triangles: &[[u32; 3]], side: u32) -> u32 {
    triangles[(side / 3) as usize][(side % 3) as usize]
}

/// The corner points of the triangle of `side`, turned so that the side runs from the first to the
/// second.
fn turned(mesh: &Mesh, side: u32) -> [DVec3; 3] {
    let p = mesh.triangle_points(side / 3);
    let k = (side % 3) as usize;
    [p[k], p[(k + 1) % 3], p[(k + 2) % 3]]
}

/// Coplanar when each triangle's far corner is within `height_tolerance` of the other's plane and
/// neither folds back onto the other; else the exact side of the far corner decides. A fold of
/// opening angle zero counts as reflex, so that no patch grows across it.
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
    fn edges_bend_as_the_apex_lies() {
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
    fn a_fold_back_is_no_plane() {
        let mesh = mesh(&[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]], &[[0, 1, 2], [1, 0, 3]]);
        assert_eq!(HalfEdges::new(&mesh).kind(0, 0), EdgeKind::Reflex);
    }

    #[test]
    fn a_fin_has_no_neighbours() {
        let vertices = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.]];
        let edges = HalfEdges::new(&mesh(&vertices, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]));
        assert_eq!((edges.neighbour(0, 0), edges.kind(0, 0)), (None, EdgeKind::NonManifold));
    }
}
