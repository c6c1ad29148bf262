//! The reference for searches of near pairs: a traversal of both hierarchies from their roots,
//! without cached data, boxes or a particular order.

use palpus::algebra::Placement;
use palpus::body::NodeKind;
use palpus::collision::{Closest, Proximity, Side, initial_features, march};

/// The two pieces of a pair of leaves, and the result of its distance search.
pub(crate) type Near = (u32, u32, Proximity);

/// Returns the distance; zero if the pieces overlap.
pub(crate) fn distance(proximity: &Proximity) -> f64 {
    match proximity {
        Proximity::Disjoint(Closest { distance, .. }) => *distance,
        Proximity::Overlapping(_) => 0.0,
    }
}

/// Returns every pair of leaves that overlaps or is nearer than `tolerance`, and the number of
/// distance searches.
pub(crate) fn within(a: Side<'_>, b: Side<'_>, pose_ba: &Placement, tolerance: f64) -> (Vec<Near>, u64) {
    let (mut found, mut marches) = (Vec::new(), 0);
    let mut left = vec![[a.hierarchy.root(), b.hierarchy.root()]];
    while let Some([i, j]) = left.pop() {
        let (node_a, node_b) = (a.hierarchy.node(i), b.hierarchy.node(j));
        let apart = pose_ba.point(node_a.sphere.center).distance(node_b.sphere.center);
        if apart - node_a.sphere.radius - node_b.sphere.radius > tolerance {
            continue;
        }
        let (hull_a, hull_b) = (a.hierarchy.polytope(i, a.pieces), b.hierarchy.polytope(j, b.pieces));
        let proximity = march(hull_a, hull_b, pose_ba, initial_features(hull_a, hull_b, pose_ba)).proximity;
        marches += 1;
        let overlaps = matches!(proximity, Proximity::Overlapping(_));
        match (node_a.kind, node_b.kind) {
            (NodeKind::Leaf { piece: p }, NodeKind::Leaf { piece: q }) => {
                if overlaps || distance(&proximity) < tolerance {
                    found.push((p, q, proximity));
                }
            }
            _ if distance(&proximity) > tolerance => {}
            (NodeKind::Inner { left: one, right: other }, kind_b)
                if node_a.sphere.radius > node_b.sphere.radius || matches!(kind_b, NodeKind::Leaf { .. }) =>
            {
                left.extend([[one, j], [other, j]]);
            }
            (_, NodeKind::Inner { left: one, right: other }) => left.extend([[i, one], [i, other]]),
            (NodeKind::Inner { .. }, NodeKind::Leaf { .. }) => unreachable!("a leaf has no children"),
        }
    }
    (found, marches)
}
