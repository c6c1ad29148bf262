//! State that a proof keeps for the next tick: its surface, and a bound of the bodies' motion since
//! the surface was measured.

use super::super::HubPair;
use super::super::cso::Cso;
use super::super::inner::{Joint, Surface};
use crate::algebra::Placement;
use crate::algebra::tolerance::{KEPT_CORNERS, KEPT_TRIANGLES, PROOF_GATHERED};

/// State of the proofs of one pair of polytopes from tick to tick. The memory is valid only for
/// this pair, but at any pose. The memory saves most time if the next pose is near the previous
/// pose.
#[derive(Clone, Debug)]
pub struct CertificateMemory {
    pub(super) hubs: Vec<HubPair>,
    pub(super) triangles: Vec<Joint>,
    /// For each triangle, its distance from the origin at its last measurement, plus the value of
    /// `moved` at that time.
    pub(super) safe_until: Vec<f64>,
    /// Upper bound of the motion of any point since the whole surface was measured.
    pub(super) moved: f64,
    /// The pose of the previous tick.
    pose_ba: Placement,
    /// Numbers that identify the pair of polytopes.
    pair: [f64; 4],
    /// Number of triangles of the surface when it was new.
    fresh: usize,
}

impl CertificateMemory {
    /// Creates an empty memory, with room for a surface of [`KEPT_CORNERS`] corners (about 12 kB).
    /// A larger surface is not kept, and the next proof starts from a tetrahedron.
    pub fn new() -> Self {
        Self {
            hubs: Vec::with_capacity(KEPT_CORNERS),
            triangles: Vec::with_capacity(KEPT_TRIANGLES),
            safe_until: Vec::with_capacity(KEPT_TRIANGLES),
            moved: 0.0,
            pose_ba: Placement::IDENTITY,
            pair: [0.0; 4],
            fresh: 0,
        }
    }

    /// Clears the memory.
    pub fn clear(&mut self) {
        self.hubs.clear();
        self.triangles.clear();
        self.safe_until.clear();
    }

    /// Returns true if the memory contains a surface of these two polytopes.
    pub(in super::super) fn serves(&self, cso: &Cso<'_>) -> bool {
        !self.triangles.is_empty() && self.pair == pair_of(cso)
    }

    /// Adds the motion from the previous pose to this one.
    pub(super) fn advance(&mut self, cso: &Cso<'_>) {
        let (from, to) = (&self.pose_ba, cso.pose_ba);
        let centre = cso.a.centroid();
        // The motion of a point at unit distance from the axis: twice the sine of half the angle.
        let turn = (0..3).map(|k| (to.rotation.col(k) - from.rotation.col(k)).length_squared()).sum::<f64>() * 0.5;
        self.moved += to.point(centre).distance(from.point(centre)) + turn.sqrt() * cso.a.radius();
        self.pose_ba = *to;
    }

    pub(super) fn keep(&mut self, cso: &Cso<'_>, surface: &Surface, bar: f64, new: bool) {
        self.clear();
        let count = surface.joints().len();
        if new {
            self.fresh = count;
        }
        let gathered = count > PROOF_GATHERED * (self.fresh + 1);
        if gathered || count > KEPT_TRIANGLES || surface.tips().len() > KEPT_CORNERS {
            return;
        }
        self.pair = pair_of(cso);
        self.pose_ba = *cso.pose_ba;
        self.moved = 0.0;
        self.hubs.extend(surface.tips().iter().map(|tip| tip.hub));
        self.triangles.extend_from_slice(surface.joints());
        let finite = |&offset: &f64| if offset < f64::INFINITY { offset } else { bar };
        self.safe_until.extend(surface.offsets().iter().map(finite));
    }
}

fn pair_of(cso: &Cso<'_>) -> [f64; 4] {
    let Cso { a, b, .. } = *cso;
    [a.vertices().len() as f64, b.vertices().len() as f64, a.radius(), b.radius()]
}

impl Default for CertificateMemory {
    fn default() -> Self {
        Self::new()
    }
}
