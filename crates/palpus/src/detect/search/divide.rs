//! Divides a query into parts.

use crate::algebra::tolerance::DIVIDED_FROM;
use crate::body::{Body, Hierarchy, NodeKind};
use crate::detect::QuerySettings;

/// Number of parts of a divided query. More parts share the work of several threads more evenly,
/// but each part costs some tenths of a microsecond, even without contacts.
const PARTS: usize = 8;

/// Returns the pairs of nodes whose leaf pairs are the parts of a query. Only a query that follows
/// a motion, of two bodies with many pieces, is divided.
pub(super) fn divide(a: &Body, b: &Body, settings: &QuerySettings) -> Vec<[u32; 2]> {
    let (of_a, of_b) = (a.hierarchy(), b.hierarchy());
    if !settings.holding || a.polytopes().len().saturating_mul(b.polytopes().len()) < DIVIDED_FROM {
        return vec![[of_a.root(), of_b.root()]];
    }
    if a.size() <= b.size() {
        largest_nodes(of_a).into_iter().map(|node| [node, of_b.root()]).collect()
    } else {
        largest_nodes(of_b).into_iter().map(|node| [of_a.root(), node]).collect()
    }
}

/// Returns nodes that together have all leaves, each leaf once. The node with the most leaves is
/// split until there are [`PARTS`] nodes.
fn largest_nodes(hierarchy: &Hierarchy) -> Vec<u32> {
    let mut nodes = vec![hierarchy.root()];
    while nodes.len() < PARTS {
        let largest = nodes.iter().enumerate().max_by_key(|&(k, &node)| (leaves(hierarchy, node), usize::MAX - k));
        let Some((k, &node)) = largest else { break };
        let NodeKind::Inner { left, right } = hierarchy.node(node).kind else { break };
        nodes.splice(k..=k, [left, right]);
    }
    nodes
}

/// Returns the number of leaves below a node.
fn leaves(hierarchy: &Hierarchy, node: u32) -> usize {
    let (mut count, mut stack) = (0, vec![node]);
    while let Some(node) = stack.pop() {
        match hierarchy.node(node).kind {
            NodeKind::Leaf { .. } => count += 1,
            NodeKind::Inner { left, right } => stack.extend([left, right]),
        }
    }
    count
}
