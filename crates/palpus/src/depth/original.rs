//! Repair of answers that rest on virtual features \[K02 §3.4\].
//!
//! Hulls add faces that are not surface of the source mesh. A depth along the normal of such a face would push out of a
//! surface that nobody sees.
//!
//! 1. An answer whose face is original, or whose two edges are, stands.
//! 2. Otherwise one more iteration over the hubs of the virtual facet, in which only original features count: the
//!    original features next to the virtual ones, locally the best of them.
//! 3. If none of those is a facet of the CSO, all original faces of both bodies, each with its true support.
//! 4. None if neither body has an original face.

use super::antipodal::Facet;
use super::cso::Cso;
use super::overlay::{Admit, Corner, lowest_corner};
use super::query::{WalkScratch, answer_at, measured};
use super::seed::Start;
use super::{Antipodal, Depth, HubPair};
use crate::algebra::Placement;
use crate::algebra::tolerance::FLUSH_FACET;
use crate::body::{Polytope, Provenance};

/// Only features on the surface of the source mesh may make a corner.
struct AdmitOriginal<'p> {
    a: &'p Polytope,
    b: &'p Polytope,
}

impl Admit for AdmitOriginal<'_> {
    fn face_a(&self, face: u32) -> bool {
        self.a.face_provenance(face) == Provenance::Original
    }
    fn face_b(&self, face: u32) -> bool {
        self.b.face_provenance(face) == Provenance::Original
    }
    fn edge_a(&self, edge: u32) -> bool {
        self.a.edge_provenance(edge) == Provenance::Original
    }
    fn edge_b(&self, edge: u32) -> bool {
        self.b.edge_provenance(edge) == Provenance::Original
    }
}

/// True if the features that give the normal lie on the source meshes: the face of a vertex–face pair, both edges of an
/// edge pair.
pub fn is_original(a: &Polytope, b: &Polytope, antipodal: Antipodal) -> bool {
    let admit = AdmitOriginal { a, b };
    match antipodal {
        Antipodal::VertexFace { b, .. } => admit.face_b(b),
        Antipodal::FaceVertex { a, .. } => admit.face_a(a),
        Antipodal::EdgeEdge { a, b } => admit.edge_a(a) && admit.edge_b(b),
    }
}

/// The answer along a normal of original features: `answer` itself if it is one, else the locally best one next to it.
///
/// `pose_ba` is that of the query which gave the answer. The depth is not smaller than the answer's; both bodies' points
/// keep `point_a − point_b = −depth · normal`, but where the original features do not face each other, `point_a` lies in
/// a's supporting plane beside a. None if neither body has an original face.
pub fn repair(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    answer: &Depth,
    scratch: &mut WalkScratch,
) -> Option<Depth> {
    if is_original(a, b, answer.antipodal) {
        return Some(*answer);
    }
    let cso = Cso { a, b, pose_ba };
    scratch.trail.clear();
    let corner = next_to(&cso, answer, scratch).or_else(|| lowest_face(&cso, answer.hub, &AdmitOriginal { a, b }))?;
    let corner = measured(&cso, &corner);
    Some(answer_at(&cso, &corner, answer.steps + 1, answer.stop, &mut scratch.clip))
}

/// The least original corner at the hubs of the answer's facet.
fn next_to(cso: &Cso<'_>, answer: &Depth, scratch: &mut WalkScratch) -> Option<Corner> {
    let admit = AdmitOriginal { a: cso.a, b: cso.b };
    let virtual_corner =
        Corner { normal: answer.normal, offset: answer.depth, antipodal: answer.antipodal, hub: answer.hub };
    let trail = &mut scratch.trail;
    let mut bar = f64::INFINITY;
    let mut found: Option<Corner> = None;
    let mut look = |hub: HubPair| {
        if let Some(corner) = lowest_corner(cso, &mut trail.maps_a, &mut trail.maps_b, hub, bar, &admit) {
            bar = corner.offset;
            found = Some(corner);
        }
    };
    Facet::at(cso, &virtual_corner, FLUSH_FACET).for_each_side(cso, |side| look(side.from));
    found
}

/// The face, among those admitted, along whose normal the bodies separate soonest; each is a facet of the CSO with its true
/// support. The one way to an answer that needs no hub.
pub(super) fn lowest_face(cso: &Cso<'_>, hint: HubPair, admit: &impl Admit) -> Option<Corner> {
    let mut found: Option<Corner> = None;
    let mut hub = hint;
    let mut look = |antipodal: fn(u32, HubPair) -> Antipodal, face: u32| {
        let normal = match cso.face_normal(antipodal(face, hub)) {
            Some(normal) => normal,
            None => return,
        };
        let Some(start) = Start::along(cso, normal, hub) else { return };
        hub = start.hub;
        if found.is_none_or(|best| start.offset < best.offset) {
            found = Some(Corner { normal: start.normal, offset: start.offset, antipodal: antipodal(face, hub), hub });
        }
    };
    for face in (0..cso.b.face_count() as u32).filter(|&face| admit.face_b(face)) {
        look(|face, hub| Antipodal::VertexFace { a: hub.a, b: face }, face);
    }
    for face in (0..cso.a.face_count() as u32).filter(|&face| admit.face_a(face)) {
        look(|face, hub| Antipodal::FaceVertex { a: face, b: hub.b }, face);
    }
    found
}
