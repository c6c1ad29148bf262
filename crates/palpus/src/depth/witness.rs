//! Witness points of a facet of the CSO: the points where the two bodies would touch after a
//! separation along the facet's normal.
//!
//! After moving body a by `depth · normal`, the features of both bodies lie in one plane and share
//! a point, the witness. For a vertex against a face, the witness is the vertex; for crossing
//! edges, it is the crossing. Flush features (edge on face, face on face, edges along one line)
//! share a segment or a polygon. The witness is then the centroid of this segment or polygon, so a
//! box on a table has its contact under the middle of the box, not at a corner.
//!
//! If the features share no point, the facet is not a local minimum of h. This happens if the walk
//! ran out of steps, or if the facet was chosen for its normal instead of its depth. Then the
//! witness on b is the nearest point of b's supporting feature. The witness on a lies in a's
//! supporting plane, but not necessarily on body a.

mod validate;

use glam::DVec3;

use super::antipodal::{Corner, Facet, Flush};
use super::clip::clip;
use super::cso::Cso;
use super::walk::Walked;
use super::{Certainty, Depth};
use crate::algebra::tolerance::{CLIP_CORNERS, FLUSH_WITNESS, PARALLEL_EDGES};
use crate::algebra::{closest_on_segment, closest_segment_segment};

/// Buffers to clip one flush polygon by another. A call does not use the content from earlier
/// calls.
#[derive(Clone, Debug)]
pub(super) struct Clip {
    points: [DVec3; CLIP_CORNERS],
    spare: [DVec3; CLIP_CORNERS],
}

impl Clip {
    pub(super) fn new() -> Self {
        Self { points: [DVec3::ZERO; CLIP_CORNERS], spare: [DVec3::ZERO; CLIP_CORNERS] }
    }
}

/// Returns the depth where a walk ended, with its witness points.
#[inline]
pub(super) fn answer_at(cso: &Cso<'_>, walked: &Walked, clip: &mut Clip) -> Depth {
    let Walked { corner, alone, .. } = walked;
    let facet = if *alone { Facet::spanned(cso, corner) } else { Facet::at(cso, corner, FLUSH_WITNESS) };
    answer_on(cso, &facet, walked, clip)
}

/// Returns the depth and its witness points on a known facet.
#[inline]
pub(super) fn answer_on(cso: &Cso<'_>, facet: &Facet<'_>, walked: &Walked, clip: &mut Clip) -> Depth {
    let Walked { corner, steps, stop, .. } = walked;
    let (point_a, point_b) = witness(cso, facet, corner, clip);
    let answer = Depth {
        point_a,
        point_b,
        normal: corner.normal,
        depth: corner.offset,
        antipodal: corner.antipodal,
        hub: corner.hub,
        certainty: Certainty::LocallyOptimal,
        steps: *steps,
        stop: *stop,
    };
    debug_assert!(!answer.is_sampled() || answer.validate(cso) == Ok(()), "{:?}", answer.validate(cso));
    answer
}

/// The two flush features in b's supporting plane, after moving body a by the depth.
struct Contact<'c, 'p> {
    cso: &'c Cso<'p>,
    facet: &'c Facet<'p>,
    moved: DVec3,
}

impl Contact<'_, '_> {
    #[inline]
    fn a(&self, k: usize) -> DVec3 {
        self.cso.point_a(self.facet.a.corner(k)) + self.moved
    }

    #[inline]
    fn b(&self, k: usize) -> DVec3 {
        self.cso.b.vertex(self.facet.b.corner(k))
    }
}

/// Returns the witness points (on a, on b) of `facet` in b's frame. `corner` is the measured
/// corner of the facet.
///
/// The point on a minus the point on b is `−offset · normal` within rounding, for every facet.
pub(super) fn witness(cso: &Cso<'_>, facet: &Facet<'_>, corner: &Corner, clip: &mut Clip) -> (DVec3, DVec3) {
    let moved = facet.normal * corner.offset;
    let contact = Contact { cso, facet, moved };
    let touch = match (facet.a.count, facet.b.count) {
        (1, _) => nearest_of_polygon(contact.a(0), facet.normal, &facet.b, |k| contact.b(k)),
        (_, 1) => {
            // The vertex of b always lies on b. The point on a follows from this vertex.
            contact.b(0)
        }
        (2, 2) => edges(&contact),
        _ => overlap(&contact, clip),
    };
    // Projects the point into b's supporting plane. Features that are flush only within the
    // tolerance lie slightly off this plane.
    let touch = touch + facet.normal * facet.normal.dot(cso.b.vertex(corner.hub.b) - touch);
    (touch - moved, touch)
}

/// Returns `p` if `p` lies within the convex polygon, else the nearest point of the polygon's
/// boundary.
fn nearest_of_polygon(p: DVec3, normal: DVec3, flush: &Flush<'_>, corner: impl Fn(usize) -> DVec3) -> DVec3 {
    let mut within = flush.count > 2;
    let mut nearest = p;
    let mut distance = f64::INFINITY;
    for k in 0..flush.count {
        let (from, to) = (corner(k), corner(k + 1));
        if normal.dot((to - from).cross(p - from)) < 0.0 {
            within = false;
        }
        let q = from.lerp(to, closest_on_segment(p, from, to));
        let d = p.distance_squared(q);
        if d < distance {
            distance = d;
            nearest = q;
        }
    }
    if within { p } else { nearest }
}

#[inline]
fn edges(contact: &Contact<'_, '_>) -> DVec3 {
    let (p1, q1, p2, q2) = (contact.a(0), contact.a(1), contact.b(0), contact.b(1));
    let (d1, d2) = (q1 - p1, q2 - p2);
    let normal = d1.cross(d2);
    let across = normal.length_squared();
    if across > PARALLEL_EDGES * PARALLEL_EDGES * d1.length_squared() * d2.length_squared() {
        // The edges cross. Both edges lie in one plane within rounding.
        let r = p2 - p1;
        let (s, t) = (r.cross(d2).dot(normal), r.cross(d1).dot(normal));
        if s.min(t) > 0.0 && s.max(t) < across {
            return p2 + d2 * (t / across);
        }
        return closest_segment_segment(p1, q1, p2, q2).second;
    }
    // The edges lie along one line. The witness is the middle of their common part, in parameters
    // along b's edge.
    let along = |p: DVec3| closest_on_segment(p, p2, q2);
    p2 + d2 * (0.5 * (along(p1) + along(q1)))
}

/// Returns the centroid of the overlap of two flush features. At least one feature is a polygon.
fn overlap(contact: &Contact<'_, '_>, buffers: &mut Clip) -> DVec3 {
    let Facet { normal, a, b } = *contact.facet;
    let circle_a = circle(a.count, |k| contact.a(k));
    let circle_b = circle(b.count, |k| contact.b(k));
    let stray = || nearest_of_polygon(circle_a.0, normal, &b, |k| contact.b(k));
    if a.count + b.count > CLIP_CORNERS {
        return stray();
    }
    // The sides of the larger feature cut the smaller feature, because most of these sides miss the
    // smaller feature's bounding circle.
    let cut_a = a.count == 2 || b.count > 2 && circle_a.1 <= circle_b.1;
    let (middle, radius_squared) = if cut_a { circle_a } else { circle_b };
    let (mut count, sides) = if cut_a { (a.count, b.count) } else { (b.count, a.count) };
    for k in 0..count {
        buffers.points[k] = if cut_a { contact.a(k) } else { contact.b(k) };
    }
    let side_of = |k: usize| if cut_a { contact.b(k) } else { contact.a(sides - k) };
    let mut from = side_of(0);
    for k in 0..sides {
        // The loop of body a runs clockwise about the normal, so it is read backwards.
        let to = side_of(k + 1);
        let inward = normal.cross(to - from);
        let height = inward.dot(middle - from);
        let clear = height > 0.0 && height * height > radius_squared * inward.length_squared();
        if !clear {
            count = clip(&buffers.points[..count], &mut buffers.spare, |p| inward.dot(p - from), DVec3::lerp);
            std::mem::swap(&mut buffers.points, &mut buffers.spare);
        }
        if count == 0 {
            return stray();
        }
        from = to;
    }
    centroid(&buffers.points[..count], normal)
}

/// Returns the mean of some points, and the square of the largest distance of a point from the
/// mean.
fn circle(count: usize, point: impl Fn(usize) -> DVec3) -> (DVec3, f64) {
    let middle = (0..count).map(&point).sum::<DVec3>() / count as f64;
    (middle, (0..count).map(|k| point(k).distance_squared(middle)).fold(0.0, f64::max))
}

/// Returns the area centroid of a convex polygon. If the area is negligible, returns the centre of
/// the polygon's bounding box.
fn centroid(points: &[DVec3], normal: DVec3) -> DVec3 {
    let origin = points[0];
    let (mut low, mut high) = (origin, origin);
    for &p in points {
        low = low.min(p);
        high = high.max(p);
    }
    let (mut area, mut moment) = (0.0, DVec3::ZERO);
    for pair in points[1..].windows(2) {
        let (u, v) = (pair[0] - origin, pair[1] - origin);
        let twice = normal.dot(u.cross(v));
        area += twice;
        moment += (u + v) * (twice / 3.0);
    }
    if area.abs() > PARALLEL_EDGES * (high - low).length_squared() {
        origin + moment / area
    } else {
        (low + high) * 0.5
    }
}
