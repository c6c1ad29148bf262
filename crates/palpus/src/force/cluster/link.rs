//! Steps 3 and 5 of the clustering: a grid of cells finds midpoints nearer than the radius.

use glam::DVec3;

use super::Linkage;
use crate::algebra::representative;
use crate::algebra::tolerance::CLUSTER_CELLS;

/// Grid cell of a contact. Sorting makes the contacts of one cell adjacent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Cell {
    label: u32,
    key: u64,
    rank: u32,
}

/// The contacts of one cell: `cells[start..end]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    label: u32,
    key: u64,
    start: u32,
    end: u32,
    /// True if all contacts of the cell are already linked.
    whole: bool,
}

/// Number of bits per axis in a cell's key.
const AXIS_BITS: u32 = 21;

/// The (x, y) offsets of the rows along z that contain the forward half of a cell's neighbours. A
/// cell's diagonal is δ and its side is δ/√3, so a distance below δ spans at most two cells along
/// each axis.
const ROWS: [(i64, i64); 13] =
    [(0, 0), (0, 1), (0, 2), (1, -2), (1, -1), (1, 0), (1, 1), (1, 2), (2, -2), (2, -1), (2, 0), (2, 1), (2, 2)];

impl Linkage {
    /// Steps 3 and 5: joins contacts with equal labels whose midpoints are nearer than `radius`.
    pub(super) fn link(&mut self, radius: f64) {
        self.parents.clear();
        self.parents.extend(0..self.order.len() as u32);
        if radius <= 0.0 {
            return;
        }
        let near = radius * radius;
        self.fill_cells(radius);
        for r in 0..self.runs.len() {
            self.link_within(r, near);
        }
        for (dx, dy) in ROWS {
            let offset = (dx << (2 * AXIS_BITS)) + (dy << AXIS_BITS);
            // In the cell's own row, start at the next cell. In other rows, start two cells back.
            // Always end two cells ahead.
            let back = if offset == 0 { 1 } else { -2 };
            let mut first = 0;
            for r in 0..self.runs.len() {
                let Run { label, key, .. } = self.runs[r];
                let from = (label, key.wrapping_add_signed(offset + back));
                let to = (label, key.wrapping_add_signed(offset + 2));
                // Runs and the cells that they search ascend, so `first` never decreases.
                while first < self.runs.len() && (self.runs[first].label, self.runs[first].key) < from {
                    first += 1;
                }
                let mut s = first;
                while s < self.runs.len() && (self.runs[s].label, self.runs[s].key) <= to {
                    self.link_across(r, s, near);
                    s += 1;
                }
            }
        }
    }

    /// Sorts the contacts into cells. Midpoints outside the grid go into its outermost cells. Such
    /// large cells are slower but not wrong, because all distances in a cell are compared.
    fn fill_cells(&mut self, radius: f64) {
        let low = self.points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let per_metre = 3f64.sqrt() / radius;
        let axis = |x: f64| (x * per_metre).min(CLUSTER_CELLS) as u64 + 2;
        self.cells.clear();
        for (rank, point) in self.points.iter().enumerate() {
            let p = *point - low;
            let key = (axis(p.x) << (2 * AXIS_BITS)) | (axis(p.y) << AXIS_BITS) | axis(p.z);
            self.cells.push(Cell { label: self.labels[rank], key, rank: rank as u32 });
        }
        self.cells.sort_unstable();
        self.runs.clear();
        for (k, &Cell { label, key, .. }) in self.cells.iter().enumerate() {
            let k = k as u32;
            match self.runs.last_mut() {
                Some(run) if run.label == label && run.key == key => run.end = k + 1,
                _ => self.runs.push(Run { label, key, start: k, end: k + 1, whole: false }),
            }
        }
    }

    fn link_within(&mut self, r: usize, near: f64) {
        let Run { start, end, .. } = self.runs[r];
        let mut whole = true;
        for k in start + 1..end {
            whole &= self.try_link(start, k, near);
        }
        if !whole {
            // This happens only in an outermost cell, or if rounding moved a midpoint across a cell
            // wall.
            for j in start + 1..end {
                for k in j + 1..end {
                    self.try_link(j, k, near);
                }
            }
        }
        self.runs[r].whole = whole;
    }

    fn link_across(&mut self, r: usize, s: usize, near: f64) {
        let (run, other) = (self.runs[r], self.runs[s]);
        let whole = run.whole && other.whole;
        if whole && self.root(self.cells[run.start as usize].rank) == self.root(self.cells[other.start as usize].rank) {
            return;
        }
        for j in run.start..run.end {
            for k in other.start..other.end {
                if self.try_link(j, k, near) && whole {
                    return;
                }
            }
        }
    }

    /// Links the contacts at indices `j` and `k` of `cells` if they are near. Returns true if they
    /// are near.
    fn try_link(&mut self, j: u32, k: u32, near: f64) -> bool {
        let (first, second) = (self.cells[j as usize].rank, self.cells[k as usize].rank);
        let linked = self.points[first as usize].distance_squared(self.points[second as usize]) < near; // Eq. 2
        if linked {
            let (first, second) = (self.root(first), self.root(second));
            self.parents[first.max(second) as usize] = first.min(second);
        }
        linked
    }

    pub(super) fn root(&mut self, rank: u32) -> u32 {
        representative(&mut self.parents, rank)
    }
}
