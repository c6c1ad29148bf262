//! Contact patches: the corners of the overlap of two pieces that are flush or nearly flush. \[K02
//! §3.3.3\] does not treat this case.
//!
//! If a face rests on a face, many points are equally close. A single point does not determine how
//! the pair resists a tilt, and the exact witness jumps between the points. A patch represents all
//! these points. Its corners span the overlap, and each corner has a gap. A load at any point of
//! the overlap is a combination of loads at the corners.
//!
//! The *contact frame* has its z axis along the normal. The gap at a place (x, y) is the height of
//! a's lower surface minus the height of b's upper surface. The gap is a convex function of the
//! place, and is linear between the corners. So the corners determine the gap:
//!
//! 1. *Outlines*: around the contact's feature on each piece, find the original faces whose slope
//!    relative to the contact plane is less than `slope`. Each of these faces gives a polygon. If
//!    no face is that flat, use the edges at the feature whose slope is less than `slope`. A steep
//!    feature has no outline, and the witness is the only contact point.
//! 2. *Overlap*: clip the projection of each outline of body a by the projection of each outline of
//!    b. The gap at a corner is the height of a's plane above b's plane.
//! 3. *Sides beside each other*: two nearly parallel sides may pass each other without an overlap.
//!    The ends of their common stretch become corners. The gap at these corners is the height plus
//!    the lateral distance; beside a valley, it is the gap of this valley ([`gap_beside`]). Two
//!    parallel edges have no overlap; their patch is the common stretch.
//! 4. *Duplicates*: merge corners that coincide. Add the exact witness if it is deeper than every
//!    corner.
//! 5. *Flat faces of several pieces*: a flat face of a mesh may continue beyond a piece. A corner
//!    that is inside the region that both flat faces have in common, or at its rim but not at a
//!    convex corner, is never the lowest point, however the bodies tilt. Mark these corners, and
//!    leave out those inside, except the first.
//!
//! [`crate::force::TiltShares`] computes the weight of each corner, for all contacts of a pair of
//! bodies at once. The weight is the range of tilts (up to the slope) at which the bodies would
//! stand on that corner. A corner may appear or disappear while the bodies slide, turn or tilt.
//! At that moment the corner's weight is zero. The corner then coincides with another corner, lies
//! on the line between two corners, or belongs to a face that is as steep as the slope. If a piece
//! has more flat faces than a patch can contain, the slope is reduced to the slope of the first
//! omitted face. The reduced slope also changes continuously.
//!
//! If an outline has many sides, it keeps only every n-th corner, and the same corners at every
//! pose.

mod outline;

use glam::{DVec2, DVec3};

use self::outline::{Frame, Half, Outline, Outlines, Side};
use super::clip::clip;
use super::cso::Cso;
use crate::algebra::Placement;
use crate::algebra::tolerance::{PATCH_CORNERS, PATCH_SAME, PATCH_SIDES};
use crate::body::{Border, Feature, FeaturePair, FlatAround, Polytope, gap_beside};

/// A contact for which a patch is searched, in b's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    /// The features on which the exact witness points lie.
    pub features: FeaturePair,
    /// Exact witness point on body a.
    pub point_a: DVec3,
    /// Exact witness point on b.
    pub point_b: DVec3,
    /// Unit vector from body b into body a.
    pub normal: DVec3,
}

/// A corner of a patch, in b's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    /// The point halfway between the two surfaces.
    pub midpoint: DVec3,
    /// Distance between the surfaces along the contact's normal (length unit of the polytopes). The
    /// value is negative if the surfaces overlap at the corner.
    pub separation: f64,
    /// The faces or edges on which the corner lies.
    pub features: FeaturePair,
    /// See [`crate::detect::Contact::inside`].
    pub inside: bool,
}

/// Working memory for one patch, and its result.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    outlines: [Outlines; 2],
    found: FoundCorners,
    corners: Vec<Corner>,
}

/// The corners found so far, and working memory to clip outlines.
#[derive(Clone, Debug)]
struct FoundCorners {
    list: [Found; PATCH_CORNERS],
    count: usize,
    clipped: [[DVec2; 2 * PATCH_SIDES]; 2],
}

/// Which corners belong to a patch.
#[derive(Clone, Copy)]
struct PatchRange {
    /// Largest tilt, as a tangent.
    slope: f64,
    /// Largest separation (length unit of the polytopes).
    within: f64,
    /// Places nearer to each other than this are the same (length unit of the polytopes).
    rounding: f64,
}

/// A side of an outline of a, and a nearly parallel side of an outline of b.
#[derive(Clone, Copy)]
struct Sides<'o> {
    a: &'o Outline,
    b: &'o Outline,
    side_a: Side,
    side_b: Side,
    /// For a and for b: true if the side is a valley.
    valleys: [bool; 2],
}

/// Where a corner is in the region that two flat faces of the meshes have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    /// At a convex corner of the region, or not in such a region.
    Corner,
    /// At its rim, but not at a convex corner. No tilt makes this point the lowest.
    Rim,
    /// Inside.
    Inside,
}

impl Standing {
    /// Returns the standing of a point from how much of its neighbourhood belongs to each face.
    fn of(one: Option<FlatAround>, other: impl FnOnce() -> Option<FlatAround>) -> Self {
        use FlatAround::{All, Half};
        // Most points are at corners of the first face.
        let Some(one @ (All | Half)) = one else { return Self::Corner };
        match (one, other()) {
            (All, Some(All)) => Self::Inside,
            (All, Some(Half)) | (Half, Some(All)) => Self::Rim,
            _ => Self::Corner,
        }
    }

    /// Returns the standing of `place`, on the outlines of the two pieces on which it lies. If it
    /// lies on several, the one with the least of its neighbourhood counts.
    fn at(place: DVec2, [a, b]: [(&Half<'_>, &Outlines); 2], slope: f64, rounding: f64) -> Self {
        let around = |(half, outlines): (&Half<'_>, &Outlines)| {
            outlines.list().iter().filter_map(|one| one.around(half, place, slope, rounding)).max()
        };
        Self::of(around(a), || around(b))
    }
}

/// A corner in the contact frame.
#[derive(Clone, Copy, Debug)]
struct Found {
    place: DVec2,
    /// Height of the midpoint between the surfaces.
    height: f64,
    gap: f64,
    features: FeaturePair,
}

impl Patch {
    /// Allocates all the memory that a patch needs.
    pub(crate) fn new() -> Self {
        let nowhere = Found {
            place: DVec2::ZERO,
            height: 0.0,
            gap: 0.0,
            features: FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) },
        };
        Self {
            outlines: [Outlines::NONE; 2],
            found: FoundCorners {
                list: [nowhere; PATCH_CORNERS],
                count: 0,
                clipped: [[DVec2::ZERO; 2 * PATCH_SIDES]; 2],
            },
            corners: Vec::with_capacity(PATCH_CORNERS),
        }
    }

    /// Finds the corners of the contact `touch` for tilts up to `slope` (tangent of the angle).
    /// Keeps the corners whose separation is less than `within` (length unit of the polytopes).
    /// The borders are those of a and of b. Returns the slope up to which no corner is missing.
    ///
    /// The first of [`Self::corners`] is the deepest corner if it is as deep as the witness, else
    /// the witness.
    pub(crate) fn find(
        &mut self,
        [a, b]: [&Polytope; 2],
        [border_a, border_b]: &[Border<'_>; 2],
        pose_ba: &Placement,
        touch: &Touch,
        slope: f64,
        within: f64,
    ) -> f64 {
        let separation = touch.normal.dot(touch.point_a - touch.point_b);
        let frame = Frame::about(touch);
        self.found.count = 0;
        self.corners.clear();
        self.corners.push(Corner { midpoint: frame.origin, separation, features: touch.features, inside: false });
        let half_a = Half { polytope: a, border: border_a, frame: frame.seen_from(pose_ba), outward: -1.0 };
        let half_b = Half { polytope: b, border: border_b, frame, outward: 1.0 };
        let rounding = || PATCH_SAME * Cso { a, b, pose_ba }.size();
        let continues = border_a.has_inner() || border_b.has_inner();
        let witness_is_inside = |rounding: f64| {
            let around = |half: &Half<'_>, feature| Some(half.around_origin(feature, slope, rounding));
            let [a, b] = [&half_a, &half_b];
            Standing::of(around(a, touch.features.a), || around(b, touch.features.b)) != Standing::Corner
        };
        let [outlines_a, outlines_b] = &mut self.outlines;
        outlines_a.gather(&half_a, touch.features.a, slope);
        if outlines_a.count == 0 {
            self.corners[0].inside = continues && witness_is_inside(rounding());
            return outlines_a.slope;
        }
        outlines_b.gather(&half_b, touch.features.b, slope);
        let (slope, rounding) = (outlines_a.slope.min(outlines_b.slope), rounding());
        for first in outlines_a.list() {
            for second in outlines_b.list() {
                self.found.overlap(first, second, rounding);
                self.found.beside(first, second, &PatchRange { slope, within, rounding });
            }
        }
        let [outlines_a, outlines_b] = &self.outlines;
        let standing = |place: DVec2| match continues {
            true => Standing::at(place, [(&half_a, outlines_a), (&half_b, outlines_b)], slope, rounding),
            false => Standing::Corner,
        };
        let range = PatchRange { slope, within, rounding };
        if !write(self.found.list(), &mut self.corners, &frame, &range, standing) {
            self.corners[0].inside = continues && witness_is_inside(rounding);
        }
        slope
    }

    /// Returns the corners of the last patch.
    pub(crate) fn corners(&self) -> &[Corner] {
        &self.corners
    }
}

/// Adds the corners whose separation is less than the range, and that are not inside flat faces.
/// The first of `corners` is the witness. It is replaced by the deepest corner if this is as deep;
/// then the result is true.
fn write(
    found: &[Found],
    corners: &mut Vec<Corner>,
    frame: &Frame,
    range: &PatchRange,
    standing: impl Fn(DVec2) -> Standing,
) -> bool {
    let separation = corners[0].separation;
    let corner = |found: &Found, standing| {
        let midpoint = frame.origin + frame.x * found.place.x + frame.y * found.place.y + frame.z * found.height;
        // A gap must not be less than the separation. The computed gap can be less, because the
        // planes of merged faces are exact only within the flatness tolerance.
        let separation = found.gap.max(separation);
        Corner { midpoint, separation, features: found.features, inside: standing != Standing::Corner }
    };
    let deepest = (0..found.len()).min_by(|&i, &j| found[i].gap.total_cmp(&found[j].gap));
    let Some(deepest) = deepest else { return false };
    let is_written = found[deepest].gap <= separation + range.rounding;
    if is_written {
        corners[0] = Corner { separation, ..corner(&found[deepest], standing(found[deepest].place)) };
    }
    for (k, other) in found.iter().enumerate() {
        if is_written && k == deepest || other.gap >= range.within {
            continue;
        }
        let standing = standing(other.place);
        if standing != Standing::Inside {
            corners.push(corner(other, standing));
        }
    }
    is_written
}

impl FoundCorners {
    fn list(&self) -> &[Found] {
        &self.list[..self.count]
    }

    /// Does step 2 of the module's list.
    fn overlap(&mut self, a: &Outline, b: &Outline, rounding: f64) {
        if a.is_segment() && b.is_segment() {
            if let Some(place) = crossing(a.side(0).ends(), b.side(0).ends()) {
                self.add_overlap(a, b, place, rounding);
            }
            return;
        }
        // A polygon can cut a segment, but a segment cannot cut a polygon.
        let (cut, knife) = if b.is_segment() { (b, a) } else { (a, b) };
        let mut count = cut.count;
        self.clipped[0][..count].copy_from_slice(cut.corners());
        let mut now = 0;
        for side in (0..knife.count).map(|k| knife.side(k)) {
            let [even, odd] = &mut self.clipped;
            let (points, kept) = if now == 0 { (even, odd) } else { (odd, even) };
            count = clip(&points[..count], kept, |p| side.inward(p), DVec2::lerp);
            now = 1 - now;
        }
        for k in 0..count {
            self.add_overlap(a, b, self.clipped[now][k], rounding);
        }
    }

    /// Does step 3 of the module's list.
    fn beside(&mut self, a: &Outline, b: &Outline, range: &PatchRange) {
        for i in 0..a.side_count() {
            let side_a = a.side(i);
            for j in 0..b.side_count() {
                let side_b = b.side(j);
                let across = side_a.along.perp_dot(side_b.along);
                let lengths = side_a.along.length_squared() * side_b.along.length_squared();
                if across * across > range.slope * range.slope * lengths {
                    continue;
                }
                let sides = Sides { a, b, side_a, side_b, valleys: [a.is_valley(i), b.is_valley(j)] };
                for p in side_a.ends() {
                    if let Some(q) = side_b.foot(p) {
                        self.add_beside(&sides, [p, q], range);
                    }
                }
                for q in side_b.ends() {
                    if let Some(p) = side_a.foot(q) {
                        self.add_beside(&sides, [p, q], range);
                    }
                }
            }
        }
    }

    /// Adds the place between p (on a's side) and q (on b's side), if the two sides are beside each
    /// other at this place. Beside a valley, adds the point that is not on the valley.
    fn add_beside(&mut self, sides: &Sides<'_>, [p, q]: [DVec2; 2], range: &PatchRange) {
        let Sides { a, b, side_a, side_b, valleys } = *sides;
        let lateral = p.distance(q);
        let outside = (a.is_segment() || side_a.inward(q) < 0.0) && (b.is_segment() || side_b.inward(p) < 0.0);
        if !outside || lateral >= range.slope * side_a.along.length().min(side_b.along.length()) {
            return;
        }
        let place = match valleys {
            [true, false] => q,
            [false, true] => p,
            _ => p.midpoint(q),
        };
        let (above, below) = (a.height(place), b.height(place));
        let height = above - below;
        let gap = match valleys {
            [false, false] => height + lateral,
            _ => gap_beside(height, height.hypot(lateral), range.within),
        };
        let middle = match valleys {
            [true, false] => below + 0.5 * gap,
            [false, true] => above - 0.5 * gap,
            _ => 0.5 * (above + below),
        };
        let features = FeaturePair { a: a.feature, b: b.feature };
        self.add(Found { place, height: middle, gap, features }, range.rounding);
    }

    /// Adds a corner at a place where the outlines overlap.
    fn add_overlap(&mut self, a: &Outline, b: &Outline, place: DVec2, rounding: f64) {
        let (above, below) = (a.height(place), b.height(place));
        let features = FeaturePair { a: a.feature, b: b.feature };
        let (height, gap) = (0.5 * (above + below), above - below);
        self.add(Found { place, height, gap, features }, rounding);
    }

    /// Does step 4: adds a corner. If a corner already exists at its place, keeps the deeper of the
    /// two corners.
    fn add(&mut self, found: Found, rounding: f64) {
        let same = |known: &&mut Found| known.place.distance_squared(found.place) <= rounding * rounding;
        if let Some(known) = self.list[..self.count].iter_mut().find(same) {
            if found.gap < known.gap {
                *known = found;
            }
        } else if self.count < self.list.len() {
            self.list[self.count] = found;
            self.count += 1;
        }
    }
}

impl Default for Patch {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the intersection of two segments. `None` if the segments do not cross.
fn crossing([p, q]: [DVec2; 2], [r, s]: [DVec2; 2]) -> Option<DVec2> {
    let (along, other) = (q - p, s - r);
    let across = along.perp_dot(other);
    let (t, u) = ((r - p).perp_dot(other) / across, (r - p).perp_dot(along) / across);
    ((0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&u)).then(|| p + along * t)
}

#[cfg(test)]
mod tests;
