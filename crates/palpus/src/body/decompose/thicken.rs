//! Thick pieces: a patch's hull grows inward until another part of the surface is as near (beyond
//! \[K02\]).
//!
//! A piece that is the hull of two or three triangles of a bulky solid is a sliver: a point that
//! goes deeper than the sliver leaves it again, and the force vanishes. So a piece of a closed
//! surface gets further corners inside the solid:
//!
//! 1. From each vertex of the surface an *inward path* leads to the medial axis and along it toward
//!    where the solid is thicker (`way_in`). The path belongs to the vertex, so that neighbouring
//!    patches share it and their pieces leave no gap. A facet that is wide relative to the
//!    thickness below it has a further path from its middle.
//! 2. A piece takes those points of its paths that lie below all planes of its patch, so that every
//!    facet stays on the hull. The patch must also be the nearest surface there, or nearly: past
//!    the medial axis the piece would report its own large depth where another surface is nearer.
//! 3. Points that lie close together are merged. If many are left, those farthest apart are kept.
//! 4. No triangle of another patch may enter the hull of the patch and these points (see
//!    `contain`). If one does, all points are pulled back toward the surface by the same share
//!    until none does; then each point is moved deeper again by itself. If that fails, the points
//!    are tried one by one from the start.
//!
//! The patch's own facets stay original; a face with a corner inside is virtual. Pieces overlap a
//! little along the walls between them. A patch that is a whole convex component needs nothing. An
//! open surface has no inside: its pieces stay thin.
//!
//! Limits: one convex piece cannot be thick all along a thin wall that bends, so a large patch of a
//! coarse mesh leaves parts of such a wall uncovered. A patch of thousands of facets is not
//! thickened: its hull is already deep, and the cost of each corner would grow with the square of
//! the patch's size.

#[cfg(test)]
mod tests;
mod way_in;

use glam::DVec3;

use self::way_in::{WayPoint, way_in};
use crate::algebra::Plane;
use crate::algebra::tolerance::{
    FENCE_PLANES, FLAT_PATCH, THICK_CORNERS, THICK_ENTERED, THICK_HONEST, THICK_MERGED, THICK_PATCH, THICK_RETREATS,
    THICK_SHARES, WIDE_FACET,
};
use crate::body::decompose::Patch;
use crate::body::decompose::contain::Clipper;
use crate::body::decompose::facet::{Facets, Surface};
use crate::body::decompose::trial_hull::TrialHull;
use crate::body::{Aabb, TriangleTree};

pub(crate) use way_in::WaysIn;

/// The further corners of a patch's piece: inside the solid, below every facet of the patch; empty
/// without an inward path.
///
/// The result depends on the arguments alone, so pieces can be thickened in any order and in
/// parallel.
pub(crate) fn inner_corners(
    surface: &Surface<'_>,
    facets: &Facets,
    tree: &TriangleTree,
    ways: &WaysIn,
    patch: &Patch,
) -> Vec<DVec3> {
    if patch.facets.len() > THICK_PATCH {
        return Vec::new();
    }
    let wishes = few(wishes(surface, facets, tree, ways, patch));
    if wishes.is_empty() {
        return Vec::new();
    }
    let mut trial = Trial::new(surface, facets, tree, patch);
    let even = THICK_SHARES.into_iter().find(|&share| trial.takes_all(&wishes, share));
    match even {
        Some(share) if share < 1.0 => trial.deepen(&wishes, share),
        Some(_) => wishes.iter().map(|wish| wish.point).collect(),
        None => trial.take_singly(&wishes),
    }
}

/// A candidate for a further corner of a piece.
#[derive(Clone, Copy, Debug)]
struct Wish {
    /// The point of the surface at which its inward path starts.
    from: DVec3,
    point: DVec3,
    /// Its depth below the nearest plane of the patch.
    below: f64,
}

impl Wish {
    fn at(&self, share: f64) -> DVec3 {
        self.from.lerp(self.point, share)
    }
}

/// Steps 1 and 2: the points of all inward paths that the patch may take.
fn wishes(surface: &Surface<'_>, facets: &Facets, tree: &TriangleTree, ways: &WaysIn, patch: &Patch) -> Vec<Wish> {
    let mut wishes = Vec::new();
    let mut wish = |from: DVec3, way: &[WayPoint]| {
        for &WayPoint { point, distance } in way {
            let below = patch.facets.iter().map(|&f| -facets.plane(f).height(point)).fold(f64::INFINITY, f64::min);
            if below > FLAT_PATCH * surface.noise() && below <= THICK_HONEST * distance {
                wishes.push(Wish { from, point, below });
            }
        }
        wishes.iter().map(|wish: &Wish| wish.below).fold(0.0, f64::max)
    };
    let mut deepest = 0.0;
    for v in corners_of(facets, patch) {
        deepest = wish(surface.vertex(v), ways.of(v));
    }
    if !ways.reach(patch, facets) {
        return wishes;
    }
    let mut way = Vec::new();
    for &f in &patch.facets {
        let corners = facets.corners(f).iter().map(|&v| surface.vertex(v));
        let middle = corners.clone().sum::<DVec3>() / corners.len() as f64;
        let width = corners.map(|p| p.distance(middle)).fold(0.0, f64::max);
        if width > WIDE_FACET * deepest {
            way.clear();
            way_in(middle, &mut vec![facets.plane(f).normal], tree, surface.noise(), &mut way);
            wish(middle, &way);
        }
    }
    wishes
}

/// The vertices of a patch, ascending.
fn corners_of(facets: &Facets, patch: &Patch) -> Vec<u32> {
    let mut corners: Vec<u32> = patch.facets.iter().flat_map(|&f| facets.corners(f)).copied().collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// Step 3: takes the deepest point, then repeatedly the point farthest from all taken ones.
fn few(wishes: Vec<Wish>) -> Vec<Wish> {
    let mut taken: Vec<Wish> = Vec::new();
    let mut gaps = vec![f64::INFINITY; wishes.len()];
    while taken.len() < THICK_CORNERS {
        let far = |k: &usize| gaps[*k] > (THICK_MERGED * wishes[*k].below).powi(2);
        let better = |&i: &usize, &j: &usize| {
            gaps[i].total_cmp(&gaps[j]).then(wishes[i].below.total_cmp(&wishes[j].below)).then(j.cmp(&i))
        };
        let Some(next) = (0..wishes.len()).filter(far).max_by(better) else { break };
        let wish = wishes[next];
        taken.push(wish);
        for (gap, other) in gaps.iter_mut().zip(&wishes) {
            *gap = gap.min(other.point.distance_squared(wish.point));
        }
    }
    taken
}

/// Step 4: tests hulls of the patch and further corners against the surface.
struct Trial<'a> {
    facets: &'a Facets,
    tree: &'a TriangleTree,
    /// The patch's facets, ascending.
    members: Vec<u32>,
    /// The patch's vertices, followed during a trial by the corners being tried.
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

    /// Makes the hull of the patch and these corners. Returns false, without a hull, if the hull is
    /// flat or a triangle enters it.
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

    /// All corners at once, each at the same share of its distance from the surface.
    fn takes_all(&mut self, wishes: &[Wish], share: f64) -> bool {
        self.takes_these(wishes.iter().map(|wish| wish.at(share)))
    }

    /// Adds one corner if no triangle enters the larger hull.
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

    /// Takes corners that the hull accepts at a common `share` of their distance, and then moves
    /// each one deeper, in turn, if the hull accepts that.
    fn deepen(&mut self, wishes: &[Wish], share: f64) -> Vec<DVec3> {
        let mut deeper = |wish: &Wish| {
            let shares = [1.0, 0.5 + 0.5 * share, 0.25 + 0.75 * share];
            wish.at(shares.into_iter().find(|&share| self.takes(wish.at(share))).unwrap_or(share))
        };
        wishes.iter().map(&mut deeper).collect()
    }

    /// Tries the corners one after the other. Each is moved half way back to the surface until the
    /// hull accepts it.
    fn take_singly(&mut self, wishes: &[Wish]) -> Vec<DVec3> {
        let mut taken = Vec::new();
        for wish in wishes {
            let depths = (0..=THICK_RETREATS).map(|k| wish.at(0.5_f64.powi(k)));
            taken.extend(depths.into_iter().find(|&corner| self.takes(corner)));
        }
        taken
    }

    /// True if a triangle outside the patch enters the hull; looks only near `bounds`.
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
