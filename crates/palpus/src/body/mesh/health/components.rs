//! Diagnoses the components of a mesh, and counts the fans of triangles around each vertex.

use crate::body::{HalfEdges, Mesh};

/// Diagnosis of one component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ComponentHealth {
    /// Number of triangles.
    pub triangles: usize,
    /// True if the component has no boundary and its triangles agree on which side is outside.
    pub closed: bool,
    /// Genus (number of handles); `None` unless each edge of the component has exactly two
    /// triangles that agree.
    pub genus: Option<usize>,
}

/// Counts of triangle fans. A fan is a set of triangles around a vertex that are connected across
/// edges at that vertex.
pub(super) struct Fans {
    /// Number of fans at each vertex.
    pub(super) at_vertex: Vec<u32>,
    /// Number of fans in each component.
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
            // Walk around the vertex in one direction. At a boundary, continue from the start in
            // the other direction.
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

/// Diagnoses each component, in the order of the components' first triangles.
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
            // Euler's formula is V − E + F = 2 − 2 g. A triangle has three sides and an edge has
            // two sides, so 2 g = 2 − V + F / 2.
            let twice = 2 + triangles[c] as i64 / 2 - fans.of_component[c] as i64;
            let genus = (whole[c] && twice >= 0).then_some(twice as usize / 2);
            ComponentHealth { triangles: triangles[c], closed: mesh.is_component_closed(c as u32), genus }
        })
        .collect()
}
