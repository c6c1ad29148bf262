//! The depth along normals of the meshes instead of the hulls \[K02 §3.4\].
//!
//! A hull adds faces that are not part of the surface. A force along the normal of an added face
//! would come from a surface that does not exist. A normal is *admissible* for a piece if the
//! source mesh has this normal at the piece's patch ([`AdmissibleNormals`]). A facet of the CSO is
//! an *admissible facet* if its normal is admissible for both pieces. The depth of a contact is the
//! least h over the admissible facets:
//!
//! * A face of b, or the end of an arc of b, against the vertex of body a that supports its normal.
//!   The opposite normal must be admissible at this vertex. The same holds with a and b exchanged.
//! * Two edges whose arcs of admissible normals cross.
//!
//! If the bodies touch, the normal of contact is admissible for both pieces. The admissible depth
//! is never less than the unconstrained depth. While the facet's normal stays admissible, the depth
//! depends continuously on the pose: h is continuous along every normal, and a crossing moves
//! continuously. If a crossing reaches an end of an arc, the end is admissible and has the same h.
//! A facet disappears only if its normal is no longer admissible at a vertex: a neighbour on the
//! mesh then rises above the vertex. The piece of that neighbour has a facet with the same h.
//!
//! 1. If the walk has ended on an admissible facet, that facet is the result.
//! 2. Otherwise try every admissible facet that is not deeper than the facet of the previous tick
//!    at this pose. Skip normals outside the cap that contains all normals of the other piece
//!    ([`Cap`]). For any vertex c of the CSO, h along n is at least n·c, so a few known supports
//!    reject most facets ([`KnownPoints`]). The test of a normal needs one product for each known
//!    support. The test of an arc needs the products at its two ends, because n·c is concave along
//!    the part of an arc on which it is not negative.
//! 3. Cross the remaining arcs of body a with the remaining arcs of b. Compute the true supports of
//!    the facet with the smallest offset.
//!
//! A search also stores its candidates ([`Candidates`]): the facets that can be the result after a
//! small motion. The next searches try only these.
//!
//! Deviation from \[K02\]: the paper moves a depth from virtual features to a neighbouring original
//! feature, and then walks one step further. The paper's depth jumps if the neighbourhood changes,
//! and may not be the least depth.

mod arcs;
mod candidates;
mod known;
mod planes;
mod points;

use glam::DVec3;

use super::cso::Cso;
use super::query::DepthScratch;
use super::witness::Clip;
use super::{Antipodal, Depth, HubPair};
use crate::algebra::tolerance::{OFFSET_SLACK, SKIPPED_TURN};
use crate::algebra::{PairTable, Placement};
use crate::body::{Admissible, AdmissibleNormals, Cap, Feature, FeaturePair};
use crate::collision::StopReason;
use arcs::{Arc, Listed};
use candidates::{Candidates, Kind, Motion};
use known::KnownPoints;

/// The least depth along an admissible normal, in b's frame; `point_a − point_b = −depth · normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdmissibleDepth {
    /// Point in a's supporting plane. The point lies on a if the facet's features face each other.
    pub point_a: DVec3,
    /// Point in b's supporting plane.
    pub point_b: DVec3,
    /// The nearest points (on a, on b) of the feature with the admissible normal and the other
    /// feature.
    pub facing: (DVec3, DVec3),
    /// Unit vector from body b into body a.
    pub normal: DVec3,
    /// `max_b n·b − min_a n·a` along `normal` (length unit of the polytopes).
    pub depth: f64,
    /// The features that face each other along the normal: a vertex and a face, a vertex and an
    /// edge, or two edges. For a vertex and an edge, the normal is the end of the edge's arc.
    pub features: FeaturePair,
    /// True if the walk had ended on a different facet.
    pub moved: bool,
    /// [`StopReason::Budget`] if not all crossings were tested.
    pub stop: StopReason,
}

/// Working memory of the search, for the pieces of two bodies, with the candidates of the last
/// searches. It must not be used for other bodies.
#[derive(Debug)]
pub struct AdmissibleScratch {
    arcs_a: Vec<Listed>,
    arcs_b: Vec<Listed>,
    candidates: PairTable<Candidates>,
}

impl AdmissibleScratch {
    /// Number of pairs whose candidates are stored.
    const PLACES: usize = 256;

    /// Allocates memory for any pair of pieces of the two bodies.
    pub fn new(a: &Admissible, b: &Admissible) -> Self {
        Self {
            arcs_a: Vec::with_capacity(a.most_arcs()),
            arcs_b: Vec::with_capacity(b.most_arcs()),
            candidates: PairTable::new(Self::PLACES, || Candidates::NONE),
        }
    }

    /// Returns the pose at which the candidates of a pair were found.
    #[cfg(test)]
    pub(crate) fn candidates_found_at(&mut self, [a, b]: [&AdmissibleNormals<'_>; 2]) -> Placement {
        self.candidates.of([a.piece(), b.piece()], Candidates::clear).pose_ba()
    }

    /// Drops all cached data.
    pub fn clear(&mut self) {
        self.candidates.values_mut().for_each(Candidates::clear);
    }
}

impl Clone for AdmissibleScratch {
    /// The room of the lists limits the search, and a copied list would have no room.
    fn clone(&self) -> Self {
        let [arcs_a, arcs_b] = [&self.arcs_a, &self.arcs_b].map(|arcs| Vec::with_capacity(arcs.capacity()));
        Self { arcs_a, arcs_b, candidates: self.candidates.clone() }
    }
}

/// Returns the smallest depth over the admissible facets of a pair. `None` if no normal is
/// admissible for both pieces. `walked` is the unconstrained depth of the pair. `last` has the
/// features of the result at the previous, nearby pose.
pub fn admissible_depth(
    a: &AdmissibleNormals<'_>,
    b: &AdmissibleNormals<'_>,
    pose_ba: &Placement,
    walked: &Depth,
    last: Option<FeaturePair>,
    scratch: &mut AdmissibleScratch,
    depths: &mut DepthScratch,
) -> Option<AdmissibleDepth> {
    if is_admissible(a, b, pose_ba, walked) {
        let Depth { point_a, point_b, normal, depth, antipodal, stop, .. } = *walked;
        let features = antipodal.features();
        let facing = (point_a, point_b);
        return Some(AdmissibleDepth { point_a, point_b, facing, normal, depth, features, moved: false, stop });
    }
    least_admissible_depth(a, b, pose_ba, walked.hub, last, scratch, depths)
}

/// Returns the smallest depth over the admissible facets of a pair, like [`admissible_depth`], but
/// without the result of a walk. Climbs start at the vertices `hub`.
pub(crate) fn least_admissible_depth(
    a: &AdmissibleNormals<'_>,
    b: &AdmissibleNormals<'_>,
    pose_ba: &Placement,
    hub: HubPair,
    last: Option<FeaturePair>,
    scratch: &mut AdmissibleScratch,
    depths: &mut DepthScratch,
) -> Option<AdmissibleDepth> {
    let AdmissibleScratch { arcs_a, arcs_b, candidates } = scratch;
    let candidates = candidates.of([a.piece(), b.piece()], Candidates::clear);
    let cso = Cso { a: a.polytope(), b: b.polytope(), pose_ba };
    let mut search = Search::new(cso, a, b, hub);
    let motion = candidates.motion(&cso);
    let others = candidates.others(&motion);
    if others > 0.0 {
        search.bar = others;
        search.again(candidates);
        if search.found.is_some() {
            candidates.count();
            return search.answer(&mut depths.clip);
        }
        search.bar = f64::INFINITY;
    }
    if let Some(last) = last {
        search.no_deeper_than(last);
    }
    // Without the last result, too many facets would be candidates.
    let reach = if search.bar.is_finite() { candidates.reach(&cso, &motion) } else { None };
    search.find(candidates, reach, [arcs_a, arcs_b]);
    search.answer(&mut depths.clip)
}

/// Returns the least depth along the face normals that are admissible for both pieces; `None` if
/// there is no such normal. The result is an upper bound of [`admissible_depth`], which also
/// searches edge pairs. Climbs start at the vertices `hub`. `last` has the features of the result
/// at a previous, nearby pose.
pub(crate) fn admissible_bound(
    a: &AdmissibleNormals<'_>,
    b: &AdmissibleNormals<'_>,
    pose_ba: &Placement,
    hub: [u32; 2],
    last: Option<FeaturePair>,
) -> Option<AdmissibleBound> {
    let cso = Cso { a: a.polytope(), b: b.polytope(), pose_ba };
    let mut search = Search::new(cso, a, b, HubPair { a: hub[0], b: hub[1] });
    if let Some(last) = last {
        search.no_deeper_than(last);
    }
    search.planes(|_, _| ());
    let Found { normal, features, hub } = search.found?;
    Some(AdmissibleBound { normal, features, hub: [hub.a, hub.b], depth: search.bar })
}

/// An upper bound of the depth of two pieces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdmissibleBound {
    /// Unit normal from body b into body a, in b's frame. The normal is admissible for both pieces.
    pub(crate) normal: DVec3,
    /// The features that face each other along the normal.
    pub(crate) features: FeaturePair,
    /// Vertices of bodies a and b that support the normal.
    pub(crate) hub: [u32; 2],
    /// Depth along the normal, in model units.
    pub(crate) depth: f64,
}

/// Returns the angle (rad) by which the pieces must at least turn before a normal can be admissible
/// for both. The angle is valid for every translation. Returns 0 if the angle is unknown or smaller
/// than [`SKIPPED_TURN`], because a smaller angle is not used.
///
/// A common facet exists only in two cases. A normal of one piece is an admissible direction of the
/// other, or an end of an arc lies on an arc of the other. The ends of arcs are normals too, so a
/// test of all normals is sufficient.
pub(crate) fn inadmissible_angle(a: &AdmissibleNormals<'_>, b: &AdmissibleNormals<'_>, pose_ba: &Placement) -> f64 {
    let mut least = f64::INFINITY;
    for normal in normals(b) {
        least = least.min(a.angle_to(-pose_ba.inverse_vector(normal)));
        if least < SKIPPED_TURN {
            return 0.0;
        }
    }
    for normal in normals(a) {
        least = least.min(b.angle_to(-pose_ba.vector(normal)));
        if least < SKIPPED_TURN {
            return 0.0;
        }
    }
    least
}

/// Returns the normals of the piece's faces and its borrowed normals, in the piece's frame.
fn normals<'n>(own: &'n AdmissibleNormals<'_>) -> impl Iterator<Item = DVec3> + 'n {
    let faces = own.faces().iter().map(|face| own.plane(face.face).normal);
    faces.chain(own.borrowed().iter().map(|borrowed| borrowed.plane.normal))
}

/// Returns true if the normal at the end of a walk is admissible for both pieces.
pub fn is_admissible(
    a: &AdmissibleNormals<'_>,
    b: &AdmissibleNormals<'_>,
    pose_ba: &Placement,
    walked: &Depth,
) -> bool {
    match walked.antipodal {
        Antipodal::VertexFace { a: vertex, b: face } => {
            b.surface_face(face).is_some() && a.vertex_admits(vertex, -pose_ba.inverse_vector(walked.normal))
        }
        Antipodal::FaceVertex { a: face, b: vertex } => {
            a.surface_face(face).is_some() && b.vertex_admits(vertex, walked.normal)
        }
        Antipodal::EdgeEdge { a: edge_a, b: edge_b } => {
            a.edge_faces(edge_a, -pose_ba.inverse_vector(walked.normal)) && b.edge_faces(edge_b, walked.normal)
        }
    }
}

/// The facet with the smallest offset found so far.
#[derive(Clone, Copy)]
struct Found {
    normal: DVec3,
    features: FeaturePair,
    hub: HubPair,
}

struct Search<'s> {
    cso: Cso<'s>,
    a: &'s AdmissibleNormals<'s>,
    b: &'s AdmissibleNormals<'s>,
    /// The hub pair of the last support found.
    hub: HubPair,
    /// The last supports: on body a in b's frame, and on b in a's frame. The newest are at the hub
    /// pair.
    known_a: KnownPoints,
    known_b: KnownPoints,
    /// Cap that contains the reflected normals of body a, in b's frame.
    cap_a: Cap,
    /// Cap that contains the reflected normals of b, in a's frame.
    cap_b: Cap,
    /// The least h found so far.
    bar: f64,
    /// The motion for which candidates are searched: facets that can be the result after it.
    reach: Motion,
    found: Option<Found>,
    stop: StopReason,
}

impl<'s> Search<'s> {
    fn new(cso: Cso<'s>, a: &'s AdmissibleNormals<'s>, b: &'s AdmissibleNormals<'s>, hub: HubPair) -> Self {
        let point_a = cso.point_a(hub.a);
        let point_b = cso.pose_ba.inverse_point(cso.b.vertex(hub.b));
        Self {
            cso,
            a,
            b,
            hub,
            known_a: KnownPoints::new(point_a),
            known_b: KnownPoints::new(point_b),
            cap_a: a.cap().about(-cso.pose_ba.vector(a.cap().axis)),
            cap_b: b.cap().about(-cso.pose_ba.inverse_vector(b.cap().axis)),
            bar: f64::INFINITY,
            reach: Motion::NONE,
            found: None,
            stop: StopReason::Converged,
        }
    }

    /// Limits the search to facets that are not deeper than the previous tick's facet. Does not
    /// take that facet as the result. Of facets with equal depth, the first one found is the
    /// result. So the result does not depend on earlier ticks.
    fn no_deeper_than(&mut self, last: FeaturePair) {
        self.try_again(last);
        self.found = None;
        self.bar += OFFSET_SLACK * self.cso.size();
    }

    fn try_again(&mut self, last: FeaturePair) {
        match (last.a, last.b) {
            (Feature::Vertex(_), Feature::Face(face)) if self.b.surface_face(face).is_some() => {
                _ = self.plane_of_b(face)
            }
            (Feature::Face(face), Feature::Vertex(_)) if self.a.surface_face(face).is_some() => {
                _ = self.plane_of_a(face)
            }
            (Feature::Vertex(_), Feature::Edge(edge)) => {
                if let Some(k) = self.b.borrowed_at(edge) {
                    self.plane_of_b(k);
                }
            }
            (Feature::Edge(edge), Feature::Vertex(_)) => {
                if let Some(k) = self.a.borrowed_at(edge) {
                    self.plane_of_a(k);
                }
            }
            (Feature::Edge(edge_a), Feature::Edge(edge_b)) => {
                if let (Some(a), Some(b)) = (self.a.arc_at(edge_a), self.b.arc_at(edge_b)) {
                    self.cross(&Arc::of(self.a, a).reflected(self.cso.pose_ba), &Arc::of(self.b, b));
                }
            }
            _ => {}
        }
    }

    /// Tries every facet. Stores the candidates for the motion `reach`, or none.
    fn find(&mut self, candidates: &mut Candidates, reach: Option<Motion>, lists: [&mut Vec<Listed>; 2]) {
        candidates.begin();
        self.reach = reach.unwrap_or(Motion::NONE);
        let Motion { path, turn } = self.reach;
        self.cap_a = self.cap_a.widened(turn);
        self.cap_b = self.cap_b.widened(turn);
        self.planes(|kind, index| candidates.add(kind, &[index as usize]));
        self.arcs(lists, |pair| candidates.add(Kind::Crossing, &pair));
        let is_complete = reach.is_some() && self.stop == StopReason::Converged;
        candidates.end(self.cso.pose_ba, if is_complete { self.bar + path } else { f64::NEG_INFINITY }, turn);
    }

    /// Tries the candidates.
    fn again(&mut self, candidates: &Candidates) {
        candidates.planes(Kind::FaceOfB).for_each(|index| _ = self.plane_of_b(index));
        candidates.planes(Kind::FaceOfA).for_each(|index| _ = self.plane_of_a(index));
        candidates.planes(Kind::BorrowedByB).for_each(|index| _ = self.plane_of_b(index));
        candidates.planes(Kind::BorrowedByA).for_each(|index| _ = self.plane_of_a(index));
        for [a, b] in candidates.crossings() {
            let a = Arc::of(self.a, &self.a.arcs()[a]).reflected(self.cso.pose_ba);
            self.cross(&a, &Arc::of(self.b, &self.b.arcs()[b]));
        }
    }

    fn look_from_b(&mut self, b: u32) {
        if b != self.hub.b {
            self.hub.b = b;
            self.known_b.add(self.cso.pose_ba.inverse_point(self.cso.b.vertex(b)));
        }
    }

    fn look_from_a(&mut self, a: u32) {
        if a != self.hub.a {
            self.hub.a = a;
            self.known_a.add(self.cso.point_a(a));
        }
    }

    fn take(&mut self, normal: DVec3, offset: f64, features: FeaturePair) {
        self.bar = offset;
        self.found = Some(Found { normal, features, hub: self.hub });
    }

    /// Returns the facet with the smallest offset, with its true offset and its witness points.
    fn answer(&self, clip: &mut Clip) -> Option<AdmissibleDepth> {
        let mut found = self.found?;
        let (hub, depth) = self.cso.support(found.hub, found.normal);
        found.hub = hub;
        let facing = self.facing(&found, depth, clip);
        let (point_a, point_b) = self.witness(&found, depth, facing);
        let Found { normal, features, .. } = found;
        Some(AdmissibleDepth { point_a, point_b, facing, normal, depth, features, moved: true, stop: self.stop })
    }
}
