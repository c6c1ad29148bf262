//! Walks downhill from a facet of the CSO to a neighbouring facet, along coherent motion \[K02
//! §3.3.3\].
//!
//! The facet of the answer is nearly always the facet of the previous tick or a neighbour of that
//! facet. So no global search is needed. The walk computes the previous facet at the new pose, and
//! tests the facets across its sides. To find the facet across a side, the supporting plane turns
//! about the side until it meets the next vertex. On the Gauss map, the plane's normal then moves
//! along the arc of an edge of one body. The normal starts at the facet's corner and stops at the
//! next corner of the overlay. The next corner is the far end of the arc, or the first crossing
//! with an arc of the other body.
//!
//! 1. Compute the facet at the new pose. For a face, climb to the vertex that supports its normal.
//!    For two edges, test whether their arcs still cross; if not, take the lowest face beside the
//!    edges.
//! 2. Unless a proof follows, make a quick test of the normals around the facet. In most cases, the
//!    normals of one body show that all facets that share a side or a corner with this facet are
//!    higher. Then the walk ends.
//! 3. Otherwise test the facet across each side. For a face of many sides, test only the side
//!    beyond which the origin lies. Move to the lowest of these facets if it is lower than the
//!    current facet, and repeat.
//! 4. If no facet is lower, repeat the quick test, and compute the overlay at the hubs at which the
//!    test is undecided. If an overlay has a lower facet, continue from this facet.
//! 5. Measure the offset with true supports.
//!
//! Flush features (a box on a table) give facets of many corners, and turning about the sides of
//! these facets does not work. A facet of flush features is a local minimum if the origin's
//! projection lies within it. If the projection lies outside, or if rounding gives a contradiction,
//! the walk returns `None`. The certificate then finds the depth without a start.
//!
//! Deviation from \[K02\]: the walk of the paper computes the overlay at every hub of every facet.

mod hub_test;
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
use hub_test::{Doubt, HubTest};
use spokes::{Lowest, Spokes, StopFacet};
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

/// Working memory of the tests around corners. A call does not use the content from earlier calls.
#[derive(Clone, Debug)]
pub(super) struct Overlays {
    maps_a: GaussMaps,
    maps_b: GaussMaps,
}

impl Overlays {
    pub(super) fn new() -> Self {
        Self { maps_a: GaussMaps::new(), maps_b: GaussMaps::new() }
    }

    /// Clears all data of the previous query's bodies and pose.
    fn clear(&mut self) {
        self.maps_a.clear();
        self.maps_b.clear();
    }

    /// Returns the lowest facet at a hub, if it is below `bar`.
    fn lower(&mut self, cso: &Cso<'_>, hub: HubPair, bar: f64) -> Option<Corner> {
        lowest_corner(cso, &mut self.maps_a, &mut self.maps_b, hub, bar)
    }
}

/// Walks downhill from the facet of `antipodal`. `None` if flush features or rounding prevent an
/// answer. Without `overlays`, facets that share only a corner with the last facet are not tested.
#[inline]
pub(super) fn walk(cso: &Cso<'_>, antipodal: Antipodal, overlays: Option<&mut Overlays>) -> Option<Walked> {
    let pose_ab = cso.pose_ba.inverse();
    let downhill = Downhill { cso, pose_ab: &pose_ab, decrease: WALK_DECREASE * cso.size() };
    let here = downhill.set_up(antipodal)?;
    let Some(overlays) = overlays else { return downhill.descend(here) };
    // In coherent motion, the first facet is usually also the last facet.
    let mut doubt = downhill.test_hubs(&here.corner);
    if doubt.count == 0 {
        return downhill.end(&here, 0);
    }
    overlays.clear();
    let mut walked = downhill.descend(here)?;
    if walked.steps > 0 {
        doubt = downhill.test_hubs(&walked.corner);
    }
    for _ in 0..WALK_STEPS {
        let bar = walked.corner.offset - downhill.decrease;
        match downhill.leave(overlays, &doubt, bar)? {
            OverlayResult::Lower(next) => walked = Walked { steps: walked.steps + 1 + next.steps, ..next },
            OverlayResult::Nowhere => return Some(walked),
        }
        doubt = downhill.test_hubs(&walked.corner);
    }
    None
}

/// Returns the facet of `antipodal` at this pose, without a walk. The caller knows that no facet is
/// lower. `None` for the same reasons as in [`walk`].
pub(super) fn settle(cso: &Cso<'_>, antipodal: Antipodal) -> Option<Walked> {
    let pose_ab = cso.pose_ba.inverse();
    let downhill = Downhill { cso, pose_ab: &pose_ab, decrease: WALK_DECREASE * cso.size() };
    downhill.end(&downhill.set_up(antipodal)?, 0)
}

/// A facet and the data known from its construction.
struct KnownFacet {
    corner: Corner,
    /// True if the features support the normal, within the accuracy of their face planes.
    supported: bool,
    /// True if no other feature is flush with the facet.
    alone: bool,
}

/// Returns the corner with its true offset. Merged faces are flat only within a tolerance, so a
/// single vertex of a face does not determine the face's offset.
fn measured(cso: &Cso<'_>, corner: &Corner) -> Corner {
    let hub = HubPair {
        a: cso.a.climb(corner.hub.a, cso.toward_b(corner.normal)).0,
        b: cso.b.climb(corner.hub.b, corner.normal).0,
    };
    Corner { hub, offset: corner.normal.dot(cso.vertex(hub)), ..*corner }
}

/// Result of the overlays around a facet.
enum OverlayResult {
    /// The end of a walk from a lower facet.
    Lower(Walked),
    /// No facet is lower.
    Nowhere,
}

/// Error: features are flush, or rounding makes the results inconsistent.
struct InconsistentFeatures;

struct Downhill<'d, 'p> {
    cso: &'d Cso<'p>,
    pose_ab: &'d Placement,
    decrease: f64,
}

impl Downhill<'_, '_> {
    /// Returns the view for the facets of b's faces and a's vertices.
    #[inline]
    fn on_b(&self) -> View<'_> {
        let Cso { a, b, pose_ba } = *self.cso;
        View { p: b, q: a, q_in_p: pose_ba, p_in_q: self.pose_ab, p_is_a: false }
    }

    /// Returns the view for the facets of a's faces and b's vertices.
    #[inline]
    fn on_a(&self) -> View<'_> {
        let Cso { a, b, pose_ba } = *self.cso;
        View { p: a, q: b, q_in_p: self.pose_ab, p_in_q: pose_ba, p_is_a: true }
    }

    /// Returns the result of a walk that ends at this facet. If the offset may differ from the true
    /// offset, computes it again with true supports. `None` if the facet does not support its
    /// normal.
    #[inline]
    fn end(&self, here: &KnownFacet, steps: u32) -> Option<Walked> {
        let Cso { a, b, .. } = *self.cso;
        let crisp = here.supported && !(a.is_rough() || b.is_rough());
        let corner = if crisp { here.corner } else { measured(self.cso, &here.corner) };
        let is_true = corner.offset - here.corner.offset <= OFFSET_SLACK * self.cso.size();
        is_true.then_some(Walked { corner, alone: here.alone, steps, stop: StopReason::Converged })
    }

    /// Moves from a facet to its lowest neighbour, again and again, until no neighbour is lower.
    fn descend(&self, mut here: KnownFacet) -> Option<Walked> {
        for steps in 0..WALK_STEPS {
            match self.lower_neighbour(&here.corner) {
                Ok(Some(corner)) => here = KnownFacet { corner, supported: false, alone: false },
                Ok(None) => return self.end(&here, steps),
                Err(InconsistentFeatures) => {
                    return self.is_lowest(&here.corner).then(|| self.end(&here, steps)).flatten();
                }
            }
        }
        None
    }

    /// Walks on from the first hub of `doubt` that leads below `bar`. `None` if a walk from there
    /// gives no answer.
    ///
    /// Merged faces are flat only within a tolerance. So the end of a walk, which is measured, may
    /// be higher than the facet at which the walk started. Then it does not count, or the walk
    /// would return to it again and again.
    fn leave(&self, overlays: &mut Overlays, doubt: &Doubt, bar: f64) -> Option<OverlayResult> {
        for &hub in doubt.hubs() {
            if let Some(corner) = overlays.lower(self.cso, hub, bar) {
                let next = self.descend(KnownFacet { corner, supported: false, alone: false })?;
                if next.corner.offset < bar {
                    return Some(OverlayResult::Lower(next));
                }
            }
        }
        Some(OverlayResult::Nowhere)
    }

    /// Returns the facet of `antipodal` at this pose. The features come from an earlier pose.
    #[inline]
    fn set_up(&self, antipodal: Antipodal) -> Option<KnownFacet> {
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

    /// Returns the facet of face `f` of p and the vertex of q that supports the face's normal. The
    /// climb to this vertex starts at `w`.
    fn on_face(&self, view: &View<'_>, f: u32, w: u32) -> KnownFacet {
        let normal = view.p.plane(f).normal;
        let (w, height, next) = view.q.climb_apart(w, view.facing(normal));
        let v = view.p.face_vertices(f).at(0);
        let offset = normal.dot(view.vertex(v, w));
        let normal = if view.p_is_a { view.facing(normal) } else { normal };
        // No edge is longer than twice the radius. The bound is doubled for rounding.
        let alone = height - next > 4.0 * FLUSH_WITNESS * view.q.radius();
        let corner = Corner { normal, offset, antipodal: view.face(f, w), hub: view.hub(v, w) };
        KnownFacet { corner, supported: true, alone }
    }

    /// Returns the facet of two edges if they cross on the Gauss map. Otherwise returns the
    /// facet of the lowest face beside them. `None` if the edges are parallel.
    fn on_edges(&self, e: u32, g: u32) -> Option<KnownFacet> {
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
            // For unit vectors at a small angle, the dot product is one minus half of the square of
            // the angle. The angle is doubled for rounding.
            let flush = 1.0 - 2.0 * FLUSH_WITNESS * FLUSH_WITNESS;
            let alone = normals_a.iter().chain(&normals_b).all(|n| n.dot(normal) < flush);
            return Some(KnownFacet { corner, supported: true, alone });
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

    /// Returns the lowest facet across a side of the current facet. `None` if no facet is lower.
    fn lower_neighbour(&self, here: &Corner) -> Result<Option<Corner>, InconsistentFeatures> {
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

    /// Tests the facets across the sides of face `f` of p. The plane turns about each side while
    /// vertex `w` of q supports it.
    #[inline]
    fn around_face(&self, view: &View<'_>, f: u32, w: u32, lowest: &mut Lowest) -> Result<(), InconsistentFeatures> {
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
            // The offset is concave along the arc. If the far end is not lower, no point of the arc
            // is lower.
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

    /// Tests both directions from an edge pair along the arc of edge `g` of p. In each direction,
    /// one end of edge `e` of q supports the plane.
    #[inline]
    fn around_edges(
        &self,
        view: &View<'_>,
        g: u32,
        e: u32,
        normal: DVec3,
        lowest: &mut Lowest,
    ) -> Result<(), InconsistentFeatures> {
        let (edge_p, edge_q) = (view.p.edge(g), view.q.edge(e));
        let along = view.q.vertex(edge_q.head) - view.q.vertex(edge_q.tail);
        // True if the tail of `e` supports the plane toward the left face of `g`; then the head
        // supports it toward the right face. If false, the two ends are exchanged.
        let tail_first = view.facing(view.p.plane(edge_p.left).normal).dot(along) < 0.0;
        let ends = if tail_first { [edge_q.tail, edge_q.head] } else { [edge_q.head, edge_q.tail] };
        for (end, face) in ends.into_iter().zip([edge_p.left, edge_p.right]) {
            if view.p.plane(face).normal.dot(view.vertex(edge_p.tail, end)) < lowest.bar {
                Spokes::of(view, end, normal, Some(e))?.turn(view, g, face, edge_p.tail, lowest);
            }
        }
        Ok(())
    }

    /// Returns true if the origin's projection lies within the facet, including flush features. The
    /// facet is then a local minimum of h.
    fn is_lowest(&self, here: &Corner) -> bool {
        let stray = STRAY * self.cso.size();
        Facet::at(self.cso, here, FLUSH_FACET).beyond(self.cso) <= stray * stray
    }

    /// Returns the hubs of the facet at which a lower facet may exist.
    #[inline]
    fn test_hubs(&self, here: &Corner) -> Doubt {
        let mut test = HubTest { bar: here.offset - self.decrease, doubt: Doubt::NONE };
        match here.antipodal {
            Antipodal::VertexFace { a: v, b: f } => test.around_face(&self.on_b(), f, v),
            Antipodal::FaceVertex { a: f, b: w } => test.around_face(&self.on_a(), f, w),
            Antipodal::EdgeEdge { a: e, b: g } => test.around_edges(&self.on_b(), &self.on_a(), g, e),
        }
        test.doubt
    }

    /// Returns the exact facet at which the turning plane stopped.
    fn corner(&self, met: &StopFacet) -> Result<Corner, InconsistentFeatures> {
        let Cso { a, b, pose_ba } = *self.cso;
        let StopFacet { antipodal, hub, normal } = *met;
        let normal = match antipodal {
            Antipodal::EdgeEdge { a: e, b: g } => {
                let (e, g) = (a.edge(e), b.edge(g));
                let along_a = pose_ba.vector(a.vertex(e.head) - a.vertex(e.tail));
                let along_b = b.vertex(g.head) - b.vertex(g.tail);
                let across = along_a.cross(along_b);
                let across = if across.dot(normal) < 0.0 { -across } else { across };
                edge_normal(along_a, along_b, across).ok_or(InconsistentFeatures)?
            }
            _ => normal,
        };
        Ok(Corner { normal, offset: normal.dot(self.cso.vertex(hub)), antipodal, hub })
    }
}

/// Returns the unit normal of two edges, given their cross product. `None` if the edges are
/// parallel.
#[inline]
fn edge_normal(along_a: DVec3, along_b: DVec3, across: DVec3) -> Option<DVec3> {
    let (length_a, length_b) = (along_a.length_squared(), along_b.length_squared());
    if across.length_squared() <= PARALLEL_EDGES * PARALLEL_EDGES * length_a * length_b {
        return None;
    }
    // The cross product of nearly parallel edges has a rounding error along the edges. After
    // removing that part, the plane supports both edges.
    let normal = across - along_a * (across.dot(along_a) / length_a);
    Some(normal / normal.length())
}
