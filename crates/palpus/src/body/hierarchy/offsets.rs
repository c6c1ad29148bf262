//! The hull vertices of the nodes in single precision, for lower bounds of their heights.
//!
//! The front must often know how low the hull of a node reaches along a direction. A bound is
//! enough if its error is much smaller than a contact tolerance. In a tick, hundreds of nodes are
//! asked, which are far apart in memory. So one list holds the vertices of all small nodes,
//! relative to the middle of each node, in single precision. They take half of the memory that a
//! polytope's vertices take, and a search reads nothing else.

use glam::DVec3;

use super::super::Polytope;
use super::Node;
use crate::algebra::tolerance::OFFSET_ROUNDING;

/// Nodes with more vertices have no offsets; a climb from vertex to vertex reads few of them. A
/// limit of 96 was no faster in measurements, and took more memory.
const MOST: usize = 32;

/// Number of vertices whose heights are computed at a time.
const LANES: usize = 4;

/// The offsets of the vertices of all nodes with at most [`MOST`] vertices.
#[derive(Clone, Debug)]
pub(super) struct Offsets {
    /// Index of the first group of each node, and one more entry: the number of groups.
    starts: Vec<u32>,
    /// For each node, an upper bound of the rounding error of its heights along a unit vector,
    /// model units.
    errors: Vec<f32>,
    groups: Vec<Group>,
}

/// The offsets of a few vertices. Copies of the first vertex complete the last group of a node.
#[derive(Clone, Copy, Debug)]
struct Group {
    x: [f32; LANES],
    y: [f32; LANES],
    z: [f32; LANES],
}

impl Offsets {
    /// Computes the offsets of the nodes of a tree over `pieces`. `hulls` are the hulls of the
    /// inner nodes.
    pub(super) fn of(nodes: &[Node], hulls: &[Polytope], pieces: &[Polytope]) -> Self {
        let mut offsets = Self {
            starts: Vec::with_capacity(nodes.len() + 1),
            errors: Vec::with_capacity(nodes.len()),
            groups: Vec::new(),
        };
        for node in nodes {
            offsets.starts.push(offsets.groups.len() as u32);
            offsets.add(node.polytope(hulls, pieces).vertices(), node.middle());
        }
        offsets.starts.push(offsets.groups.len() as u32);
        offsets.groups.shrink_to_fit();
        offsets
    }

    fn add(&mut self, vertices: &[DVec3], middle: DVec3) {
        let mut farthest = 0.0_f32;
        if vertices.len() <= MOST {
            for some in vertices.chunks(LANES) {
                let offsets: [_; LANES] = std::array::from_fn(|k| (some.get(k).unwrap_or(&some[0]) - middle).as_vec3());
                farthest = offsets.iter().fold(farthest, |farthest, offset| farthest.max(offset.length()));
                self.groups.push(Group {
                    x: offsets.map(|offset| offset.x),
                    y: offsets.map(|offset| offset.y),
                    z: offsets.map(|offset| offset.z),
                });
            }
        }
        self.errors.push(OFFSET_ROUNDING * farthest);
    }

    /// Returns a lower bound of the heights of the vertices of `node` above the node's middle,
    /// along `direction`. `None` if the node has more than [`MOST`] vertices.
    #[inline]
    pub(super) fn lowest(&self, node: u32, direction: DVec3) -> Option<f64> {
        let [begin, end] = [0, 1].map(|k| self.starts[node as usize + k] as usize);
        if begin == end {
            return None;
        }
        let along = direction.as_vec3();
        let mut lowest = [f32::INFINITY; LANES];
        for group in &self.groups[begin..end] {
            for (k, lowest) in lowest.iter_mut().enumerate() {
                let height = along.x * group.x[k] + along.y * group.y[k] + along.z * group.z[k];
                *lowest = if height < *lowest { height } else { *lowest };
            }
        }
        let lowest = lowest[0].min(lowest[1]).min(lowest[2].min(lowest[3]));
        // The sum of the coordinates is at least the length.
        let length = along.x.abs() + along.y.abs() + along.z.abs();
        Some(f64::from(lowest) - f64::from(self.errors[node as usize]) * f64::from(length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use crate::body::{Hierarchy, convex_hull};

    const SEED: u64 = 0x0ff5_e751;

    #[test]
    fn lowest_is_a_close_lower_bound() {
        let mut random = Random::new(SEED);
        let mut pieces: Vec<Polytope> = (0..30)
            .map(|_| {
                let (at, size) = (random.vector() * 10.0, random.between(1e-6, 1.0));
                let points: Vec<DVec3> = (0..20).map(|_| at + random.vector() * size).collect();
                convex_hull(&points, 1e-12).unwrap().into_polytope().unwrap().0
            })
            .collect();
        // The last piece has too many vertices.
        let points: Vec<DVec3> = (0..2 * MOST).map(|_| random.direction()).collect();
        pieces.push(convex_hull(&points, 1e-12).unwrap().into_polytope().unwrap().0);
        let tree = Hierarchy::build(&pieces, 1e-10).unwrap();
        for round in 0..100 {
            let direction = random.vector();
            for node in 0..tree.nodes().len() as u32 {
                let hull = tree.polytope(node, &pieces);
                let is_small = hull.vertices().len() <= MOST;
                assert_eq!(tree.offsets.lowest(node, direction).is_some(), is_small, "seed {SEED:#x}");
                let lowest = tree.lowest(node, &pieces, direction);
                let middle = tree.node(node).middle();
                let heights = hull.vertices().iter().map(|&vertex| direction.dot(vertex - middle));
                let true_height = heights.fold(f64::INFINITY, f64::min);
                let slack = 1e-6 * tree.node(node).sphere.radius * direction.length();
                assert!(lowest <= true_height, "seed {SEED:#x}, round {round}: {lowest} > {true_height}");
                assert!(lowest >= true_height - slack, "seed {SEED:#x}, round {round}: {lowest} is too low");
            }
        }
    }
}
