//! Obstacles that are created for one translation, and kept for the next pose.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::super::cell::Cell;
use super::super::obstacle::Gate;
use super::super::slabs::Slabs;
use super::super::surfaces::Crossing;
use super::{Key, Leaf, Ray, Scene};
use crate::algebra::tolerance::DEPTH_LENSES;
use crate::body::Body;

/// An obstacle that was created for one translation.
pub(super) struct Added {
    /// The moving cell in its body's frame. `None` for a ball, because a ball is valid at one pose
    /// only.
    pub(super) source: Option<Cell>,
    pub(super) moving: Vec<DVec3>,
    pub(super) fixed: Vec<DVec3>,
    pub(super) fixed_cell: Option<Cell>,
    /// True if the obstacle blocked a classified translation.
    pub(super) used: bool,
    pub(super) center: DVec3,
    pub(super) inner: f64,
    pub(super) outer: f64,
    pub(super) moving_slabs: Slabs,
    pub(super) fixed_slabs: Slabs,
}

impl Scene<'_> {
    /// Returns the obstacle of two cells that overlap where the bodies overlap, with body a moved
    /// by `t`.
    pub(super) fn obstacle_at(&self, crossings: &[Crossing], t: DVec3) -> Option<Added> {
        let closed = |body: &Body| body.mesh().is_closed();
        let (p, q) = if closed(self.a) && closed(self.b) {
            // Takes a few crossings, spread evenly over all of them.
            let stride = crossings.len().div_ceil(DEPTH_LENSES);
            let lenses = crossings.iter().step_by(stride).filter_map(|crossing| self.lens(crossing, t));
            let deepest = lenses.max_by(|p, q| p.depth.total_cmp(&q.depth))?;
            let z = deepest.point_a;
            (Cell::grow(self.a.tree(), z, z, self.a.size())?, {
                let z = deepest.point_b;
                Cell::grow(self.b.tree(), z, z, self.b.size())?
            })
        } else {
            // A surface that is not closed has no inside. In this case a triangle is used as the
            // cell.
            let crossing = crossings.first()?;
            (
                Cell::flat(self.a.mesh().triangle_points(crossing.moving)),
                Cell::flat(self.b.mesh().triangle_points(crossing.fixed)),
            )
        };
        Some(self.added_of(p, q))
    }

    /// Returns the obstacle of a cell `p` of body a (in a's frame) and a cell `q` of b.
    fn added_of(&self, p: Cell, q: Cell) -> Added {
        let moving: Vec<DVec3> = p.corners.iter().map(|&corner| self.placement.point(corner)).collect();
        Added {
            moving_slabs: Slabs::around(moving.iter().copied()),
            fixed_slabs: Slabs::around(q.corners.iter().copied()),
            moving,
            center: q.center - self.placement.point(p.center),
            inner: p.inner + q.inner,
            outer: p.outer + q.outer,
            fixed: q.corners.clone(),
            fixed_cell: Some(q),
            used: false,
            source: Some(p),
        }
    }

    /// Adds the obstacles of earlier searches to this pose. `leaves` has the obstacles that blocked
    /// cones in the last search, and `gates` has the exits of rays.
    pub(in super::super) fn restore(&mut self, kept: &[(Cell, Cell)], leaves: &[Leaf], gates: BTreeMap<Ray, Gate>) {
        self.gates[0] = gates;
        let of_leaves = leaves.iter().flat_map(|leaf| leaf.chain.iter().copied());
        let known: BTreeSet<Key> = of_leaves.chain((0..kept.len() as u32).map(Key::Added)).collect();
        self.known.extend(known);
        for (p, q) in kept {
            let added = self.added_of(p.clone(), q.clone());
            self.added.push(added);
        }
    }

    /// Extracts the cells of the added obstacles that are in `leaves` or that blocked a translation
    /// at this pose, and renumbers the obstacles. Also returns the exits of rays at this pose.
    pub(in super::super) fn keep(self, leaves: &mut [Leaf]) -> (Vec<(Cell, Cell)>, BTreeMap<Ray, Gate>) {
        let [_, gates] = self.gates;
        let mut used: Vec<bool> = self.added.iter().map(|added| added.used).collect();
        for key in leaves.iter().flat_map(|leaf| &leaf.chain) {
            if let Key::Added(k) = key {
                used[*k as usize] = true;
            }
        }
        let mut kept = Vec::new();
        let mut number = vec![None; self.added.len()];
        for (k, added) in self.added.into_iter().enumerate() {
            if let (true, Some(p), Some(q)) = (used[k], added.source, added.fixed_cell) {
                number[k] = Some(kept.len() as u32);
                kept.push((p, q));
            }
        }
        for leaf in leaves {
            leaf.chain.retain_mut(|key| match key {
                Key::Pair(_) => true,
                Key::Added(k) => match number[*k as usize] {
                    Some(new) => {
                        *k = new;
                        true
                    }
                    None => false,
                },
            });
        }
        (kept, gates)
    }
}
