//! Distance of two convex polytopes by Gilbert, Johnson and Keerthi's algorithm: the fallback of the march, and its judge.
//!
//! 1. A *corner* is a point of the CSO `A ⊖ B`: a support vertex of a minus one of b. Begin with one corner, from the
//!    vertices of the features that the caller names.
//! 2. Find the point `v` of the simplex of corners nearest to the origin, and keep only the corners that carry it.
//! 3. When `v` is the origin (within touching), or four corners enclose it, the polytopes overlap.
//! 4. Otherwise add the corner farthest along `−v`. Its plane bounds the distance from below, `|v|` from above; when the
//!    two agree, or nothing is gained any more, the nearest corners' vertices are the answer.
//! 5. Name the features from the vertices that carry the answer.
//!
//! Deviation from the textbook, for needles and slivers: the nearest sub-simplex is not chosen by signs of determinants
//! but by comparing distances. Every candidate is a convex combination of corners, hence a point of the CSO, so a
//! rounding error can cost accuracy of that candidate, never the validity of the answer \[van den Bergen 1999, §4\].

use glam::DVec3;

use super::march::March;
use super::{Closest, Overlap, Proximity, StopReason};
use crate::algebra::Placement;
use crate::algebra::tolerance::{GJK_GAP, GJK_PLATEAU, GJK_STEPS, MARCH_NOISE, TOUCHING};
use crate::body::{Feature, FeaturePair, Polytope};

/// The distance of a and b; all of the answer is in b's frame. `pose_ba` is the frame of a in b.
///
/// `start` names the features whose vertices make the first corner; any will do, the last answer's are best.
///
/// The stop reason is `Converged` when the two bounds of the distance agree within rounding. Otherwise it is `Stalled` or
/// `Budget`: the points then are valid and the bodies proven apart, but perhaps not closest; a pair that stopped without being
/// proven apart is reported as overlapping, never as disjoint.
pub fn gjk(a: &Polytope, b: &Polytope, pose_ba: &Placement, start: FeaturePair) -> March {
    let size = a.radius() + b.radius();
    let noise = position_noise(a, b, pose_ba);
    let touching = (TOUCHING * size).max(noise);
    let mut simplex = Simplex::new(Corner::new(a, b, pose_ba, some_vertex(a, start.a), some_vertex(b, start.b)), noise);
    // The simplex whose two bounds are nearest to each other.
    let mut best = (f64::INFINITY, simplex);
    let (mut steps, mut plateau) = (0, 0);
    loop {
        let length = simplex.nearest().length();
        if length <= touching {
            let direction = touching_direction(a, b, pose_ba, &simplex);
            return overlapping(a, b, pose_ba, &simplex, direction, steps, StopReason::Converged);
        }
        steps += 1;
        let normal = simplex.normal();
        let corner = Corner::new(a, b, pose_ba, a.support(pose_ba.inverse_vector(-normal)), b.support(normal));
        let gap = length - normal.dot(corner.difference);
        if gap < best.0 {
            best = (gap, simplex);
        }
        if gap <= (GJK_GAP * length).max(noise) {
            return disjoint(a, b, pose_ba, &simplex, steps, StopReason::Converged);
        }
        if steps == GJK_STEPS || simplex.contains(&corner) {
            break;
        }
        if let Reduction::Encloses(outward) = simplex.add(corner) {
            return overlapping(a, b, pose_ba, &simplex, -outward, steps, StopReason::Converged);
        }
        // Close to the origin, a step may gain less than rounding and still turn the normal: allow a few of them.
        let after = simplex.nearest().length();
        plateau = if after < length { 0 } else { plateau + 1 };
        if plateau > GJK_PLATEAU || after > length + noise {
            break;
        }
    }
    let (gap, simplex) = best;
    let (length, normal) = (simplex.nearest().length(), simplex.normal());
    if gap < length {
        let stop = if gap <= noise * size / length {
            StopReason::Converged
        } else if steps == GJK_STEPS {
            StopReason::Budget
        } else {
            StopReason::Stalled
        };
        return disjoint(a, b, pose_ba, &simplex, steps, stop);
    }
    let direction = if normal.is_finite() { normal } else { centroid_line(a, b, pose_ba) };
    overlapping(a, b, pose_ba, &simplex, direction, steps, StopReason::Stalled)
}

/// How far rounding may move a placed vertex: the unit of the tests that must not chase noise, in metres.
pub(super) fn position_noise(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> f64 {
    let reach = |p: &Polytope| p.centroid().abs().element_sum() + p.radius();
    MARCH_NOISE * (reach(a) + reach(b) + pose_ba.translation.abs().element_sum())
}

/// A vertex of feature `f`.
pub(super) fn some_vertex(polytope: &Polytope, f: Feature) -> u32 {
    match f {
        Feature::Vertex(v) => v,
        Feature::Edge(e) => polytope.edge(e).tail,
        Feature::Face(f) => polytope.face_vertices(f).at(0),
    }
}

/// A point of the CSO: the difference of two vertices, all in b's frame.
#[derive(Clone, Copy, Debug)]
struct Corner {
    a: u32,
    b: u32,
    point_b: DVec3,
    difference: DVec3,
}

impl Corner {
    fn new(a: &Polytope, b: &Polytope, pose_ba: &Placement, va: u32, vb: u32) -> Self {
        let (point_a, point_b) = (pose_ba.point(a.vertex(va)), b.vertex(vb));
        Self { a: va, b: vb, point_b, difference: point_a - point_b }
    }
}

/// What adding a corner led to.
enum Reduction {
    /// The simplex was reduced to the corners that carry its nearest point.
    Nearest,
    /// Four corners enclose the origin; the outward normal of the nearest of the four triangles.
    Encloses(DVec3),
}

/// Up to four corners and the weights of the point of their hull that is nearest to the origin.
#[derive(Clone, Copy, Debug)]
struct Simplex {
    corners: [Corner; 4],
    weights: [f64; 4],
    count: usize,
    noise: f64,
}

impl Simplex {
    fn new(corner: Corner, noise: f64) -> Self {
        Self { corners: [corner; 4], weights: [1.0, 0.0, 0.0, 0.0], count: 1, noise }
    }

    fn nearest(&self) -> DVec3 {
        self.weighted(|c| c.difference)
    }

    /// Unit, from the origin to the nearest point.
    ///
    /// A triangle knows it from its plane, and a segment at least from being perpendicular to it, free of the rounding
    /// of a nearest point that is close to the origin.
    fn normal(&self) -> DVec3 {
        let nearest = self.nearest();
        let p = self.corners[0].difference;
        let d = self.corners[1].difference - p;
        if self.count == 3 {
            let e = self.corners[2].difference - p;
            let cross = d.cross(e);
            // A cross product is known to an ulp over the sine of its angle, the nearest point to ulps of the reach.
            let sine_reach = cross.length() * self.noise / MARCH_NOISE;
            if sine_reach * sine_reach > nearest.length_squared() * (d.length_squared() * e.length_squared()) {
                return cross.normalize() * cross.dot(nearest).signum();
            }
        }
        if self.count == 2 {
            let unit = nearest.normalize();
            return (unit - d * (unit.dot(d) / d.length_squared())).normalize_or(unit);
        }
        nearest.normalize()
    }

    fn weighted(&self, of: impl Fn(&Corner) -> DVec3) -> DVec3 {
        self.corners[..self.count].iter().zip(&self.weights).fold(DVec3::ZERO, |sum, (c, w)| sum + of(c) * *w)
    }

    fn newest(&self) -> Corner {
        self.corners[self.count - 1]
    }

    fn contains(&self, corner: &Corner) -> bool {
        self.corners[..self.count].iter().any(|c| c.a == corner.a && c.b == corner.b)
    }

    /// Adds `corner` and finds the nearest point again.
    ///
    /// The nearest point of what was there is known, so only sub-simplices with the new corner can be better.
    fn add(&mut self, corner: Corner) -> Reduction {
        let n = self.count;
        self.corners[n] = corner;
        if n == 3
            && let Some(outward) = self.enclosing()
        {
            self.count = 4;
            self.weights = [0.25; 4];
            return Reduction::Encloses(outward);
        }
        let w = corner.difference;
        let mut best = Candidate { distance_squared: w.length_squared(), weights: [0.0; 4] };
        best.weights[n] = 1.0;
        for i in 0..n {
            best.consider(self, self.on_segment(n, i));
            for j in i + 1..n {
                best.consider(self, self.in_triangle(n, i, j));
            }
        }
        let mut kept = 0;
        for k in 0..=n {
            if best.weights[k] > 0.0 {
                self.corners[kept] = self.corners[k];
                self.weights[kept] = best.weights[k];
                kept += 1;
            }
        }
        self.count = kept;
        Reduction::Nearest
    }

    fn on_segment(&self, i: usize, j: usize) -> Option<[f64; 4]> {
        let (p, q) = (self.corners[i].difference, self.corners[j].difference);
        let d = q - p;
        let length_squared = d.length_squared();
        let t = -p.dot(d) / length_squared;
        // The ends are candidates of their own.
        (t > 0.0 && t < 1.0).then(|| {
            let mut weights = [0.0; 4];
            (weights[i], weights[j]) = (1.0 - t, t);
            weights
        })
    }

    /// The origin's projection onto the plane of three corners, when it falls into their triangle.
    ///
    /// Solved by orthogonalising one side against the other, then once more for the remainder: a sliver's Gram
    /// determinant would cancel, the remainder does not.
    fn in_triangle(&self, i: usize, j: usize, k: usize) -> Option<[f64; 4]> {
        let p = self.corners[i].difference;
        let (d, e) = (self.corners[j].difference - p, self.corners[k].difference - p);
        let (d, e, swapped) = if d.length_squared() > e.length_squared() { (e, d, true) } else { (d, e, false) };
        let ee = e.length_squared();
        let ratio = d.dot(e) / ee;
        let across = d - e * ratio;
        let height_squared = across.length_squared();
        if height_squared <= self.noise * self.noise {
            return None;
        }
        let (mut s, mut t) = (0.0, 0.0);
        for _ in 0..2 {
            let rest = -(p + d * s + e * t);
            let ds = rest.dot(across) / height_squared;
            s += ds;
            t += rest.dot(e) / ee - ds * ratio;
        }
        (s > 0.0 && t > 0.0 && s + t < 1.0).then(|| {
            let mut weights = [0.0; 4];
            weights[i] = 1.0 - s - t;
            (weights[j], weights[k]) = if swapped { (t, s) } else { (s, t) };
            weights
        })
    }

    /// When four corners enclose the origin: the outward normal (not unit) of the triangle nearest to it.
    fn enclosing(&self) -> Option<DVec3> {
        let mut nearest = f64::INFINITY;
        let mut outward = DVec3::ZERO;
        for [i, j, k, apex] in [[0, 1, 2, 3], [0, 3, 1, 2], [1, 3, 2, 0], [2, 3, 0, 1]] {
            let p = self.corners[i].difference;
            let (d, e) = (self.corners[j].difference - p, self.corners[k].difference - p);
            let normal = d.cross(e);
            let length = normal.length();
            let apex_height = normal.dot(self.corners[apex].difference - p);
            let height = -normal.dot(p) * apex_height.signum();
            // A tetrahedron flatter than the rounding of its normals has no inside; its triangles answer then.
            let rounding = self.noise * (d.length_squared() * e.length_squared()).sqrt();
            if apex_height.abs() <= rounding || height < rounding {
                return None;
            }
            let depth = height / length;
            if depth < nearest {
                nearest = depth;
                outward = if apex_height > 0.0 { -normal } else { normal };
            }
        }
        Some(outward)
    }
}

/// The best sub-simplex so far.
struct Candidate {
    distance_squared: f64,
    weights: [f64; 4],
}

impl Candidate {
    fn consider(&mut self, simplex: &Simplex, weights: Option<[f64; 4]>) {
        let Some(weights) = weights else { return };
        let point = simplex.corners.iter().zip(&weights).fold(DVec3::ZERO, |sum, (c, w)| sum + c.difference * *w);
        let distance_squared = point.length_squared();
        if distance_squared < self.distance_squared {
            *self = Self { distance_squared, weights };
        }
    }
}

fn disjoint(a: &Polytope, b: &Polytope, pose_ba: &Placement, simplex: &Simplex, steps: u32, stop: StopReason) -> March {
    let normal = simplex.normal();
    let distance = simplex.nearest().dot(normal);
    let point_b = simplex.weighted(|c| c.point_b);
    let features = carriers(a, b, pose_ba, simplex, normal);
    let closest = Closest { point_a: point_b + normal * distance, point_b, normal, distance, features };
    March { proximity: Proximity::Disjoint(closest), features, steps, stop }
}

fn overlapping(
    a: &Polytope,
    b: &Polytope,
    pose_ba: &Placement,
    simplex: &Simplex,
    direction: DVec3,
    steps: u32,
    stop: StopReason,
) -> March {
    let features = if simplex.count == 4 {
        FeaturePair { a: Feature::Vertex(simplex.newest().a), b: Feature::Vertex(simplex.newest().b) }
    } else {
        carriers(a, b, pose_ba, simplex, direction)
    };
    March { proximity: Proximity::Overlapping(Overlap { features, direction }), features, steps, stop }
}

/// The direction of an overlap noticed with the origin on the simplex: across it, or between the centroids.
fn touching_direction(a: &Polytope, b: &Polytope, pose_ba: &Placement, simplex: &Simplex) -> DVec3 {
    let apart = centroid_line(a, b, pose_ba);
    if simplex.count != 3 {
        return apart;
    }
    let [p, q, r] = [0, 1, 2].map(|k| simplex.corners[k].difference);
    let across = (q - p).cross(r - p).normalize_or(apart);
    if across.dot(apart) < 0.0 { -across } else { across }
}

/// Unit, from b's centroid to a's, in b's frame; any unit vector when they coincide.
pub(super) fn centroid_line(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> DVec3 {
    (pose_ba.point(a.centroid()) - b.centroid()).normalize_or(DVec3::X)
}

/// The least features that hold the vertices which carry the nearest point.
fn carriers(a: &Polytope, b: &Polytope, pose_ba: &Placement, simplex: &Simplex, normal: DVec3) -> FeaturePair {
    let corners = &simplex.corners[..simplex.count];
    FeaturePair {
        a: carrier(a, corners.iter().map(|c| c.a), pose_ba.inverse_vector(-normal)),
        b: carrier(b, corners.iter().map(|c| c.b), normal),
    }
}

/// The least feature whose closure holds the given vertices, preferring faces that look along `outward`.
fn carrier(polytope: &Polytope, vertices: impl Iterator<Item = u32>, outward: DVec3) -> Feature {
    let mut distinct = [0; 4];
    let mut count = 0;
    for v in vertices {
        if !distinct[..count].contains(&v) {
            distinct[count] = v;
            count += 1;
        }
    }
    let (first, others) = (distinct[0], &distinct[1..count]);
    if others.is_empty() {
        return Feature::Vertex(first);
    }
    let ring = polytope.ring(first);
    if others.len() == 1
        && let Some(spoke) = ring.iter().find(|s| s.neighbour == others[0])
    {
        return Feature::Edge(spoke.edge);
    }
    // Faces merged within rounding may be missed by one corner: then the face that holds most of them answers.
    let mut best = (0, f64::NEG_INFINITY, ring.at(0).left);
    for spoke in ring {
        let face = polytope.face_vertices(spoke.left);
        let held = others.iter().filter(|&&v| face.contains(v)).count();
        let facing = polytope.plane(spoke.left).normal.dot(outward);
        if (held, facing) > (best.0, best.1) {
            best = (held, facing, spoke.left);
        }
    }
    Feature::Face(best.2)
}

#[cfg(test)]
mod tests {
    use super::super::oracle::*;
    use super::*;

    const SEED: u64 = 0x6A6B;

    #[test]
    fn answers_are_proven_on_every_pair_of_bodies() {
        let mut random = Random(SEED);
        let zoo = menagerie(&mut random);
        for (name_a, a) in &zoo {
            for (name_b, b) in &zoo {
                for apart in [0.02, 0.3, 0.5, 0.8, 1.1, 3.0, 30.0] {
                    let pose = random_pose(&mut random, a, b, apart);
                    let start = FeaturePair { a: random.feature(a), b: random.feature(b) };
                    let answer = gjk(a, b, &pose, start);
                    assert_eq!(answer.stop, StopReason::Converged, "{name_a}, {name_b}, {apart}, seed {SEED:#x}");
                    if let Err(fault) = judge(a, b, &pose, &answer, OFF_GJK) {
                        panic!("{name_a}, {name_b}, {apart}, seed {SEED:#x}: {fault}\n{answer:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn distances_equal_the_exhaustive_search() {
        let mut random = Random(SEED);
        let zoo: Vec<_> = menagerie(&mut random).into_iter().filter(|(_, p)| p.edges().len() < 40).collect();
        for (name_a, a) in &zoo {
            for (name_b, b) in &zoo {
                for apart in [0.4, 0.8, 1.5] {
                    let pose = random_pose(&mut random, a, b, apart);
                    let answer = gjk(a, b, &pose, FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) });
                    let what = format!("{name_a}, {name_b}, {apart}, seed {SEED:#x}");
                    match answer.proximity {
                        Proximity::Disjoint(closest) => {
                            let expected = exhaustive_distance(a, b, &pose);
                            let fault = (closest.distance - expected).abs();
                            assert!(fault <= 1e-10 * expected + 1e-13, "{what}: {} {expected}", closest.distance);
                        }
                        Proximity::Overlapping(_) => {
                            let gap = widest_gap(a, b, &pose);
                            assert!(gap < 1e-12, "{what}: apart by {gap}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn touching_and_coplanar_bodies_overlap() {
        let unit = cuboid(DVec3::ONE);
        let leaf = plate(5, 0.8);
        let start = FeaturePair { a: Feature::Vertex(0), b: Feature::Vertex(0) };
        for (a, b, shift) in [
            (&unit, &unit, DVec3::new(2.0, 0.3, 0.1)),
            (&unit, &unit, DVec3::new(2.0, 2.0, 0.1)),
            (&unit, &unit, DVec3::splat(2.0)),
            (&unit, &leaf, DVec3::new(0.1, 0.2, 1.0)),
            (&leaf, &leaf, DVec3::new(0.4, 0.1, 0.0)),
            (&leaf, &leaf, DVec3::ZERO),
        ] {
            let pose = Placement { translation: shift, ..Placement::IDENTITY };
            let answer = gjk(a, b, &pose, start);
            assert!(matches!(answer.proximity, Proximity::Overlapping(_)), "{shift}: {answer:?}");
        }
    }
}
