//! A quick test of a facet's hubs, which usually shows that no facet at these hubs is lower.

use glam::DVec3;

use super::super::HubPair;
use super::super::cso::below;
use super::view::{View, farthest_side};
use crate::algebra::tolerance::FACET_SIDES;

/// A quick test of a facet's hubs. The normals of one body may already show that no facet at a hub
/// is lower.
///
/// A hub pair gives one vertex of the CSO. The directions along which this vertex has an offset of
/// at least `bar` form a circular cone, which is convex. If the circular cone contains the
/// normals of the faces at one body's vertex, it contains the whole normal cone of that vertex. The
/// circular cone then also contains the overlap of both normal cones.
pub(super) struct HubTest {
    pub(super) bar: f64,
    pub(super) doubt: Doubt,
}

impl HubTest {
    /// Tests the hubs of the facet of face `f` of p and vertex `w` of q.
    #[inline]
    pub(super) fn around_face(&mut self, view: &View<'_>, f: u32, w: u32) {
        let corners = view.p.face_vertices(f);
        let origin = view.q_in_p.point(view.q.vertex(w));
        let few = corners.len() <= FACET_SIDES;
        let first = if few { 0 } else { farthest_side(view.p, f, origin) };
        let hubs = if few { corners.len() } else { 2 };
        for k in first..first + hubs {
            let v = corners.at(if k < corners.len() { k } else { k - corners.len() });
            if !self.is_above(view, v, f, origin) {
                self.doubt.push(view.hub(v, w));
            }
        }
    }

    /// Returns true if no face normal at vertex `v` of p has an offset below the bar, except
    /// perhaps face `f`. The vertex of q lies at `origin` (in p's frame).
    #[inline]
    fn is_above(&self, view: &View<'_>, v: u32, f: u32, origin: DVec3) -> bool {
        let is_above = |face: u32| face == f || -view.p.plane(face).height(origin) >= self.bar;
        self.bar >= 0.0 && view.p.ring(v).iter().all(|spoke| is_above(spoke.left))
    }

    /// Tests the hubs of the facet of edge `g` of p and edge `e` of q. `mirror` is the view with p
    /// and q exchanged.
    #[inline]
    pub(super) fn around_edges(&mut self, view: &View<'_>, mirror: &View<'_>, g: u32, e: u32) {
        let (edge_p, edge_q) = (view.p.edge(g), view.q.edge(e));
        let ends = [edge_q.tail, edge_q.head].map(|w| view.q_in_p.point(view.q.vertex(w)));
        let clear_p = [edge_p.tail, edge_p.head].map(|v| self.is_clear(view, v, g, ends));
        if clear_p == [true; 2] {
            return;
        }
        let ends = [edge_p.tail, edge_p.head].map(|v| mirror.q_in_p.point(view.p.vertex(v)));
        let clear_q = [edge_q.tail, edge_q.head].map(|w| self.is_clear(mirror, w, e, ends));
        for (v, p) in [edge_p.tail, edge_p.head].into_iter().zip(clear_p) {
            for (w, q) in [edge_q.tail, edge_q.head].into_iter().zip(clear_q) {
                if !p && !q {
                    self.doubt.push(view.hub(v, w));
                }
            }
        }
    }

    /// Returns true if no normal at vertex `v` of p has an offset below the bar. Tests the hubs of
    /// `v` and the two ends of an edge of q (`tail` and `head`, in p's frame). For each normal,
    /// tests the hub with the end that supports the normal. The facet itself lies on the arc of p's
    /// edge `own`.
    #[inline]
    fn is_clear(&self, view: &View<'_>, v: u32, own: u32, [tail, head]: [DVec3; 2]) -> bool {
        let (planes, ring, bar) = (view.p.planes(), view.p.ring(v), self.bar);
        if bar < 0.0 {
            return false;
        }
        let along = head - tail;
        // Returns the offset at the tail, and the difference between the offsets at the tail and at
        // the head. If the difference is negative, the head lies lower along the normal than the
        // tail.
        let offset_and_drop = |face: u32| {
            let plane = &planes[face as usize];
            (plane.offset - plane.normal.dot(tail), plane.normal.dot(along))
        };
        let mut last_face = ring.last().left;
        let (mut last_offset, mut last_drop) = offset_and_drop(last_face);
        for spoke in ring {
            let (offset, drop) = offset_and_drop(spoke.left);
            if offset - drop.min(0.0) < bar {
                return false;
            }
            // If different ends support two successive normals, the offset between these normals is
            // least at the normal where the support changes from one end to the other.
            if offset.min(last_offset) < bar && drop * last_drop < 0.0 && spoke.edge != own {
                let (here, there) = (last_drop.abs(), drop.abs());
                let between = view.p.plane(spoke.left).normal * here + view.p.plane(last_face).normal * there;
                if below(offset * here + last_offset * there, between.length_squared(), bar) {
                    return false;
                }
            }
            (last_face, last_offset, last_drop) = (spoke.left, offset, drop);
        }
        true
    }
}

/// Hubs at which the quick test is undecided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    hubs: [HubPair; FACET_SIDES],
    pub(super) count: usize,
}

impl Doubt {
    pub(super) const NONE: Self = Self { hubs: [HubPair { a: 0, b: 0 }; FACET_SIDES], count: 0 };

    pub(super) fn hubs(&self) -> &[HubPair] {
        &self.hubs[..self.count]
    }

    /// Adds a hub, unless the list is full.
    #[inline]
    fn push(&mut self, hub: HubPair) {
        if self.count < FACET_SIDES {
            self.hubs[self.count] = hub;
            self.count += 1;
        }
    }
}
