//! The components of a mesh, and the fans of triangles by which pinched vertices are taken apart.

use crate::body::{HalfEdges, Mesh};

/// Health of one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentHealth {
    /// Number of triangles.
    pub triangles: usize,
    /// No boundary within the component, and its triangles agree.
    pub closed: bool,
    /// Number of handles; known when each edge of the component has exactly two triangles that
    /// agree.
    pub genus: Option<usize>,
}

/// The fans of triangles around vertices: corners connected across the sides that meet there.
pub(super) struct Fans {
    /// Number of fans of each vertex.
    pub(super) at_vertex: Vec<u32>,
    /// Number of fans of each component.
    pub(super) of_component: Vec<usize>,
}

impl Fans {
    pub(super) fn new(mesh: &Mesh, edges: &HalfEdges) -> Self {
        let mut answer =
            Self { at_vertex: vec![0; mesh.vertices().len()], of_component: vec![0; mesh.component_count()] };
        let mut seen = vec![false; 3 * mesh.triangles().len()];
        for (t, k) in (0..mesh.triangles().len() as u32).flat_map(|t| [(t, 0), (t, 1), (t, 2)]) {
            if seen[3 * t as usize + k] {
                continue;
            }
            answer.at_vertex[mesh.triangles()[t as usize][k] as usize] += 1;
            answer.of_component[mesh.component(t) as usize] += 1;
            // Goes around in one direction, and then in the other if it met a boundary.
            let mut corner = Some((t, k));
            while let Some((t, k)) = corner.filter(|&(t, k)| !seen[3 * t as usize + k]) {
                seen[3 * t as usize + k] = true;
                corner = edges.neighbour(t, k).map(|(other, j)| (other, (j + 1) % 3));
            }
            let mut corner = edges.neighbour(t, (k + 2) % 3);
            while let Some((t, k)) = corner.filter(|&(t, k)| !seen[3 * t as usize + k]) {
                seen[3 * t as usize + k] = true;
                corner = edges.neighbour(t, (k + 2) % 3);
            }
        }
        answer
    }
}

/// Health of each component, in the order of their first triangles.
pub(super) fn components(mesh: &Mesh, edges: &HalfEdges, fans: &Fans) -> Vec<ComponentHealth> {
    let count = mesh.component_count();
    let (mut triangles, mut whole) = (vec![0_usize; count], vec![true; count]);
    for t in 0..mesh.triangles().len() as u32 {
        let c = mesh.component(t) as usize;
        triangles[c] += 1;
        whole[c] &= (0..3).all(|k| edges.neighbour(t, k).is_some());
    }
    (0..count)
        .map(|c| {
            // V − E + F = 2 − 2 g with three sides to a triangle and two to an edge: 2 g = 2 − V +
            // F / 2.
            let twice = 2 + triangles[c] as i64 / 2 - fans.of_component[c] as i64;
            let genus = (whole[c] && twice >= 0).then_some(twice as usize / 2);
            ComponentHealth { triangles: triangles[c], closed: mesh.is_component_closed(c as u32), genus }
        })
        .collect()
}
