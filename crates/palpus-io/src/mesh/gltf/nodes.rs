//! Computes the transforms of the nodes of a glTF scene.

use glam::{DMat4, DQuat, DVec3};

use super::document::Root;
use crate::mesh::fault::{Fault, Place};

/// Visits the nodes of the scene, parents first. `visit` receives each node and its transform from
/// the node's frame to the scene.
pub(super) fn visit_nodes(root: &Root, mut visit: impl FnMut(usize, &DMat4) -> Result<(), Fault>) -> Result<(), Fault> {
    let mut seen = vec![false; root.nodes.len()];
    let mut due = Vec::new();
    for node in roots(root)? {
        reach(node, None, &mut seen)?;
        due.push((node, own_matrix(root, node)?));
        while let Some((node, matrix)) = due.pop() {
            visit(node, &matrix)?;
            for &child in root.nodes[node].children.iter().rev() {
                reach(child, Some(node), &mut seen)?;
                due.push((child, matrix * own_matrix(root, child)?));
            }
        }
    }
    Ok(())
}

/// Marks a node as reached; fails if the node was reached before or does not exist.
fn reach(node: usize, parent: Option<usize>, seen: &mut [bool]) -> Result<(), Fault> {
    let place = parent.map_or(Place::File, |parent| Place::Element("node", parent as u64));
    match seen.get_mut(node) {
        None => Err(Fault::malformed(place, format!("node {node} does not exist; export the mesh again"))),
        Some(true) => {
            let what = format!("node {node} is reached twice, but nodes must form trees; export the mesh again");
            Err(Fault::malformed(place, what))
        }
        Some(unseen) => {
            *unseen = true;
            Ok(())
        }
    }
}

/// Returns the root nodes of the default scene, or the nodes without a parent if the file has no
/// scenes.
fn roots(root: &Root) -> Result<Vec<usize>, Fault> {
    if root.scenes.is_empty() && root.scene.is_none() {
        let mut is_child = vec![false; root.nodes.len()];
        for &child in root.nodes.iter().flat_map(|node| &node.children) {
            if let Some(is_child) = is_child.get_mut(child) {
                *is_child = true;
            }
        }
        return Ok((0..root.nodes.len()).filter(|&node| !is_child[node]).collect());
    }
    let scene = root.scene.unwrap_or(0);
    match root.scenes.get(scene) {
        Some(scene) => Ok(scene.nodes.clone()),
        None => Err(Fault::malformed(Place::File, format!("scene {scene} does not exist; export the mesh again"))),
    }
}

/// Returns the transform from a node's frame to its parent's frame.
fn own_matrix(root: &Root, index: usize) -> Result<DMat4, Fault> {
    let Some(node) = root.nodes.get(index) else { return Ok(DMat4::IDENTITY) };
    if let Some(matrix) = &node.matrix {
        return Ok(DMat4::from_cols_array(matrix));
    }
    let rotation = node.rotation.as_ref().map_or(DQuat::IDENTITY, |q| DQuat::from_array(**q));
    let length = rotation.length();
    if !(length.is_finite() && length > 0.5) {
        let what = "the rotation is not a unit quaternion; export the mesh again";
        return Err(Fault::malformed(Place::Element("node", index as u64), what));
    }
    let translation = node.translation.as_ref().map_or(DVec3::ZERO, |t| DVec3::from_array(**t));
    let scale = node.scale.as_ref().map_or(DVec3::ONE, |s| DVec3::from_array(**s));
    Ok(DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}
