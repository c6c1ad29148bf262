//! The walk downhill from facet to neighbouring facet of the CSO, along coherent motion \[K02
//! §3.3.3\].
//!
//! The answer's facet is nearly always last tick's facet or one of its neighbours. The last facet
//! is set up at the new pose, and the facets across its sides are tested. Each is found by turning
//! the supporting plane about the side until the plane meets the next vertex. On the Gauss map, the
//! plane's normal runs along the arc of an edge of one body, from the facet's corner to the next
//! corner of the overlay, which is the far end of the arc or the first arc of the other body that
//! it crosses.
//!
//! 1. Set the facet up. For a face, climb to the vertex that supports it. For two edges, test
//!    whether they still cross; if not, take the lowest face beside them.
//! 2. Unless a proof follows, make a quick test of the normals around the facet. Mostly the normals
//!    of one body show that all facets which share a side or a corner with this one are higher.
//!    Then the walk ends.
//! 3. Otherwise test the facet across each side (for a face of many sides, only across the side
//!    beyond which the origin lies). Move to the lowest of these facets if it is lower than the
//!    current one, and repeat.
//! 4. If none is lower, no facet that shares a side is nearer. Repeat the quick test, and compute
//!    the overlay at the hubs at which it is undecided. Walk on from a lower facet there.
//! 5. The offset is measured with true supports.
//!
//! Flush features (a box on a table) make facets of many corners, for which turning about the sides
//! does not work. Such a facet is a local minimum if the origin's projection lies within it, which
//! its sides tell. Where they tell otherwise, and at any inconsistency, the walk gives no answer;
//! then the certificate finds the depth from nothing.
//!
//! Deviation from \[K02\], whose walk computes the overlay at every hub of every facet.

mod glance;
mod spokes;
mod view;

use glam::DVec3;

use super::antipodal::{Corner, Facet};
use super::cso::Cso;
use super::gauss_map::GaussMaps;
use super::overlay::lowest_corner;
use super::{Antipodal, HubPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::{
    FACET_SIDES, FLUSH_FACET, FLUSH_WITNESS, OFFSET_SLACK, PARALLEL_EDGES, STRAY, WALK_DECREASE, WALK_STEPS,
};
use crate::collision::StopReason;
use glance::{Doubt, Glance};
use spokes::{Lowest, Met, Spokes};
use view::{View, farthest_side};

/// End of a walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walked {
    pub(super) corner: Corner,
    /// True if it is known that only the antipodal features lie in the facet's plane.
    pub(super) alone: bool,
    pub(super) steps: u32,
    pub(super) stop: StopReason,
}

/// Working memory of the tests around corners; its content is not used across calls.
#[derive(Clone, Debug)]
pub(super) struct Overlays {
    maps_a: GaussMaps,
    maps_b: GaussMaps,
}

impl Overlays {
    pub(super) fn new() -> Self {
        Self { maps_a: GaussMaps::new(), maps_b: GaussMaps::new() }
    }

    /// Forgets the bodies and their pose.
    fn clear(&mut self) {
        self.maps_a.clear();
        self.maps_b.clear();
    }

    /// The least facet about one of the hubs below `bar`, if there is one.
    fn lower(&mut self, cso: &Cso<'_>, doubt: &Doubt, bar: f64) -> Option<Corner> {
        doubt.hubs().iter().find_map(|&hub| lowest_corner(cso, &mut self.maps_a, &mut self.maps_b, hub, bar))
    }
}

/// Walks downhill from the facet of `antipodal`. `None` if flush features or rounding prevent an
/// answer. Without `overlays`, facets that share only a corner with the last one are not tested.
#[inline]
pub(super) fn walk(cso: &Cso<'_>, antipodal: Antipodal, overlays: Option<&mut Overlays>) -> Option<Walked> {
    let pose_ab = cso.pose_ba.inverse();
    let downhill = Downhill { cso, pose_ab: &pose_ab, decrease: WALK_DECREASE * cso.size() };
    let here = downhill.set_up(antipodal)?;
    let Some(overlays) = overlays else { return downhill.descend(here) };
    // Along coherent motion the first facet is mostly also the last.
    let mut doubt = downhill.glance(&here.corner);
    if doubt.count == 0 {
        return downhill.end(&here, 0);
    }
    overlays.clear();
    let mut walked = downhill.descend(here)?;
    for _ in 0..WALK_STEPS {
        if walked.steps > 0 {
            doubt = downhill.glance(&walked.corner);
        }
        let Some(corner) = overlays.lower(cso, &doubt, walked.corner.offset - downhill.decrease) else {
            return Some(walked);
        };
        let next = downhill.descend(Here { corner, supported: false, alone: false })?;
        walked = Walked { steps: walked.steps + 1 + next.steps, ..next };
    }
    None
}

/// The facet of `antipodal` at this pose, if it is known that none is lower. `None` as in
/// [`walk`].
pub(super) fn settle(cso: &Cso<'_>, antipodal: Antipodal) -> Option<Walked> {
    let pose_ab = cso.pose_ba.inverse();
    let downhill = Downhill { cso, pose_ab: &pose_ab, decrease: WALK_DECREASE * cso.size() };
    downhill.end(&downhill.set_up(antipodal)?, 0)
}

/// A facet, with the values that its construction gave.
struct Here {
    corner: Corner,
    /// Its features support its normal, as far as their planes support their bodies.
    supported: bool,
    /// Nothing else is flush with it.
    alone: bool,
}

/// The corner with its true offset. Merged faces are flat only within a tolerance, so one corner
/// does not give the offset of the whole face.
fn measured(cso: &Cso<'_>, corner: &Corner) -> Corner {
    let hub = HubPair {
        a: cso.a.climb(corner.hub.a, cso.toward_b(corner.normal)).0,
        b: cso.b.climb(corner.hub.b, corner.normal).0,
    };
    Corner { hub, offset: corner.normal.dot(cso.vertex(hub)), ..*corner }
}

/// Features are flush, or rounding contradicts itself.
struct Odd;

struct Downhill<'d, 'p> {
    cso: &'d Cso<'p>,
    pose_ab: &'d Placement,
    decrease: f64,
}

impl Downhill<'_, '_> {
    /// The faces of b and the vertices of a.
    #[inline]
    fn on_b(&self) -> View<'_> {
        let Cso { a, b, pose_ba } = *self.cso;
        View { p: b, q: a, q_in_p: pose_ba, p_in_q: self.pose_ab, p_is_a: false }
    }

    /// The faces of a and the vertices of b.
    #[inline]
    fn on_a(&self) -> View<'_> {
        let Cso { a, b, pose_ba } = *self.cso;
        View { p: a, q: b, q_in_p: self.pose_ab, p_in_q: pose_ba, p_is_a: true }
    }

    /// The result of a walk that ends at a facet, measured if its offset may not be the true one.
    /// None if the facet turns out not to support its normal.
    #[inline]
    fn end(&self, here: &Here, steps: u32) -> Option<Walked> {
        let Cso { a, b, .. } = *self.cso;
        let crisp = here.supported && !(a.is_rough() || b.is_rough());
        let corner = if crisp { here.corner } else { measured(self.cso, &here.corner) };
        let is_true = corner.offset - here.corner.offset <= OFFSET_SLACK * self.cso.size();
        is_true.then_some(Walked { corner, alone: here.alone, steps, stop: StopReason::Converged })
    }

    /// Goes from facet to lower neighbour until none is lower.
    fn descend(&self, mut here: Here) -> Option<Walked> {
        for steps in 0..WALK_STEPS {
            match self.lower_neighbour(&here.corner) {
                Ok(Some(corner)) => here = Here { corner, supported: false, alone: false },
                Ok(None) => return self.end(&here, steps),
                Err(Odd) => return self.is_lowest(&here.corner).then(|| self.end(&here, steps)).flatten(),
            }
        }
        None
    }

    /// A facet at this pose, from one of an earlier pose.
    #[inline]
    fn set_up(&self, antipodal: Antipodal) -> Option<Here> {
        let Cso { a, b, .. } = *self.cso;
        let (vertices_a, vertices_b) = (a.vertices().len() as u32, b.vertices().len() as u32);
        match antipodal {
            Antipodal::VertexFace { a: v, b: f } if v < vertices_a && (f as usize) < b.face_count() => {
                Some(self.on_face(&self.on_b(), f, v))
            }
            Antipodal::FaceVertex { a: f, b: w } if w < vertices_b && (f as usize) < a.face_count() => {
                Some(self.on_face(&self.on_a(), f, w))
            }
            Antipodal::EdgeEdge { a: e, b: g } if (e as usize) < a.edge_count() && (g as usize) < b.edge_count() => {
                self.on_edges(e, g)
            }
            _ => None,
        }
    }

    /// The facet of face `f` of p and the vertex of q that supports it. The climb to that vertex
    /// starts at `w`.
    fn on_face(&self, view: &View<'_>, f: u32, w: u32) -> Here {
        let normal = view.p.plane(f).normal;
        let (w, height, next) = view.q.climb_apart(w, view.facing(normal));
        let v = view.p.face_vertices(f).at(0);
        let offset = normal.dot(view.vertex(v, w));
        let normal = if view.p_is_a { view.facing(normal) } else { normal };
        // No edge is longer than twice the radius. The bound is doubled for rounding.
        let alone = height - next > 4.0 * FLUSH_WITNESS * view.q.radius();
        let corner = Corner { normal, offset, antipodal: view.face(f, w), hub: view.hub(v, w) };
        Here { corner, supported: true, alone }
    }

    /// The facet of two edges if they cross on the Gauss map, else that of the lowest face beside
    /// them.
    fn on_edges(&self, e: u32, g: u32) -> Option<Here> {
        let Cso { a, b, pose_ba } = *self.cso;
        let (edge_a, edge_b) = (a.edge(e), b.edge(g));
        let along_a = pose_ba.vector(a.vertex(edge_a.head) - a.vertex(edge_a.tail));
        let along_b = b.vertex(edge_b.head) - b.vertex(edge_b.tail);
        let hub = HubPair { a: edge_a.tail, b: edge_b.tail };
        let c = self.cso.vertex(hub);
        let normals_a = [edge_a.left, edge_a.right].map(|f| -pose_ba.vector(a.plane(f).normal));
        let normals_b = [edge_b.left, edge_b.right].map(|f| b.plane(f).normal);
        let [x, y] = normals_b.map(|n| -n.dot(along_a));
        let [z, w] = normals_a.map(|n| n.dot(along_b));
        let up = x > 0.0 && y < 0.0 && z > 0.0 && w < 0.0;
        let down = x < 0.0 && y > 0.0 && z < 0.0 && w > 0.0;
        if up || down {
            let across = if up { along_a.cross(along_b) } else { along_b.cross(along_a) };
            let normal = edge_normal(along_a, along_b, across)?;
            let antipodal = Antipodal::EdgeEdge { a: e, b: g };
            let corner = Corner { normal, offset: normal.dot(c), antipodal, hub };
            // The dot product of unit vectors at an angle is one minus half the angle's square. The
            // angle is doubled for rounding.
            let flush = 1.0 - 2.0 * FLUSH_WITNESS * FLUSH_WITNESS;
            let alone = normals_a.iter().chain(&normals_b).all(|n| n.dot(normal) < flush);
            return Some(Here { corner, supported: true, alone });
        }
        let scores = [normals_b[0], normals_b[1], normals_a[0], normals_a[1]].map(|n| n.dot(c));
        let least = (1..4).fold(0, |least, k| if scores[k] < scores[least] { k } else { least });
        Some(match least {
            0 => self.on_face(&self.on_b(), edge_b.left, hub.a),
            1 => self.on_face(&self.on_b(), edge_b.right, hub.a),
            2 => self.on_face(&self.on_a(), edge_a.left, hub.b),
            _ => self.on_face(&self.on_a(), edge_a.right, hub.b),
        })
    }

    /// The lowest facet across a side of the present one, if it is lower.
    fn lower_neighbour(&self, here: &Corner) -> Result<Option<Corner>, Odd> {
        let mut lowest = Lowest { bar: here.offset - self.decrease, met: None };
        match here.antipodal {
            Antipodal::VertexFace { a: v, b: f } => self.around_face(&self.on_b(), f, v, &mut lowest)?,
            Antipodal::FaceVertex { a: f, b: w } => self.around_face(&self.on_a(), f, w, &mut lowest)?,
            Antipodal::EdgeEdge { a: e, b: g } => {
                self.around_edges(&self.on_b(), g, e, here.normal, &mut lowest)?;
                let outward_a = -self.cso.pose_ba.inverse_vector(here.normal);
                self.around_edges(&self.on_a(), e, g, outward_a, &mut lowest)?;
            }
        }
        lowest.met.map(|met| self.corner(&met)).transpose()
    }

    /// The sides of face `f` of p, about which the plane turns with vertex `w` of q.
    #[inline]
    fn around_face(&self, view: &View<'_>, f: u32, w: u32, lowest: &mut Lowest) -> Result<(), Odd> {
        let normal = view.p.plane(f).normal;
        let (corners, edges) = (view.p.face_vertices(f), view.p.face_edges(f));
        let origin = view.q_in_p.point(view.q.vertex(w));
        let sides = if corners.len() > FACET_SIDES {
            let k = farthest_side(view.p, f, origin);
            k..k + 1
        } else {
            0..corners.len()
        };
        let mut spokes: Option<Spokes> = None;
        for k in sides {
            let edge = view.p.edge(edges.at(k));
            let across = if edge.left == f { edge.right } else { edge.left };
            let end = view.p.plane(across).normal;
            // The offset is concave along the arc: if its far end is no lower, no part of it is.
            if end.dot(view.p.vertex(corners.at(k)) - origin) >= lowest.bar {
                continue;
            }
            let spokes = match &mut spokes {
                Some(spokes) => spokes,
                none => none.insert(Spokes::of(view, w, normal, None)?),
            };
            spokes.turn(view, edges.at(k), across, corners.at(k), lowest);
        }
        Ok(())
    }

    /// Both ways from an edge pair along the arc of edge `g` of p: about the two ends of edge
    /// `e` of q.
    #[inline]
    fn around_edges(&self, view: &View<'_>, g: u32, e: u32, normal: DVec3, lowest: &mut Lowest) -> Result<(), Odd> {
        let (edge_p, edge_q) = (view.p.edge(g), view.q.edge(e));
        let along = view.q.vertex(edge_q.head) - view.q.vertex(edge_q.tail);
        // Turns toward the face that the tail faces more than the head does.
        let tail_first = view.facing(view.p.plane(edge_p.left).normal).dot(along) < 0.0;
        let ends = if tail_first { [edge_q.tail, edge_q.head] } else { [edge_q.head, edge_q.tail] };
        for (end, face) in ends.into_iter().zip([edge_p.left, edge_p.right]) {
            if view.p.plane(face).normal.dot(view.vertex(edge_p.tail, end)) < lowest.bar {
                Spokes::of(view, end, normal, Some(e))?.turn(view, g, face, edge_p.tail, lowest);
            }
        }
        Ok(())
    }

    /// True if the origin's projection lies within the facet, flush features included: then h has a
    /// local minimum.
    fn is_lowest(&self, here: &Corner) -> bool {
        let stray = STRAY * self.cso.size();
        Facet::at(self.cso, here, FLUSH_FACET).beyond(self.cso) <= stray * stray
    }

    /// The hubs of the facet at which there may be a lower facet.
    #[inline]
    fn glance(&self, here: &Corner) -> Doubt {
        let mut glance = Glance { bar: here.offset - self.decrease, doubt: Doubt::NONE };
        match here.antipodal {
            Antipodal::VertexFace { a: v, b: f } => glance.around_face(&self.on_b(), f, v),
            Antipodal::FaceVertex { a: f, b: w } => glance.around_face(&self.on_a(), f, w),
            Antipodal::EdgeEdge { a: e, b: g } => glance.around_edges(&self.on_b(), &self.on_a(), g, e),
        }
        glance.doubt
    }

    /// The exact facet at which the plane stopped.
    fn corner(&self, met: &Met) -> Result<Corner, Odd> {
        let Cso { a, b, pose_ba } = *self.cso;
        let Met { antipodal, hub, normal } = *met;
        let normal = match antipodal {
            Antipodal::EdgeEdge { a: e, b: g } => {
                let (e, g) = (a.edge(e), b.edge(g));
                let along_a = pose_ba.vector(a.vertex(e.head) - a.vertex(e.tail));
                let along_b = b.vertex(g.head) - b.vertex(g.tail);
                let across = along_a.cross(along_b);
                let across = if across.dot(normal) < 0.0 { -across } else { across };
                edge_normal(along_a, along_b, across).ok_or(Odd)?
            }
            _ => normal,
        };
        Ok(Corner { normal, offset: normal.dot(self.cso.vertex(hub)), antipodal, hub })
    }
}

/// The unit normal of two edges from their cross product. None if they are parallel.
#[inline]
fn edge_normal(along_a: DVec3, along_b: DVec3, across: DVec3) -> Option<DVec3> {
    let (length_a, length_b) = (along_a.length_squared(), along_b.length_squared());
    if across.length_squared() <= PARALLEL_EDGES * PARALLEL_EDGES * length_a * length_b {
        return None;
    }
    // The cross product of nearly parallel edges has a rounding error along the edges. With that
    // part removed, the plane supports both.
    let normal = across - along_a * (across.dot(along_a) / length_a);
    Some(normal / normal.length())
}
