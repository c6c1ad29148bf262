//! Thick pieces: extends the hull of a patch into the solid, up to the points where another part of
//! the surface is equally near. \[K02\] has no thick pieces.
//!
//! The hull of two or three triangles is thin. A point that penetrates deeper than this thickness
//! would leave the piece, and the force would vanish. Therefore pieces of a closed surface get
//! additional corners inside the solid:
//!
//! 1. From each vertex of the surface, an *inward path* leads to the medial axis and then along it
//!    to thicker parts of the solid (`inward_path`). Neighbouring patches share the paths of their
//!    common vertices, so their pieces leave no gap. A facet that is wide relative to the thickness
//!    below it gets another path from its middle.
//! 2. The candidates for corners are the points of these paths that satisfy two conditions. First,
//!    the points lie below all planes of the patch, so that every facet stays on the hull. Second,
//!    the patch is the nearest part of the surface, or nearly. Beyond the medial axis, the piece
//!    would report a depth larger than the distance to the nearest surface.
//! 3. Merge candidates that are close together. If many candidates remain, keep those that are
//!    farthest apart.
//! 4. No triangle of another patch may enter the hull of the patch and the candidates (see
//!    `contain`). If a triangle enters, move all candidates toward the surface by the same fraction
//!    until no triangle enters. Then try to move each candidate deeper again. If no fraction works,
//!    try the candidates one by one.
//!
//! The facets of the patch stay original faces. Faces with an inner corner are virtual.
//! Neighbouring pieces overlap slightly inside the solid. A patch that is a whole convex component
//! needs no inner corners. An open surface has no inside, so its pieces stay thin.
//!
//! Limits: a convex piece cannot fill a thin wall that bends. Therefore a large patch of a coarse
//! mesh leaves parts of the wall uncovered. A patch of thousands of facets gets no inner corners,
//! because its hull is already deep, and the time would be quadratic in the size of the patch.

mod inward_path;
#[cfg(test)]
mod tests;

use glam::DVec3;

use self::inward_path::{PathPoint, inward_path};
use crate::algebra::Plane;
use crate::algebra::tolerance::{
    FENCE_PLANES, FLAT_PATCH, THICK_CORNERS, THICK_DEPTH, THICK_ENTERED, THICK_MERGED, THICK_PATCH, THICK_RETREATS,
    THICK_SHARES, WIDE_FACET,
};
use crate::body::decompose::Patch;
use crate::body::decompose::contain::Clipper;
use crate::body::decompose::facet::{Facets, Surface};
use crate::body::decompose::trial_hull::TrialHull;
use crate::body::{Aabb, TriangleTree};

pub(crate) use inward_path::InwardPaths;

/// Returns the inner corners of a patch's piece. The corners lie inside the solid and below every
/// facet of the patch. The list is empty if the patch has no inward paths.
///
/// The result depends only on the arguments, so patches can be processed in any order and in
/// parallel.
pub(crate) fn inner_corners(
    surface: &Surface<'_>,
    facets: &Facets,
    tree: &TriangleTree,
    paths: &InwardPaths,
    patch: &Patch,
) -> Vec<DVec3> {
    if patch.facets.len() > THICK_PATCH {
        return Vec::new();
    }
    let candidates = few(candidates(surface, facets, tree, paths, patch));
    if candidates.is_empty() {
        return Vec::new();
    }
    let mut trial = Trial::new(surface, facets, tree, patch);
    let even = THICK_SHARES.into_iter().find(|&share| trial.takes_all(&candidates, share));
    match even {
        Some(share) if share < 1.0 => trial.deepen(&candidates, share),
        Some(_) => candidates.iter().map(|candidate| candidate.point).collect(),
        None => trial.take_singly(&candidates),
    }
}

/// A candidate for an inner corner of a piece.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// The point of the surface at which the inward path starts.
    from: DVec3,
    point: DVec3,
    /// Depth of the candidate below the nearest plane of the patch (m).
    below: f64,
}

impl Candidate {
    /// Returns the point at fraction `share` of the way from the surface to the candidate.
    fn at(&self, share: f64) -> DVec3 {
        self.from.lerp(self.point, share)
    }
}

/// Does steps 1 and 2: collects all candidates of a patch.
fn candidates(
    surface: &Surface<'_>,
    facets: &Facets,
    tree: &TriangleTree,
    paths: &InwardPaths,
    patch: &Patch,
) -> Vec<Candidate> {
    let mut candidates = Vec::new();
    let mut add = |from: DVec3, path: &[PathPoint]| {
        for &PathPoint { point, distance } in path {
            let below = patch.facets.iter().map(|&f| -facets.plane(f).height(point)).fold(f64::INFINITY, f64::min);
            if below > FLAT_PATCH * surface.noise() && below <= THICK_DEPTH * distance {
                candidates.push(Candidate { from, point, below });
            }
        }
        candidates.iter().map(|candidate: &Candidate| candidate.below).fold(0.0, f64::max)
    };
    let mut deepest = 0.0;
    for v in corners_of(facets, patch) {
        deepest = add(surface.vertex(v), paths.of(v));
    }
    if !paths.reach(patch, facets) {
        return candidates;
    }
    let mut path = Vec::new();
    for &f in &patch.facets {
        let corners = facets.corners(f).iter().map(|&v| surface.vertex(v));
        let middle = corners.clone().sum::<DVec3>() / corners.len() as f64;
        let width = corners.map(|p| p.distance(middle)).fold(0.0, f64::max);
        if width > WIDE_FACET * deepest {
            path.clear();
            inward_path(middle, &mut vec![facets.plane(f).normal], tree, surface.noise(), &mut path);
            add(middle, &path);
        }
    }
    candidates
}

/// Returns the vertices of a patch in ascending order.
fn corners_of(facets: &Facets, patch: &Patch) -> Vec<u32> {
    let mut corners: Vec<u32> = patch.facets.iter().flat_map(|&f| facets.corners(f)).copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// Does step 3: takes the deepest candidate first. Then repeatedly takes the candidate farthest
/// from all candidates taken so far.
fn few(candidates: Vec<Candidate>) -> Vec<Candidate> {
    let mut taken: Vec<Candidate> = Vec::new();
    let mut gaps = vec![f64::INFINITY; candidates.len()];
    while taken.len() < THICK_CORNERS {
        let far = |k: &usize| gaps[*k] > (THICK_MERGED * candidates[*k].below).powi(2);
        let better = |&i: &usize, &j: &usize| {
            gaps[i].total_cmp(&gaps[j]).then(candidates[i].below.total_cmp(&candidates[j].below)).then(j.cmp(&i))
        };
        let Some(next) = (0..candidates.len()).filter(far).max_by(better) else { break };
        let candidate = candidates[next];
        taken.push(candidate);
        for (gap, other) in gaps.iter_mut().zip(&candidates) {
            *gap = gap.min(other.point.distance_squared(candidate.point));
        }
    }
    taken
}

/// Does step 4: tests hulls of the patch and inner corners against the surface.
struct Trial<'a> {
    facets: &'a Facets,
    tree: &'a TriangleTree,
    /// The patch's facets in ascending order.
    members: Vec<u32>,
    /// The patch's vertices. During a trial, the tried corners are at the end.
    points: Vec<DVec3>,
    noise: f64,
    hull: TrialHull,
    clipper: Clipper,
    fence: Vec<Plane>,
}

impl<'a> Trial<'a> {
    fn new(surface: &Surface<'_>, facets: &'a Facets, tree: &'a TriangleTree, patch: &Patch) -> Self {
        let mut members = patch.facets.clone();
        members.sort_unstable();
        Self {
            facets,
            tree,
            members,
            points: corners_of(facets, patch).iter().map(|&v| surface.vertex(v)).collect(),
            noise: surface.noise(),
            hull: TrialHull::default(),
            clipper: Clipper::default(),
            fence: Vec::new(),
        }
    }

    /// Builds the hull of the patch and the given `corners`. If the hull is flat or a triangle
    /// enters it, returns false and leaves the hull empty.
    fn takes_these(&mut self, corners: impl Iterator<Item = DVec3>) -> bool {
        let own = self.points.len();
        self.points.extend(corners);
        let bounds = Aabb::around(self.points.iter().copied());
        let good = self.hull.start(&self.points, FLAT_PATCH * self.noise) && !self.is_entered(&bounds);
        self.points.truncate(own);
        if !good {
            self.hull.clear();
        }
        good
    }

    /// Tries all candidates at once, each at the fraction `share` of its distance from the surface.
    fn takes_all(&mut self, candidates: &[Candidate], share: f64) -> bool {
        self.takes_these(candidates.iter().map(|candidate| candidate.at(share)))
    }

    /// Adds one corner if no triangle then enters the hull. Otherwise returns false.
    fn takes(&mut self, corner: DVec3) -> bool {
        if self.hull.is_empty() {
            return self.takes_these(std::iter::once(corner));
        }
        let mark = self.hull.mark();
        self.hull.insert(corner);
        match self.hull.gained_since(mark) {
            // The corner is already in the hull.
            None => true,
            Some(bounds) if self.is_entered(&bounds) => {
                self.hull.undo(mark);
                false
            }
            Some(_) => {
                self.hull.settle();
                true
            }
        }
    }

    /// Moves each candidate deeper, one after the other, as long as no triangle enters the hull.
    /// All candidates must already have been accepted at the fraction `share`.
    fn deepen(&mut self, candidates: &[Candidate], share: f64) -> Vec<DVec3> {
        let mut deeper = |candidate: &Candidate| {
            let shares = [1.0, 0.5 + 0.5 * share, 0.25 + 0.75 * share];
            candidate.at(shares.into_iter().find(|&share| self.takes(candidate.at(share))).unwrap_or(share))
        };
        candidates.iter().map(&mut deeper).collect()
    }

    /// Tries the candidates one after the other. Halves the distance of a candidate from the
    /// surface until no triangle enters the hull, and drops it after [`THICK_RETREATS`] halvings.
    fn take_singly(&mut self, candidates: &[Candidate]) -> Vec<DVec3> {
        let mut taken = Vec::new();
        for candidate in candidates {
            let depths = (0..=THICK_RETREATS).map(|k| candidate.at(0.5_f64.powi(k)));
            taken.extend(depths.into_iter().find(|&corner| self.takes(corner)));
        }
        taken
    }

    /// Returns true if a triangle outside the patch enters the hull. Tests only triangles near
    /// `bounds`.
    fn is_entered(&mut self, bounds: &Aabb) -> bool {
        let Self { facets, tree, members, hull, clipper, fence, noise, .. } = self;
        let depth = THICK_ENTERED * *noise;
        fence.clear();
        fence.extend(hull.planes().take(FENCE_PLANES));
        tree.any_below(bounds, fence, depth, |t, corners| {
            let stranger = members.binary_search(&facets.of_triangle(t)).is_err();
            stranger && clipper.enters(*corners, hull.planes(), depth)
        })
    }
}
