//! Tests whether two triangles cross, overlap or touch. Uses only exact predicates.
//!
//! Corners with equal coordinates count as one shared vertex. The points of a shared vertex or edge
//! do not count as common points. Therefore neighbours in a valid mesh are [`TrianglePair::Apart`].
//!
//! 1. For each triangle, find on which side of its plane the corners of the other triangle lie. If
//!    all corners lie strictly on one side, the triangles are apart. If all corners lie in the
//!    plane, the triangles are coplanar. Then drop one coordinate, which is an exact projection,
//!    and test in two dimensions.
//! 2. If each triangle has corners strictly on both sides of the other's plane, each triangle meets
//!    the common line of the planes in an interval. The triangles cross if the open intervals
//!    overlap. Two more predicates decide whether the intervals overlap (Guigue and Devillers,
//!    *Fast and Robust Triangle–Triangle Overlap Test*, 2003).
//! 3. If the triangles do not cross, they touch if an edge of one triangle meets the other
//!    triangle. If the triangles share one vertex, only the two edges opposite the vertex need a
//!    test. The intersection is convex and contains the shared vertex. So if the intersection has
//!    other points, it reaches one of these edges.
//!
//! The triangles must have a positive area. Otherwise the result is meaningless, but the functions
//! do not panic.

use glam::{DVec2, DVec3};

/// Relation of two triangles, without the points of a shared vertex or edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TrianglePair {
    /// The triangles have no common points except those of a shared vertex or a shared edge.
    Apart,
    /// The triangles have other common points, but their interiors neither cross nor overlap.
    Touching,
    /// The triangles are not coplanar, and their interiors have a common segment.
    Crossing,
    /// The triangles are coplanar, and their interiors have a common area. This includes two
    /// triangles with the same three corners.
    CoplanarOverlap,
}

impl TrianglePair {
    /// Returns the relation of the triangles with corners `a` and `b`.
    pub fn new(a: [DVec3; 3], b: [DVec3; 3]) -> Self {
        let sides_of_a = sides(&b, &a);
        if one_sided(sides_of_a) {
            return Self::Apart;
        }
        let shared = Shared::new(&a, &b);
        if shared.count == 2 && sides_of_a.iter().any(|&side| side != 0.0) {
            return Self::Apart;
        }
        let sides_of_b = sides(&a, &b);
        if one_sided(sides_of_b) {
            return Self::Apart;
        }
        if sides_of_a.iter().chain(&sides_of_b).all(|&side| side == 0.0) {
            return coplanar(&a, &b, &shared);
        }
        if straddles(sides_of_a) && straddles(sides_of_b) && intervals_overlap(a, sides_of_a, b, sides_of_b) {
            return Self::Crossing;
        }
        if touching(&a, &b, &shared) { Self::Touching } else { Self::Apart }
    }
}

/// Returns on which side of the plane of `abc` the point `p` lies. The result is positive on the
/// side to which the normal (b − a) × (c − a) points, and zero in the plane. The sign is exact. The
/// value is approximately six times the volume of the tetrahedron.
#[inline]
pub(crate) fn side_of_plane(a: DVec3, b: DVec3, c: DVec3, p: DVec3) -> f64 {
    let coord = |p: DVec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
    -robust::orient3d(coord(a), coord(b), coord(c), coord(p))
}

/// Returns twice the signed area of `abc`. The area is positive if the corners are
/// counter-clockwise. The sign is exact.
#[inline]
pub(crate) fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Returns true if `p` is in the closed triangle. `p` must lie in the plane of the triangle. The
/// test is exact.
pub(crate) fn holds_coplanar_point(triangle: &[DVec3; 3], p: DVec3) -> bool {
    let Some(flatten) = projection(triangle) else { return false };
    let ([a, b, c], p) = (triangle.map(flatten), flatten(p));
    let turns = [turn(a, b, p), turn(b, c, p), turn(c, a, p)];
    turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
}

/// Returns true if the closed segment from `p` to `q` meets the closed triangle. The test is exact.
pub(crate) fn segment_meets_triangle(p: DVec3, q: DVec3, triangle: &[DVec3; 3]) -> bool {
    let [a, b, c] = *triangle;
    let (side_p, side_q) = (side_of_plane(a, b, c, p), side_of_plane(a, b, c, q));
    if (side_p > 0.0 && side_q > 0.0) || (side_p < 0.0 && side_q < 0.0) {
        return false;
    }
    if side_p == 0.0 && side_q == 0.0 {
        let Some(flatten) = projection(triangle) else { return false };
        let ([a, b, c], [p, q]) = (triangle.map(flatten), [p, q].map(flatten));
        return !separated(&[a, b, c], &[p, q], true);
    }
    let turns = [side_of_plane(p, q, a, b), side_of_plane(p, q, b, c), side_of_plane(p, q, c, a)];
    turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
}

/// The corners that two triangles share.
struct Shared {
    count: usize,
    /// The last shared corner: its index in `a` and its index in `b`.
    corner: Option<(usize, usize)>,
}

impl Shared {
    fn new(a: &[DVec3; 3], b: &[DVec3; 3]) -> Self {
        let mut answer = Self { count: 0, corner: None };
        for (i, p) in a.iter().enumerate() {
            if let Some(j) = b.iter().position(|q| q == p) {
                answer.count += 1;
                answer.corner = Some((i, j));
            }
        }
        answer
    }
}

/// Returns the side of the triangle's plane on which each point lies. The exact predicate is
/// slowest if the result is zero. Therefore the two most common zero cases are tested first: a
/// corner of the triangle, and a point in an axis-aligned plane.
fn sides(triangle: &[DVec3; 3], points: &[DVec3; 3]) -> [f64; 3] {
    let [a, b, c] = *triangle;
    let level = a.cmpeq(b) & b.cmpeq(c);
    points.map(
        |p| {
            if p == a || p == b || p == c || (level & a.cmpeq(p)).any() { 0.0 } else { side_of_plane(a, b, c, p) }
        },
    )
}

fn one_sided(sides: [f64; 3]) -> bool {
    sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0)
}

fn straddles(sides: [f64; 3]) -> bool {
    sides.iter().any(|&s| s > 0.0) && sides.iter().any(|&s| s < 0.0)
}

/// Returns true if the two triangles cross. Each must have corners strictly on both sides of the
/// other's plane. Each triangle meets the common line of the planes in an open interval. The
/// triangles cross if these intervals overlap.
fn intervals_overlap(a: [DVec3; 3], sides_of_a: [f64; 3], b: [DVec3; 3], sides_of_b: [f64; 3]) -> bool {
    let ([p1, mut q1, mut r1], a_above) = loner_first(a, sides_of_a);
    let ([p2, mut q2, mut r2], b_above) = loner_first(b, sides_of_b);
    // Orients each triangle so that the other's single corner is above it. Then both intervals have
    // the same direction.
    if !a_above {
        std::mem::swap(&mut q2, &mut r2);
    }
    if !b_above {
        std::mem::swap(&mut q1, &mut r1);
    }
    side_of_plane(p2, p1, q1, q2) < 0.0 && side_of_plane(p2, p1, r1, r2) > 0.0
}

/// Rotates the list of corners so that the first corner is alone on its side of the other
/// triangle's plane. Returns the corners, and true if the first corner is above the plane.
fn loner_first(corners: [DVec3; 3], sides: [f64; 3]) -> ([DVec3; 3], bool) {
    let above = sides.iter().filter(|&&s| s > 0.0).count() == 1;
    let first = sides.iter().position(|&s| if above { s > 0.0 } else { s < 0.0 }).unwrap_or(0);
    ([corners[first], corners[(first + 1) % 3], corners[(first + 2) % 3]], above)
}

/// Returns true if the triangles have a common point other than a shared vertex. The triangles must
/// not cross, must not be coplanar, and may share at most one vertex.
fn touching(a: &[DVec3; 3], b: &[DVec3; 3], shared: &Shared) -> bool {
    if let Some((i, j)) = shared.corner {
        return segment_meets_triangle(a[(i + 1) % 3], a[(i + 2) % 3], b)
            || segment_meets_triangle(b[(j + 1) % 3], b[(j + 2) % 3], a);
    }
    (0..3).any(|k| segment_meets_triangle(a[k], a[(k + 1) % 3], b))
        || (0..3).any(|k| segment_meets_triangle(b[k], b[(k + 1) % 3], a))
}

fn coplanar(a: &[DVec3; 3], b: &[DVec3; 3], shared: &Shared) -> TrianglePair {
    let Some(flatten) = projection(a) else { return TrianglePair::Touching };
    let (flat_a, flat_b) = (a.map(flatten), b.map(flatten));
    if !separated(&flat_a, &flat_b, false) {
        return TrianglePair::CoplanarOverlap;
    }
    let touch = match (shared.count, shared.corner) {
        (0, _) | (_, None) => !separated(&flat_a, &flat_b, true),
        (1, Some((i, j))) => {
            !separated(&flat_a, &[flat_b[(j + 1) % 3], flat_b[(j + 2) % 3]], true)
                || !separated(&flat_b, &[flat_a[(i + 1) % 3], flat_a[(i + 2) % 3]], true)
        }
        _ => false,
    };
    if touch { TrianglePair::Touching } else { TrianglePair::Apart }
}

/// Returns a map that drops one coordinate, such that the projected triangle has an area. `None` if
/// the triangle has no area in any projection.
fn projection(triangle: &[DVec3; 3]) -> Option<fn(DVec3) -> DVec2> {
    let maps: [fn(DVec3) -> DVec2; 3] = [|p| DVec2::new(p.y, p.z), |p| DVec2::new(p.z, p.x), |p| DVec2::new(p.x, p.y)];
    maps.into_iter().find(|map| turn(map(triangle[0]), map(triangle[1]), map(triangle[2])) != 0.0)
}

/// Returns true if the line of a side of one figure separates the two figures. `other` is a
/// triangle or a segment. If `strictly` is true, the figures must have no common point; otherwise
/// they must have no common interior point.
fn separated(triangle: &[DVec2; 3], other: &[DVec2], strictly: bool) -> bool {
    let beyond = |p: DVec2, q: DVec2, inner: f64, points: &[DVec2]| {
        points.iter().all(|&x| {
            let side = turn(p, q, x) * inner;
            if strictly { side < 0.0 } else { side <= 0.0 }
        })
    };
    let sides_separate = |figure: &[DVec2; 3], points: &[DVec2]| {
        let inner = turn(figure[0], figure[1], figure[2]).signum();
        (0..3).any(|k| beyond(figure[k], figure[(k + 1) % 3], inner, points))
    };
    if sides_separate(triangle, other) {
        return true;
    }
    match *other {
        [p, q] => beyond(p, q, 1.0, triangle) || beyond(p, q, -1.0, triangle),
        [p, q, r] => sides_separate(&[p, q, r], triangle),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    //! The oracle uses a different method: two convex sets meet if the origin is in the hull of all
    //! differences of their corners. The oracle works with small integers, for which every
    //! determinant is exact. Therefore it covers only coordinates on a small grid.

    use super::*;
    use crate::algebra::Random;

    type Whole = [i64; 3];

    fn minus(a: Whole, b: Whole) -> Whole {
        [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
    }

    fn cross(a: Whole, b: Whole) -> Whole {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    }

    fn dot(a: Whole, b: Whole) -> i64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    const NOTHING: Whole = [0; 3];

    /// Returns true if the origin is in the convex hull of the points. By Carathéodory's theorem,
    /// the origin is then in a simplex of four of the points.
    fn hull_holds_origin(points: &[Whole]) -> bool {
        let n = points.len();
        let mut simplices = Vec::new();
        for i in 0..n {
            for j in i..n {
                for k in j..n {
                    simplices.extend((k..n).map(|l| [points[i], points[j], points[k], points[l]]));
                }
            }
        }
        simplices.iter().any(|&[p, q, r, s]| {
            let all = |x: [i64; 4]| x.iter().all(|&x| x >= 0) || x.iter().all(|&x| x <= 0);
            let volume = dot(cross(minus(q, p), minus(r, p)), minus(s, p));
            if volume != 0 {
                let det = |a, b, c| dot(cross(a, b), c);
                return all([det(q, r, s), -det(p, r, s), det(p, q, s), -det(p, q, r)]);
            }
            let n = cross(minus(q, p), minus(r, p));
            if s == r && n != NOTHING {
                return dot(n, p) == 0 && all([dot(cross(p, q), n), dot(cross(q, r), n), dot(cross(r, p), n), 0]);
            }
            (r == q && s == q && cross(p, q) == NOTHING && dot(p, q) <= 0) || p == NOTHING
        })
    }

    /// Returns true if the origin is in the interior of the convex hull. The origin must lie
    /// strictly inside each supporting plane through three of the points.
    fn hull_holds_origin_inside(points: &[Whole]) -> bool {
        let mut planes = 0;
        for &p in points {
            for &q in points {
                for &r in points {
                    let n = cross(minus(q, p), minus(r, p));
                    if n == NOTHING || points.iter().any(|&x| dot(n, minus(x, p)) > 0) {
                        continue;
                    }
                    planes += usize::from(points.iter().any(|&x| dot(n, minus(x, p)) < 0));
                    if dot(n, p) <= 0 {
                        return false;
                    }
                }
            }
        }
        planes > 0
    }

    fn differences(a: &[Whole], b: &[Whole]) -> Vec<Whole> {
        a.iter().flat_map(|&p| b.iter().map(move |&q| minus(p, q))).collect()
    }

    fn oracle(a: [Whole; 3], b: [Whole; 3]) -> TrianglePair {
        let n = cross(minus(a[1], a[0]), minus(a[2], a[0]));
        let apart = differences(&a, &b);
        if b.iter().all(|&p| dot(n, minus(p, a[0])) == 0) {
            let thick: Vec<Whole> = apart.iter().flat_map(|&d| [minus(d, n), minus(d, minus(NOTHING, n))]).collect();
            if hull_holds_origin_inside(&thick) {
                return TrianglePair::CoplanarOverlap;
            }
        } else if hull_holds_origin_inside(&apart) {
            return TrianglePair::Crossing;
        }
        let shared: Vec<Whole> = a.iter().copied().filter(|p| b.contains(p)).collect();
        let touch = match shared[..] {
            [] => hull_holds_origin(&apart),
            [v] => {
                let from = |t: [Whole; 3]| t.into_iter().filter(move |&p| p != v).map(move |p| minus(p, v));
                let cones: Vec<Whole> = from(a).chain(from(b).map(|w| minus(NOTHING, w))).collect();
                hull_holds_origin(&cones)
            }
            _ => false,
        };
        if touch { TrianglePair::Touching } else { TrianglePair::Apart }
    }

    #[test]
    fn results_agree_with_integer_arithmetic() {
        const SEED: u64 = 0x7a3e_91c4;
        let mut random = Random::new(SEED);
        let mut seen = [0_usize; 16];
        for case in 0..12_000 {
            let grid = 2 + random.below(4);
            let mut triangle = || loop {
                let t = [0; 3].map(|_| [0; 3].map(|_| random.below(grid) as i64));
                if cross(minus(t[1], t[0]), minus(t[2], t[0])) != NOTHING {
                    return t;
                }
            };
            let (a, b) = (triangle(), triangle());
            let real = |t: [Whole; 3]| t.map(|p| DVec3::from(p.map(|x| x as f64 * 0.1)));
            // Multiples of 0.1 are not exact, so coplanar corners would not stay coplanar. Integer
            // coordinates are exact.
            let whole = |t: [Whole; 3]| real(t).map(|p| (p * 10.0).round());
            let answer = TrianglePair::new(whole(a), whole(b));
            assert_eq!(answer, oracle(a, b), "seed {SEED}, case {case}: {a:?} {b:?}");
            for (p, q) in [(a, b), (b, a)] {
                let (turned, other) = (whole([p[1], p[2], p[0]]), whole([q[0], q[2], q[1]]));
                assert_eq!(TrianglePair::new(turned, other), answer, "seed {SEED}, case {case}");
            }
            let shared = a.iter().filter(|p| b.contains(p)).count();
            seen[shared * 4 + answer as usize] += 1;
        }
        // Checks that every possible case occurred. Triangles with two shared corners are apart or
        // overlap. Triangles with three shared corners overlap.
        for (kind, &count) in seen.iter().enumerate() {
            let possible = kind < 8 || [8, 11, 15].contains(&kind);
            assert_eq!(count > 0, possible, "seed {SEED}, {} shared, kind {}: {count}", kind / 4, kind % 4);
        }
    }

    #[test]
    fn the_smallest_gap_and_overlap_are_detected() {
        let floor = [DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 3.0];
        let lift = |z: f64| [DVec3::new(1.0, 1.0, z), DVec3::new(1.0, 0.5, 1.0), DVec3::new(0.5, 1.0, 1.0)];
        assert_eq!(TrianglePair::new(floor, lift(f64::MIN_POSITIVE)), TrianglePair::Apart);
        assert_eq!(TrianglePair::new(floor, lift(0.0)), TrianglePair::Touching);
        assert_eq!(TrianglePair::new(floor, lift(-f64::EPSILON)), TrianglePair::Crossing);
    }
}
