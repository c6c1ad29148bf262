//! Tracks the edges with only one face during the assembly of a polytope.

use super::super::Edge;

/// The edges that have only one face so far, in a linked list for each tail vertex.
pub(super) struct OpenEdges {
    /// For each vertex, the first edge of its list.
    first: Vec<u32>,
    /// For each edge, the next edge of its list.
    next: Vec<u32>,
}

impl OpenEdges {
    const END: u32 = u32::MAX;

    /// Returns an empty list for this number of vertices, with memory for `edges` edges.
    pub(super) fn new(vertices: usize, edges: usize) -> Self {
        Self { first: vec![Self::END; vertices], next: Vec::with_capacity(edges) }
    }

    /// Removes the open edge `tail → head` and returns it; `None` if this edge is not open.
    pub(super) fn close(&mut self, edges: &[Edge], tail: u32, head: u32) -> Option<u32> {
        let (mut before, mut e) = (Self::END, self.first[tail as usize]);
        while e != Self::END {
            let after = self.next[e as usize];
            if edges[e as usize].head == head {
                if before == Self::END {
                    self.first[tail as usize] = after;
                } else {
                    self.next[before as usize] = after;
                }
                return Some(e);
            }
            (before, e) = (e, after);
        }
        None
    }

    /// Adds the edge `tail → head`. The caller must append this edge to `edges` next. Returns false
    /// if an edge `tail → head` is already open.
    pub(super) fn open(&mut self, edges: &[Edge], tail: u32, head: u32) -> bool {
        let mut e = self.first[tail as usize];
        while e != Self::END {
            if edges[e as usize].head == head {
                return false;
            }
            e = self.next[e as usize];
        }
        self.next.push(self.first[tail as usize]);
        self.first[tail as usize] = edges.len() as u32;
        true
    }

    /// Returns the open edge with the smallest index; `None` if no edge is open.
    pub(super) fn first(&self) -> Option<u32> {
        let edge = |e: u32| (e != Self::END).then_some(e);
        let chain = |&first: &u32| std::iter::successors(edge(first), |&e| edge(self.next[e as usize]));
        self.first.iter().flat_map(chain).min()
    }
}
