//! Turns a supporting plane about a side of its facet until it meets a spoke of the other
//! polytope's vertex. A spoke is an edge at a vertex.

use glam::DVec3;

use super::super::cso::below;
use super::super::{Antipodal, HubPair};
use super::InconsistentFeatures;
use super::view::View;
use crate::algebra::tolerance::FLUSH_FACET;
use crate::body::Polytope;

/// The facet at which the turning plane stopped.
#[derive(Clone, Copy)]
pub(super) struct StopFacet {
    pub(super) antipodal: Antipodal,
    pub(super) hub: HubPair,
    /// Normal of the plane, from body b into body a, in b's frame; not a unit vector. For an edge
    /// pair, the normal is exact only within rounding.
    pub(super) normal: DVec3,
}

/// The lowest facet below the bar that was found so far.
pub(super) struct Lowest {
    pub(super) bar: f64,
    pub(super) met: Option<StopFacet>,
}

/// The spokes of a vertex of q. All of them lie below the supporting plane, except the spoke
/// `within`.
pub(super) struct Spokes {
    vertex: u32,
    normal: DVec3,
    /// The spoke that lies in the plane because its edge belongs to the facet, numbered by
    /// [`side_of`].
    within: u32,
}

impl Spokes {
    /// Returns the spokes of vertex `w` relative to the plane with p's `normal`. The edge `within`
    /// lies in that plane. Fails with `InconsistentFeatures` if the vertex does not support the
    /// plane, or if another spoke is flush with it.
    #[inline]
    pub(super) fn of(
        view: &View<'_>,
        w: u32,
        normal: DVec3,
        within: Option<u32>,
    ) -> Result<Self, InconsistentFeatures> {
        let within = within.map_or(u32::MAX, |edge| side_of(view.q, edge));
        let (facing, at) = (view.facing(normal), view.q.vertex(w));
        for spoke in view.q.ring(w) {
            let along = view.q.vertex(spoke.neighbour) - at;
            let height = facing.dot(along);
            let clear = height < 0.0 && height * height > FLUSH_FACET * FLUSH_FACET * along.length_squared();
            if !clear && side_of(view.q, spoke.edge) != within {
                return Err(InconsistentFeatures);
            }
        }
        Ok(Self { vertex: w, normal, within })
    }

    /// Turns the plane about edge `edge` of p toward face `face` of p, until it meets a spoke.
    /// `corner` is an end of `edge`.
    #[inline]
    pub(super) fn turn(&self, view: &View<'_>, edge: u32, face: u32, corner: u32, lowest: &mut Lowest) {
        let end = view.p.plane(face).normal;
        let (from, to, at) = (view.facing(self.normal), view.facing(end), view.q.vertex(self.vertex));
        // The plane meets each spoke after a fraction of the turn, when the spoke's height above
        // the plane is zero. The first spoke is the one with the smallest fraction.
        let mut first: Option<u32> = None;
        let (mut below_by, mut rises_by) = (1.0, 0.0);
        for spoke in view.q.ring(self.vertex) {
            let along = view.q.vertex(spoke.neighbour) - at;
            let rise = to.dot(along);
            if rise > 0.0 && side_of(view.q, spoke.edge) != self.within {
                let depth = -from.dot(along);
                if rise * below_by > rises_by * depth {
                    (below_by, rises_by) = (depth, rise);
                    first = Some(spoke.edge);
                }
            }
        }
        let c = view.vertex(corner, self.vertex);
        let (normal, antipodal) = match first {
            None => (end, view.face(face, self.vertex)),
            Some(other) => {
                let normal = self.normal * rises_by + end * below_by;
                (normal, view.edges(edge, edge_toward(view.q, other, view.facing(normal))))
            }
        };
        let (along, square) = (normal.dot(c), normal.length_squared());
        if below(along, square, lowest.bar) {
            lowest.bar = along / square.sqrt();
            let normal = if view.p_is_a { view.facing(normal) } else { normal };
            lowest.met = Some(StopFacet { antipodal, hub: view.hub(corner, self.vertex), normal });
        }
    }
}

/// Returns `edge`. On a plate, which has a front and a back edge along each side, returns the front
/// edge of the side.
#[inline]
fn side_of(polytope: &Polytope, edge: u32) -> u32 {
    if polytope.is_flat() { edge % (polytope.edge_count() as u32 / 2) } else { edge }
}

/// Returns `edge`. On a plate, returns the front or the back edge along the side, whichever
/// supports `direction`.
#[inline]
fn edge_toward(polytope: &Polytope, edge: u32, direction: DVec3) -> u32 {
    if !polytope.is_flat() {
        return edge;
    }
    let front = polytope.plane(0).normal.dot(direction) >= 0.0;
    side_of(polytope, edge) + if front { 0 } else { polytope.edge_count() as u32 / 2 }
}
