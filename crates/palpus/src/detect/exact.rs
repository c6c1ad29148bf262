//! The distance of two meshes, from the distances of their pieces.
//!
//! The faces of a piece differ from the triangles of the mesh by the *deviation* of the piece. The
//! deviation is relative to the size of the body. Beside a large body, a small body would get a
//! distance that is wrong by a larger share of its own size. Therefore a distance query ends at the
//! triangles:
//!
//! 1. The search over the pieces returns all pairs whose distance exceeds the least one by at most
//!    the largest deviations of both bodies ([`slack`]). One of these pairs has the nearest
//!    triangles.
//! 2. If neither piece of a pair has a deviation, the faces of both are the triangles, and the
//!    distance of the pair stays.
//! 3. Otherwise all triangles that can be nearest lie beside the closest points, in a thin slab
//!    perpendicular to their normal. The trees over the triangles find these triangles.
//! 4. The closest points of the nearest pair of triangles replace those of the pieces. The normal
//!    is that of a triangle, or is perpendicular to two edges, if the points lie there.
//!
//! If triangles cross although the pieces are apart, the distance of the pieces stays. It is less
//! than twice their deviations.

use std::cell::Cell;
use std::ops::ControlFlow;

use glam::DVec3;

use super::Contact;
use crate::algebra::tolerance::MARCH_NOISE;
use crate::algebra::{Placement, closest_on_triangles};
use crate::body::{Aabb, Body, TrianglePair};

/// Two bodies at a pose.
#[derive(Clone, Copy)]
pub(super) struct Placed<'q> {
    pub(super) a: &'q Body,
    pub(super) b: &'q Body,
    /// a placed in b's frame.
    pub(super) place: &'q Placement,
}

/// Returns the nearest of these contacts of pieces that are apart, with the distance, the points
/// and the normal of the meshes.
pub(super) fn nearest_on_meshes(placed: &Placed<'_>, apart: impl Iterator<Item = Contact> + Clone) -> Option<Contact> {
    let first = apart.clone().min_by(|x, y| x.separation.total_cmp(&y.separation))?;
    let mut best = on_meshes(placed, &first, f64::INFINITY)?;
    for contact in apart.filter(|contact| *contact != first) {
        best = on_meshes(placed, &contact, best.separation).unwrap_or(best);
    }
    Some(best)
}

/// Returns the contact of two pieces that are apart with the distance, the points and the normal of
/// the meshes; `None` if the meshes are not nearer than the limit there.
pub(super) fn on_meshes(placed: &Placed<'_>, contact: &Contact, limit: f64) -> Option<Contact> {
    let deviation = deviation(placed, [contact.piece_a, contact.piece_b]);
    // The separation of extremely distant bodies may be infinite.
    let known = Some(*contact).filter(|contact| limit == f64::INFINITY || contact.separation < limit);
    if contact.separation <= 0.0 || deviation == 0.0 {
        return known;
    }
    let [s, t] = match nearest_triangles(placed, contact, deviation, limit) {
        Nearest::Pair(pair) => pair,
        Nearest::Crossing => return known,
        Nearest::Nothing => return known.filter(|_| limit == f64::INFINITY),
    };
    let [on_a, on_b] = closest_on_triangles(&s, &t);
    let apart = on_a - on_b;
    let normal = normal_between(&s, &t, apart, contact.normal);
    let separation = normal.dot(apart);
    let point_a = on_b + normal * separation;
    if separation > 0.0 { Some(Contact { point_a, point_b: on_b, normal, separation, ..*contact }) } else { known }
}

fn deviation(placed: &Placed<'_>, [piece_a, piece_b]: [u32; 2]) -> f64 {
    placed.a.deviations().of(piece_a) + placed.b.deviations().of(piece_b)
}

/// Returns the largest distance by which pieces of both bodies differ from the meshes.
pub(super) fn slack(a: &Body, b: &Body) -> f64 {
    a.deviations().most() + b.deviations().most()
}

/// The nearest triangles of two meshes beside the closest points of two pieces.
enum Nearest {
    /// The triangles of a and of b, in b's frame.
    Pair([[DVec3; 3]; 2]),
    /// Some triangles cross.
    Crossing,
    /// No triangles are near enough.
    Nothing,
}

/// Does step 3, for triangles nearer than the limit.
fn nearest_triangles(placed: &Placed<'_>, contact: &Contact, deviation: f64, limit: f64) -> Nearest {
    let Contact { point_a, point_b, normal, separation, .. } = *contact;
    let place = placed.place;
    let piece_a = &placed.a.polytopes()[contact.piece_a as usize];
    let piece_b = &placed.b.polytopes()[contact.piece_b as usize];
    let (tree_a, tree_b) = (placed.a.tree(), placed.b.tree());
    // On each body, a point of such a pair of triangles lies below the piece's closest point by at
    // most the deviation plus the excess of the triangles' distance over the pieces' distance.
    let surplus = 2.0 * deviation;
    let slab_a = Slab::new(place.inverse_vector(-normal), place.inverse_point(point_a), surplus + deviation);
    let slab_b = Slab::new(normal, point_b, surplus + deviation);
    let around_a = Ball { middle: piece_a.centroid(), radius: piece_a.radius() + deviation };
    let rounding = MARCH_NOISE * (separation + piece_a.radius().min(piece_b.radius()));
    let may_cross = separation <= surplus;
    let least = Cell::new(limit.min(separation + surplus));
    let mut best = None;
    let of_a = |bounds: &Aabb| {
        let ball = Ball::around(bounds);
        slab_a.holds(slab_a.highest(&ball, bounds)) && ball.gap(&around_a) <= 0.0
    };
    let ended = tree_a.descend(of_a, |slot| {
        if !slab_a.holds(slab_a.highest_corner(&tree_a.corners[slot])) {
            return ControlFlow::Continue(());
        }
        let s = tree_a.corners[slot].map(|p| place.point(p));
        let ball = Ball::of(&s);
        let low = -s.iter().map(|p| -normal.dot(*p)).fold(f64::NEG_INFINITY, f64::max);
        // The distance is at least the gap along the normal and the gap beside it.
        let may_be_nearer = |high: f64, other: &Ball| {
            let (along, beside) = ((low - high).max(0.0), ball.gap_beside(other, normal).max(0.0));
            slab_b.holds(high) && along * along + beside * beside < (least.get() - rounding).powi(2)
        };
        let of_b = |bounds: &Aabb| {
            let ball = Ball::around(bounds);
            may_be_nearer(slab_b.highest(&ball, bounds), &ball)
        };
        tree_b.descend(of_b, |slot| {
            let t = tree_b.corners[slot];
            if !may_be_nearer(slab_b.highest_corner(&t), &Ball::of(&t)) {
                return ControlFlow::Continue(());
            }
            if may_cross && TrianglePair::new(s, t) != TrianglePair::Apart {
                return ControlFlow::Break(());
            }
            let [on_a, on_b] = closest_on_triangles(&s, &t);
            let distance = on_a.distance(on_b);
            if distance < least.get() {
                least.set(distance);
                best = Some([s, t]);
            }
            ControlFlow::Continue(())
        })
    });
    if ended.is_break() { Nearest::Crossing } else { best.map_or(Nearest::Nothing, Nearest::Pair) }
}

/// The part of space above a plane just below a point, in a body's frame.
struct Slab {
    outward: DVec3,
    least: f64,
}

impl Slab {
    /// `outward` is a unit vector. The plane lies `below` under `point`.
    fn new(outward: DVec3, point: DVec3, below: f64) -> Self {
        Self { outward, least: outward.dot(point) - below }
    }

    /// Returns true if the slab reaches down to this height.
    fn holds(&self, height: f64) -> bool {
        height >= self.least
    }

    /// Returns the greatest height of a point of a box. `ball` is the ball around the box.
    fn highest(&self, ball: &Ball, bounds: &Aabb) -> f64 {
        self.outward.dot(ball.middle) + 0.5 * self.outward.abs().dot(bounds.max - bounds.min)
    }

    fn highest_corner(&self, corners: &[DVec3; 3]) -> f64 {
        corners.iter().map(|p| self.outward.dot(*p)).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// A ball around a box or a triangle.
struct Ball {
    middle: DVec3,
    radius: f64,
}

impl Ball {
    fn around(bounds: &Aabb) -> Self {
        Self { middle: 0.5 * (bounds.min + bounds.max), radius: 0.5 * bounds.min.distance(bounds.max) }
    }

    fn of(corners: &[DVec3; 3]) -> Self {
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        Self { middle, radius: corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max) }
    }

    fn gap(&self, other: &Self) -> f64 {
        self.middle.distance(other.middle) - self.radius - other.radius
    }

    /// Returns the gap between two balls that are projected along a unit vector.
    fn gap_beside(&self, other: &Self, along: DVec3) -> f64 {
        let apart = other.middle - self.middle;
        (apart - along * along.dot(apart)).length() - self.radius - other.radius
    }
}

/// Returns the unit normal of the closest points of two triangles, which are `apart`. Rounding
/// tilts the line between near points. The normal of a triangle and the direction across two edges
/// are exact. Such a direction is returned if it is parallel to the line within the rounding of the
/// points.
fn normal_between(s: &[DVec3; 3], t: &[DVec3; 3], apart: DVec3, known: DVec3) -> DVec3 {
    let largest = s.iter().chain(t).map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let rounding = MARCH_NOISE * largest;
    let mut best = apart.try_normalize().filter(|_| apart.length() > rounding).unwrap_or(known);
    let mut least = rounding;
    let mut consider = |direction: DVec3| {
        let normal = direction.normalize_or_zero();
        let along = normal.dot(apart);
        let beside = (apart - normal * along).length();
        if beside < least && along != 0.0 {
            (best, least) = (normal * along.signum(), beside);
        }
    };
    let sides = |t: &[DVec3; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (of_s, of_t) = (sides(s), sides(t));
    for [d, e, _] in [of_s, of_t] {
        consider(d.cross(e));
    }
    for d in of_s {
        of_t.iter().for_each(|e| consider(d.cross(*e)));
    }
    best
}
