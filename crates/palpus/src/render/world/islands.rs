//! Groups of bodies that touch each other, directly or through other moved bodies. One implicit
//! step moves each group.

/// Groups of bodies. Memory is allocated when bodies are added.
#[derive(Clone, Debug, Default)]
pub(super) struct Islands {
    /// Parent of each body in the union–find structure of the groups; a root is its own parent.
    parent: Vec<u32>,
    /// For each body: number of moved neighbours.
    neighbours: Vec<u32>,
    /// The moved bodies, group by group. In a group, bodies with fewer neighbours come first, then
    /// bodies that were added earlier.
    order: Vec<u32>,
}

impl Islands {
    /// Allocates memory for another body.
    pub(super) fn add(&mut self) {
        self.parent.push(0);
        self.neighbours.push(0);
        self.order.reserve(self.parent.len());
    }

    /// Makes each body a separate group.
    pub(super) fn begin(&mut self) {
        self.parent.iter_mut().enumerate().for_each(|(i, parent)| *parent = i as u32);
        self.neighbours.fill(0);
        self.order.clear();
    }

    /// Joins the groups of the moved bodies `i` and `j`, which touch each other.
    pub(super) fn join(&mut self, i: usize, j: usize) {
        self.neighbours[i] += 1;
        self.neighbours[j] += 1;
        let (i, j) = (self.root(i), self.root(j));
        // The earlier body becomes the root.
        self.parent[i.max(j)] = i.min(j) as u32;
    }

    /// Computes the groups of the bodies that are `moved`.
    pub(super) fn sort(&mut self, moved: impl Fn(usize) -> bool) {
        for i in 0..self.parent.len() {
            if moved(i) {
                self.parent[i] = self.root(i) as u32;
                self.order.push(i as u32);
            }
        }
        let Self { parent, neighbours, order } = self;
        order.sort_unstable_by_key(|&i| (parent[i as usize], neighbours[i as usize], i));
    }

    /// Returns the number of moved bodies.
    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    /// Returns the moved body at index `k` of the order.
    pub(super) fn body(&self, k: usize) -> usize {
        self.order[k] as usize
    }

    /// Returns the end of the group that begins at index `k` of the order.
    pub(super) fn end(&self, k: usize) -> usize {
        let group = self.parent[self.body(k)];
        self.order[k..].iter().position(|&i| self.parent[i as usize] != group).map_or(self.order.len(), |n| k + n)
    }

    /// Returns the group of body `i`.
    pub(super) fn group(&self, i: usize) -> u32 {
        self.parent[i]
    }

    fn root(&self, mut i: usize) -> usize {
        while self.parent[i] as usize != i {
            i = self.parent[i] as usize;
        }
        i
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indirect_contact_joins_groups() {
        let mut islands = Islands::default();
        (0..7).for_each(|_| islands.add());
        islands.begin();
        islands.join(5, 2);
        islands.join(2, 6);
        islands.join(1, 3);
        islands.sort(|i| i != 0);
        let order: Vec<_> = (0..islands.len()).map(|k| islands.body(k)).collect();
        assert_eq!(order, [1, 3, 5, 6, 2, 4]);
        assert_eq!((islands.end(0), islands.end(2), islands.end(5)), (2, 5, 6));
    }
}
