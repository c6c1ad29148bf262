//! Finds the support vertex along a direction by climbing from vertex to vertex.

use glam::DVec3;

use super::Polytope;
use super::numbers::Numbers;

impl Polytope {
    /// Climbs from vertex `from` to the vertex farthest along `direction`. Returns this vertex and
    /// its dot product with `direction`.
    ///
    /// The climb ends at a global maximum, because the polytope is convex. The climb moves only to
    /// strictly higher vertices, so it cannot cycle. On a rough polytope ([`Self::is_rough`]), the
    /// edge to the next higher vertex may be missing. The climb then ends only if no vertex of the
    /// adjacent faces is higher.
    ///
    /// If `from` is the support vertex of a similar direction, the climb visits one or two rings.
    /// The climb is then cheaper than [`Self::support`]; otherwise it is more expensive.
    #[inline]
    pub fn climb(&self, from: u32, direction: DVec3) -> (u32, f64) {
        match &self.lists.all {
            Numbers::Narrow(all) => self.climb_among(all, from, direction),
            Numbers::Wide(all) => self.climb_among(all, from, direction),
        }
    }

    /// Does the climb with indices of type `N`.
    #[inline]
    fn climb_among<N: Copy + Into<u32>>(&self, all: &[N], from: u32, direction: DVec3) -> (u32, f64) {
        let mut best = from;
        let mut height = direction.dot(self.vertex(best));
        loop {
            let here = best;
            for neighbour in self.lists.neighbours(all, here) {
                let h = direction.dot(self.vertex(neighbour));
                if h > height {
                    height = h;
                    best = neighbour;
                }
            }
            if best == here {
                match self.over_missing_edge(here, height, direction) {
                    Some(on) => (best, height) = on,
                    None => return (best, height),
                }
            }
        }
    }

    /// Climbs like [`Self::climb`]. Also returns the largest dot product of `direction` with the
    /// neighbours of the found vertex.
    #[inline]
    pub fn climb_apart(&self, from: u32, direction: DVec3) -> (u32, f64, f64) {
        match &self.lists.all {
            Numbers::Narrow(all) => self.climb_apart_among(all, from, direction),
            Numbers::Wide(all) => self.climb_apart_among(all, from, direction),
        }
    }

    #[inline]
    fn climb_apart_among<N: Copy + Into<u32>>(&self, all: &[N], from: u32, direction: DVec3) -> (u32, f64, f64) {
        let mut best = from;
        let mut height = direction.dot(self.vertex(best));
        loop {
            let here = best;
            let mut next = f64::NEG_INFINITY;
            for neighbour in self.lists.neighbours(all, here) {
                let h = direction.dot(self.vertex(neighbour));
                if h > height {
                    height = h;
                    best = neighbour;
                } else {
                    next = next.max(h);
                }
            }
            if best == here {
                match self.over_missing_edge(here, height, direction) {
                    Some(on) => (best, height) = on,
                    None => return (best, height, next),
                }
            }
        }
    }

    /// On a rough polytope, returns the highest vertex of the faces around vertex `here` and its
    /// height. `None` if this vertex is not above `height`. No neighbour of `here` may be above
    /// `height`.
    #[inline]
    fn over_missing_edge(&self, here: u32, height: f64, direction: DVec3) -> Option<(u32, f64)> {
        if self.rough { self.highest_around(here, height, direction) } else { None }
    }

    #[inline(never)]
    fn highest_around(&self, here: u32, height: f64, direction: DVec3) -> Option<(u32, f64)> {
        let mut best = (here, height);
        for spoke in self.ring(here).iter() {
            let corners = self.face_vertices(spoke.left);
            // All vertices of a triangle are neighbours.
            if corners.len() > 3 {
                for v in corners {
                    let h = direction.dot(self.vertex(v));
                    if h > best.1 {
                        best = (v, h);
                    }
                }
            }
        }
        (best.0 != here).then_some(best)
    }
}
