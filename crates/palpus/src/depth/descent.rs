//! From facet to neighbouring facet of the CSO, downhill: the coherent half of the walk \[K02 §3.3.3\].
//!
//! Last tick's facet is nearly always this tick's, or a neighbour of it. So nothing is searched: the facet is set up at
//! the new pose, and the facets across its sides are looked at, each found by turning the supporting plane about that side
//! until it meets the next vertex. On the Gauss map, the plane's normal runs along the arc of an edge of one body, from the
//! facet's corner to the next corner of the overlay, which is the far end of the arc or the first arc of the other body
//! that it crosses.
//!
//! 1. Set the facet up: climb to the vertex that supports its face; or see whether its two edges still cross, and if
//!    not, take the best face beside them.
//! 2. Unless a proof follows, glance, at first and at last, at the normals around it: mostly those of one body tell that all facets which share as much
//!    as a corner with this one are higher. Then this is the end.
//! 3. Otherwise look across each side (of a face of many sides, across the one beyond which the origin lies); move to
//!    the lowest facet that is lower than the present one, and look again.
//! 4. With none there, no facet is nearer that shares a side. The hubs at which the glance could not tell are for the walk over
//!    hubs to look at.
//! 5. The offset is measured with true supports.
//!
//! Flush features (a box on a table) make facets of many corners, and turning about their sides leads nowhere. As soon as
//! one is met, and whenever anything else is odd, there is no answer, and the walk over hubs gives it, which costs some times as
//! much. That walk also sees facets that share only a corner with the present one; this one doesn't, which makes no
//! difference along coherent motion (as measured) but does from a cold start.

use glam::DVec3;

use super::cso::Cso;
use super::overlay::{Corner, below};
use super::walk::Walked;
use super::{Antipodal, HubPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::{
    CRISP, FACET_HUBS, FLUSH_WITNESS, OFFSET_SLACK, PARALLEL_EDGES, WALK_DECREASE, WALK_STEPS,
};
use crate::body::Polytope;
use crate::collision::StopReason;

/// Where going downhill ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bottom {
    pub(super) walked: Walked,
    /// Hubs of the facet at which there may be a lower one.
    pub(super) doubt: Doubt,
}

/// Goes downhill from the facet of `antipodal`. None if flush features or rounding are in the way. Not `thorough`, it does not ask
/// for facets that share no more than a corner with the last.
#[inline]
pub(super) fn descend(cso: &Cso<'_>, antipodal: Antipodal, thorough: bool) -> Option<Bottom> {
    let pose_ab = cso.pose_ba.inverse();
    let downhill = Downhill { cso, pose_ab: &pose_ab, decrease: WALK_DECREASE * cso.size() };
    let mut here = downhill.set_up(antipodal)?;
    // Along coherent motion the first facet mostly is the last; from a cold start hardly ever.
    let mut doubt = if thorough { downhill.glance(&here.corner) } else { Doubt::NONE };
    if thorough && doubt.count == 0 {
        return Some(Bottom { walked: downhill.end(&here, 0)?, doubt });
    }
    for steps in 0..WALK_STEPS {
        match downhill.lower_neighbour(&here.corner).ok()? {
            Some(corner) => here = Here { corner, supported: false, alone: false },
            None => {
                if thorough && steps > 0 {
                    doubt = downhill.glance(&here.corner);
                }
                return Some(Bottom { walked: downhill.end(&here, steps)?, doubt });
            }
        }
    }
    None
}

/// The facet of `antipodal` at this pose, for one who knows that none is lower. None as in [`descend`].
pub(super) fn settle(cso: &Cso<'_>, antipodal: Antipodal) -> Option<Walked> {
    let pose_ab = cso.pose_ba.inverse();
    let downhill = Downhill { cso, pose_ab: &pose_ab, decrease: WALK_DECREASE * cso.size() };
    downhill.end(&downhill.set_up(antipodal)?, 0)
}

/// A facet, and what setting it up has told.
struct Here {
    corner: Corner,
    /// Its features support its normal, as far as their planes support their bodies.
    supported: bool,
    /// Nothing else is flush with it.
    alone: bool,
}

/// Hubs at which a glance cannot tell that there is nothing lower.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    hubs: [HubPair; FACET_HUBS],
    count: usize,
}

impl Doubt {
    const NONE: Self = Self { hubs: [HubPair { a: 0, b: 0 }; FACET_HUBS], count: 0 };

    pub(super) fn hubs(&self) -> &[HubPair] {
        &self.hubs[..self.count]
    }

    /// Facets of more hubs than there is room for are not looked around wholly, as their sides are not.
    #[inline]
    fn push(&mut self, hub: HubPair) {
        if self.count < FACET_HUBS {
            self.hubs[self.count] = hub;
            self.count += 1;
        }
    }
}

/// The corner with its true offset: merged faces are flat only within a tolerance, and none of their corners speaks for all.
fn measured(cso: &Cso<'_>, corner: &Corner) -> Corner {
    let hub = HubPair {
        a: cso.a.climb(corner.hub.a, cso.toward_b(corner.normal)).0,
        b: cso.b.climb(corner.hub.b, corner.normal).0,
    };
    Corner { hub, offset: corner.normal.dot(cso.vertex(hub)), ..*corner }
}

/// Features are flush, or rounding contradicts itself.
struct Odd;

/// One polytope, whose face or edge the plane turns on, and the other, which it meets; each kind of facet is written
/// once and used both ways round. Directions are outward ones of p in p's frame; their opposites are outward ones of q.
struct View<'v> {
    p: &'v Polytope,
    q: &'v Polytope,
    q_in_p: &'v Placement,
    p_in_q: &'v Placement,
    p_is_a: bool,
}

impl View<'_> {
    /// The direction of q, in q's frame, that faces p's `normal`.
    #[inline]
    fn facing(&self, normal: DVec3) -> DVec3 {
        -self.p_in_q.vector(normal)
    }

    /// The vertex of the CSO that vertex `v` of p and `w` of q make, in p's frame and outward with p's normals.
    #[inline]
    fn vertex(&self, v: u32, w: u32) -> DVec3 {
        self.p.vertex(v) - self.q_in_p.point(self.q.vertex(w))
    }

    #[inline]
    fn hub(&self, v: u32, w: u32) -> HubPair {
        if self.p_is_a { HubPair { a: v, b: w } } else { HubPair { a: w, b: v } }
    }

    #[inline]
    fn face(&self, face: u32, w: u32) -> Antipodal {
        if self.p_is_a { Antipodal::FaceVertex { a: face, b: w } } else { Antipodal::VertexFace { a: w, b: face } }
    }

    #[inline]
    fn edges(&self, edge: u32, other: u32) -> Antipodal {
        if self.p_is_a { Antipodal::EdgeEdge { a: edge, b: other } } else { Antipodal::EdgeEdge { a: other, b: edge } }
    }
}

/// Where the turning plane stopped.
#[derive(Clone, Copy)]
struct Met {
    antipodal: Antipodal,
    hub: HubPair,
    /// The plane's normal, not unit, from b into a and in b's frame; for an edge pair within rounding.
    normal: DVec3,
}

/// The lowest facet seen so far that is below the bar.
struct Lowest {
    bar: f64,
    met: Option<Met>,
}

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

    /// The walk that ends at a facet, measured unless that tells nothing new. None if the facet turns out not to support its normal.
    #[inline]
    fn end(&self, here: &Here, steps: u32) -> Option<Walked> {
        let Cso { a, b, .. } = *self.cso;
        let crisp = here.supported && [a, b].iter().all(|body| body.bulge() <= CRISP * body.radius());
        let corner = if crisp { here.corner } else { measured(self.cso, &here.corner) };
        let is_true = corner.offset - here.corner.offset <= OFFSET_SLACK * self.cso.size();
        is_true.then_some(Walked { corner, alone: here.alone, steps, stop: StopReason::Converged })
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

    /// The facet of face `f` of p, with the vertex of q that supports it, climbed to from `w`.
    fn on_face(&self, view: &View<'_>, f: u32, w: u32) -> Here {
        let normal = view.p.plane(f).normal;
        let (w, height, next) = view.q.climb_apart(w, view.facing(normal));
        let v = view.p.face_vertices(f).at(0);
        let offset = normal.dot(view.vertex(v, w));
        let normal = if view.p_is_a { view.facing(normal) } else { normal };
        // No edge is longer than twice the radius; and twice that, for rounding.
        let alone = height - next > 4.0 * FLUSH_WITNESS * view.q.radius();
        let corner = Corner { normal, offset, antipodal: view.face(f, w), hub: view.hub(v, w) };
        Here { corner, supported: true, alone }
    }

    /// The facet of two edges if they cross on the Gauss map, else that of the lowest face beside them.
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
            // Unit vectors that differ by an angle have half its square less than one as their product; twice the angle, for rounding.
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
        let sides = if corners.len() > FACET_HUBS {
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

    /// Both ways from an edge pair along the arc of edge `g` of p: about the two ends of edge `e` of q.
    #[inline]
    fn around_edges(&self, view: &View<'_>, g: u32, e: u32, normal: DVec3, lowest: &mut Lowest) -> Result<(), Odd> {
        let (edge_p, edge_q) = (view.p.edge(g), view.q.edge(e));
        let along = view.q.vertex(edge_q.head) - view.q.vertex(edge_q.tail);
        // Toward the face that the tail faces more than the head does.
        let tail_first = view.facing(view.p.plane(edge_p.left).normal).dot(along) < 0.0;
        let ends = if tail_first { [edge_q.tail, edge_q.head] } else { [edge_q.head, edge_q.tail] };
        for (end, face) in ends.into_iter().zip([edge_p.left, edge_p.right]) {
            if view.p.plane(face).normal.dot(view.vertex(edge_p.tail, end)) < lowest.bar {
                Spokes::of(view, end, normal, Some(e))?.turn(view, g, face, edge_p.tail, lowest);
            }
        }
        Ok(())
    }

    /// The hubs of the facet at which there may be one that is lower.
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

    /// The facet at which the plane stopped, exactly.
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

/// A glance at a facet's hubs: the normals of one body alone may tell that there is nothing to see.
///
/// The directions along which a hub's vertex of the CSO has an offset of at least the bar make a circular cone. Being convex,
/// it holds the whole normal cone of one body's vertex as soon as it holds the normals of its faces; and the overlap is part of that.
struct Glance {
    bar: f64,
    doubt: Doubt,
}

impl Glance {
    /// The hubs of a facet of face `f` of p and vertex `w` of q.
    #[inline]
    fn around_face(&mut self, view: &View<'_>, f: u32, w: u32) {
        let corners = view.p.face_vertices(f);
        let origin = view.q_in_p.point(view.q.vertex(w));
        let few = corners.len() <= FACET_HUBS;
        let first = if few { 0 } else { farthest_side(view.p, f, origin) };
        let hubs = if few { corners.len() } else { 2 };
        for k in first..first + hubs {
            let v = corners.at(if k < corners.len() { k } else { k - corners.len() });
            if !self.is_above(view, v, f, origin) {
                self.doubt.push(view.hub(v, w));
            }
        }
    }

    /// True if no normal of vertex `v` of p but that of face `f` has an offset below the bar, with the vertex of q at `origin`.
    #[inline]
    fn is_above(&self, view: &View<'_>, v: u32, f: u32, origin: DVec3) -> bool {
        let is_above = |face: u32| face == f || -view.p.plane(face).height(origin) >= self.bar;
        self.bar >= 0.0 && view.p.ring(v).iter().all(|spoke| is_above(spoke.left))
    }

    /// The hubs of a facet of edge `g` of p and edge `e` of q; `mirror` is the view the other way round.
    #[inline]
    fn around_edges(&mut self, view: &View<'_>, mirror: &View<'_>, g: u32, e: u32) {
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

    /// True if no normal of vertex `v` of p has an offset below the bar at the hubs of `v` and the two ends of an edge of q
    /// (in p's frame): at that of them, for each normal, whose end supports it. The facet itself lies on the arc of p's edge `own`.
    #[inline]
    fn is_clear(&self, view: &View<'_>, v: u32, own: u32, [tail, head]: [DVec3; 2]) -> bool {
        let (planes, ring, bar) = (view.p.planes(), view.p.ring(v), self.bar);
        if bar < 0.0 {
            return false;
        }
        let along = head - tail;
        // Offsets at the tail, and how much lower the head stands: where it is negative, the head supports.
        let sight = |face: u32| {
            let plane = &planes[face as usize];
            (plane.offset - plane.normal.dot(tail), plane.normal.dot(along))
        };
        let mut last_face = ring.last().left;
        let (mut last_offset, mut last_drop) = sight(last_face);
        for spoke in ring {
            let (offset, drop) = sight(spoke.left);
            if offset - drop.min(0.0) < bar {
                return false;
            }
            // Between normals of different ends, the offset is least, if less than at both, where the ends change.
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

/// Spokes that a vertex may have here; vertices of more are left to the walk over hubs.
const SPOKES: usize = 24;

/// The spokes of a vertex of q and how far each lies above the supporting plane (not at all: all are below it).
struct Spokes {
    vertex: u32,
    normal: DVec3,
    heights: [f64; SPOKES],
    /// The spoke that lies in the plane, since its edge is one of the facet's: see [`side_of`].
    within: u32,
}

impl Spokes {
    /// The spokes of vertex `w` over the plane of p's `normal`; `within` is the edge that lies in it. Odd if the vertex does
    /// not support it or another spoke is flush with it.
    #[inline]
    fn of(view: &View<'_>, w: u32, normal: DVec3, within: Option<u32>) -> Result<Self, Odd> {
        let ring = view.q.ring(w);
        if ring.len() > SPOKES {
            return Err(Odd);
        }
        let within = within.map_or(u32::MAX, |edge| side_of(view.q, edge));
        let (facing, at) = (view.facing(normal), view.q.vertex(w));
        let mut heights = [0.0; SPOKES];
        for (height, spoke) in heights.iter_mut().zip(ring) {
            let along = view.q.vertex(spoke.neighbour) - at;
            *height = facing.dot(along);
            let clear = *height < 0.0 && *height * *height > FLUSH_WITNESS * FLUSH_WITNESS * along.length_squared();
            if !clear && side_of(view.q, spoke.edge) != within {
                return Err(Odd);
            }
        }
        Ok(Self { vertex: w, normal, heights, within })
    }

    /// Turns the plane about edge `edge` of p (of which `corner` is an end) toward face `face` of p, until a spoke meets it.
    #[inline]
    fn turn(&self, view: &View<'_>, edge: u32, face: u32, corner: u32, lowest: &mut Lowest) {
        let end = view.p.plane(face).normal;
        let (facing, at) = (view.facing(end), view.q.vertex(self.vertex));
        // The first spoke to rise above the plane: the least share of the way at which its height is zero.
        let mut first: Option<u32> = None;
        let (mut below_by, mut rises_by) = (1.0, 0.0);
        for (&height, spoke) in self.heights.iter().zip(view.q.ring(self.vertex)) {
            let rise = facing.dot(view.q.vertex(spoke.neighbour) - at);
            if rise > 0.0 && rise * below_by > rises_by * -height && side_of(view.q, spoke.edge) != self.within {
                (below_by, rises_by) = (-height, rise);
                first = Some(spoke.edge);
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
            lowest.met = Some(Met { antipodal, hub: view.hub(corner, self.vertex), normal });
        }
    }
}

/// The edge itself; of a plate, which has two along each side, that of the front.
#[inline]
fn side_of(polytope: &Polytope, edge: u32) -> u32 {
    if polytope.is_flat() { edge % (polytope.edge_count() as u32 / 2) } else { edge }
}

/// The edge itself; of a plate, that of the two along its side which supports `direction`.
#[inline]
fn edge_toward(polytope: &Polytope, edge: u32, direction: DVec3) -> u32 {
    if !polytope.is_flat() {
        return edge;
    }
    let front = polytope.plane(0).normal.dot(direction) >= 0.0;
    side_of(polytope, edge) + if front { 0 } else { polytope.edge_count() as u32 / 2 }
}

/// The unit normal of two edges from their cross product. None if they are parallel.
#[inline]
fn edge_normal(along_a: DVec3, along_b: DVec3, across: DVec3) -> Option<DVec3> {
    let (length_a, length_b) = (along_a.length_squared(), along_b.length_squared());
    if across.length_squared() <= PARALLEL_EDGES * PARALLEL_EDGES * length_a * length_b {
        return None;
    }
    // The rounding of a product of nearly parallel edges lies partly along them; without it the plane supports both.
    let normal = across - along_a * (across.dot(along_a) / length_a);
    Some(normal / normal.length())
}

/// The side of face `f` beyond which `point` lies farthest.
fn farthest_side(polytope: &Polytope, f: u32, point: DVec3) -> usize {
    let (corners, normal) = (polytope.face_vertices(f), polytope.plane(f).normal);
    let mut farthest = (f64::NEG_INFINITY, 0);
    for (k, corner) in corners.iter().enumerate() {
        let from = polytope.vertex(corner);
        let side = polytope.vertex(corners.at((k + 1) % corners.len())) - from;
        let outward = side.cross(normal);
        let beyond = outward.dot(point - from) / outward.length();
        if beyond > farthest.0 {
            farthest = (beyond, k);
        }
    }
    farthest.1
}
