//! Quickhull with exact signs: computes the triangulated hull of a point set of non-zero volume.
//!
//! Each point outside the current hull is in the list of one facet, and lies strictly above that
//! facet. Each round takes a facet whose list is not empty:
//!
//! 1. The apex is the point of the list that is highest above the facet. Floating-point heights are
//!    sufficient, because the hull is correct for any point of the list.
//! 2. A flood fill across edges finds the visible facets. A facet is visible if it is strictly
//!    below the apex.
//! 3. The border of the visible facets, the horizon, is one simple ring. New facets from the
//!    horizon to the apex replace the visible facets.
//! 4. Each point in the list of a removed facet moves to the list of a new facet below the point.
//!    If no new facet is below the point, the point is inside the hull.
//!
//! Exact signs are sufficient if a coplanar point counts as *not above*. Seen from the apex, the
//! visible facets project one to one onto a convex polygon. Therefore they form a disc, no side of
//! the horizon is collinear with the apex, and no new facet is degenerate.
//!
//! At each side of the horizon, a visible facet meets an outer facet. The normal of the new facet
//! at this side is a non-negative combination of the normals of these two facets. Therefore a point
//! above both facets is above the new facet, and step 4 loses no outside point.

use glam::DVec3;

use super::HullError;

/// A closed triangulated surface. Its triangles are counter-clockwise as seen from outside.
pub(super) struct Shell {
    pub(super) triangles: Vec<[u32; 3]>,
    /// `neighbours[t][k]` is the triangle across the side from corner k to corner k + 1.
    pub(super) neighbours: Vec<[u32; 3]>,
}

/// Returns a positive number if `d` lies below the plane of `abc`, negative if above, and zero if
/// on it. "Above" is the side from which `abc` is counter-clockwise. The sign is exact.
pub(super) fn orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|p| robust::Coord3D { x: p.x, y: p.y, z: p.z });
    robust::orient3d(a, b, c, d)
}

const NONE: u32 = u32::MAX;

struct Facet {
    corners: [u32; 3],
    neighbours: [u32; 3],
    /// First point of the linked list of points above this facet.
    waiting: u32,
    alive: bool,
    /// The last round in which the facet was visible from the apex.
    seen: u32,
}

struct Builder<'a> {
    points: &'a [DVec3],
    facets: Vec<Facet>,
    /// Indices of removed facets, for reuse.
    free: Vec<u32>,
    /// For each point in a list, the next point of the list.
    next: Vec<u32>,
    /// For each vertex of the current horizon, the new facet whose horizon side starts at the
    /// vertex.
    starts: Vec<u32>,
    visible: Vec<u32>,
    horizon: Vec<(u32, u32, u32)>,
    cone: Vec<u32>,
    round: u32,
}

/// Computes the hull of distinct `points`. The last corner of `tetrahedron` must lie strictly below
/// the plane of the first three.
pub(super) fn quickhull(points: &[DVec3], tetrahedron: [u32; 4]) -> Result<Shell, HullError> {
    let mut builder = Builder {
        points,
        // A hull of n points has at most 2n − 4 triangles.
        facets: Vec::with_capacity(2 * points.len()),
        free: Vec::new(),
        next: vec![NONE; points.len()],
        starts: vec![NONE; points.len()],
        visible: Vec::new(),
        horizon: Vec::new(),
        cone: Vec::new(),
        round: 0,
    };
    builder.begin(tetrahedron);
    let mut pending: Vec<u32> = (0..4).collect();
    while let Some(facet) = pending.pop() {
        if !builder.facets[facet as usize].alive || builder.facets[facet as usize].waiting == NONE {
            continue;
        }
        let apex = builder.highest(facet);
        builder.round += 1;
        builder.find_visible(facet, apex);
        builder.raise_cone(apex)?;
        builder.move_waiting(apex);
        pending.extend_from_slice(&builder.cone);
    }
    Ok(builder.finish())
}

impl Builder<'_> {
    fn begin(&mut self, [a, b, c, d]: [u32; 4]) {
        let facets = [([a, b, c], [3, 1, 2]), ([c, b, d], [0, 3, 2]), ([a, c, d], [0, 1, 3]), ([b, a, d], [0, 2, 1])];
        for (corners, neighbours) in facets {
            self.facets.push(Facet { corners, neighbours, waiting: NONE, alive: true, seen: 0 });
        }
        // Adds the points from the last to the first, because then the lists are in ascending
        // order.
        for p in (0..self.points.len() as u32).rev().filter(|p| ![a, b, c, d].contains(p)) {
            if let Some(facet) = (0..4).find(|&f| self.is_above(f, p)) {
                self.wait(facet, p);
            }
        }
    }

    fn is_above(&self, facet: u32, p: u32) -> bool {
        let [a, b, c] = self.facets[facet as usize].corners.map(|v| self.points[v as usize]);
        orientation(a, b, c, self.points[p as usize]) < 0.0
    }

    fn wait(&mut self, facet: u32, p: u32) {
        let facet = &mut self.facets[facet as usize];
        self.next[p as usize] = facet.waiting;
        facet.waiting = p;
    }

    fn highest(&self, facet: u32) -> u32 {
        let facet = &self.facets[facet as usize];
        let [a, b, c] = facet.corners.map(|v| self.points[v as usize]);
        let normal = (b - a).cross(c - a);
        let (mut best, mut height) = (facet.waiting, f64::NEG_INFINITY);
        let mut p = facet.waiting;
        while p != NONE {
            let h = normal.dot(self.points[p as usize] - a);
            if h > height {
                (best, height) = (p, h);
            }
            p = self.next[p as usize];
        }
        best
    }

    /// Collects the facets that are visible from `apex`, starting at `facet`, and the sides of
    /// their border.
    fn find_visible(&mut self, facet: u32, apex: u32) {
        self.visible.clear();
        self.horizon.clear();
        self.visible.push(facet);
        self.facets[facet as usize].seen = self.round;
        let mut done = 0;
        while done < self.visible.len() {
            let here = self.visible[done];
            done += 1;
            for k in 0..3 {
                let across = self.facets[here as usize].neighbours[k];
                if self.facets[across as usize].seen == self.round {
                    continue;
                }
                if self.is_above(across, apex) {
                    self.facets[across as usize].seen = self.round;
                    self.visible.push(across);
                } else {
                    let corners = self.facets[here as usize].corners;
                    self.horizon.push((corners[k], corners[(k + 1) % 3], across));
                }
            }
        }
    }

    /// Replaces the visible facets by one new facet from each side of the horizon to the apex.
    fn raise_cone(&mut self, apex: u32) -> Result<(), HullError> {
        for &v in &self.visible {
            self.facets[v as usize].alive = false;
        }
        self.cone.clear();
        let horizon = std::mem::take(&mut self.horizon);
        for &(tail, head, outer) in &horizon {
            let facet = Facet {
                corners: [tail, head, apex],
                neighbours: [outer, NONE, NONE],
                waiting: NONE,
                alive: true,
                seen: 0,
            };
            let place = self.free.pop().unwrap_or(self.facets.len() as u32);
            if place as usize == self.facets.len() {
                self.facets.push(facet);
            } else {
                self.facets[place as usize] = facet;
            }
            self.cone.push(place);
            let turned = &mut self.facets[outer as usize];
            // The outer facet lists this side in the opposite direction.
            let Some(k) = (0..3).find(|&k| turned.corners[k] == head && turned.corners[(k + 1) % 3] == tail) else {
                return Err(HullError::Inconsistent);
            };
            turned.neighbours[k] = place;
            if self.starts[tail as usize] != NONE {
                return Err(HullError::Inconsistent);
            }
            self.starts[tail as usize] = place;
        }
        for &(tail, head, _) in &horizon {
            let (here, after) = (self.starts[tail as usize], self.starts[head as usize]);
            if after == NONE {
                return Err(HullError::Inconsistent);
            }
            self.facets[here as usize].neighbours[1] = after;
            self.facets[after as usize].neighbours[2] = here;
        }
        for &(tail, ..) in &horizon {
            self.starts[tail as usize] = NONE;
        }
        self.horizon = horizon;
        Ok(())
    }

    /// Moves the points in the lists of the removed facets to the new facets.
    fn move_waiting(&mut self, apex: u32) {
        let cone = std::mem::take(&mut self.cone);
        for k in 0..self.visible.len() {
            let removed = self.visible[k];
            let mut p = std::mem::replace(&mut self.facets[removed as usize].waiting, NONE);
            while p != NONE {
                let after = self.next[p as usize];
                if p != apex
                    && let Some(&facet) = cone.iter().find(|&&f| self.is_above(f, p))
                {
                    self.wait(facet, p);
                }
                p = after;
            }
            self.free.push(removed);
        }
        self.cone = cone;
    }

    fn finish(self) -> Shell {
        let mut places = vec![NONE; self.facets.len()];
        let alive = || self.facets.iter().enumerate().filter(|(_, facet)| facet.alive);
        for (place, (f, _)) in alive().enumerate() {
            places[f] = place as u32;
        }
        Shell {
            triangles: alive().map(|(_, facet)| facet.corners).collect(),
            neighbours: alive().map(|(_, facet)| facet.neighbours.map(|f| places[f as usize])).collect(),
        }
    }
}
