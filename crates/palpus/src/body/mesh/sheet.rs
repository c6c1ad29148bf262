//! Finds the components that are sheets: open surfaces whose both sides can be touched.

use glam::DVec3;

use crate::algebra::representative;
use crate::algebra::tolerance::SHEET_OPENING;
use crate::body::Aabb;
use crate::body::mesh::edge_uses::EdgeUses;

/// Returns for each of the `count` components whether it is a sheet. Edges that only one triangle
/// uses form openings. A component is a sheet if the bounding box of one of its openings has at
/// least the fraction [`SHEET_OPENING`] of the diagonal of the component's bounding box.
pub(super) fn sheets(
    uses: &EdgeUses,
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    component: &[u32],
    count: usize,
) -> Vec<bool> {
    let mut sheets = vec![false; count];
    // The ends of an open edge, from the number of its side.
    let ends = |side: u32| [0, 1].map(|k| triangles[side as usize / 3][(side as usize % 3 + k) % 3]);
    let open: Vec<u32> = uses.edges().filter(|edge| edge.len() == 1).map(|edge| edge[0]).collect();
    if open.is_empty() {
        return sheets;
    }
    let mut bounds = vec![Aabb::EMPTY; count];
    for (triangle, &c) in triangles.iter().zip(component) {
        let around = Aabb::around(triangle.iter().map(|&v| vertices[v as usize]));
        bounds[c as usize] = bounds[c as usize].union(&around);
    }
    let mut parents: Vec<u32> = (0..vertices.len() as u32).collect();
    for [p, q] in open.iter().map(|&side| ends(side)) {
        let (p, q) = (representative(&mut parents, p), representative(&mut parents, q));
        parents[p.max(q) as usize] = p.min(q);
    }
    let mut openings = vec![Aabb::EMPTY; vertices.len()];
    for &side in &open {
        for v in ends(side) {
            let opening = &mut openings[representative(&mut parents, v) as usize];
            *opening = opening.union(&Aabb::around([vertices[v as usize]]));
        }
    }
    for &side in &open {
        let c = component[side as usize / 3] as usize;
        let opening = openings[representative(&mut parents, ends(side)[0]) as usize];
        sheets[c] |= opening.diagonal() >= SHEET_OPENING * bounds[c].diagonal();
    }
    sheets
}
