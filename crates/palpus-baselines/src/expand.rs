//! Penetration depth of two convex pieces, by the expanding polytope algorithm.
//!
//! The algorithm follows van den Bergen, *Proximity Queries and Penetration Depth Computation on 3D
//! Game Objects*, GDC 2001, as implemented in Coal, FCL and many other libraries.
//!
//! 1. If the pieces overlap, the Minkowski difference A − B contains the origin. The depth is the
//!    distance from the origin to the boundary of A − B. Start with a tetrahedron of four
//!    corners of A − B.
//! 2. Take the face of the current polytope whose plane is nearest to the origin, and find the
//!    support point along its normal.
//! 3. If the support point is not outside the face's plane, the face lies on the boundary: stop.
//!    Otherwise remove all faces with the point above their planes, and close the hole with faces
//!    to the point.
//! 4. The witness is the point of this face that is nearest to the origin. Its barycentric weights,
//!    applied to the corners on A and on B, give the two points.
//!
//! Deviation: the start is not the last simplex of a GJK run. The start tetrahedron consists of
//! four support points that span a volume, as in quickhull, and distances of faces are signed.
//! While the origin is outside, the polytope grows towards the origin; afterwards it grows as in
//! the original algorithm. So degenerate ends of GJK need no special case. If several faces lie in
//! one plane, the face that contains the witness is used.

use glam::DVec3;
use palpus::algebra::{Placement, closest_on_triangle};
use palpus::body::Polytope;

/// The search stops if the support point is outside the face by at most this, relative to the
/// size of A − B. A larger value makes depths too small by up to this value. With a smaller value
/// the search would follow rounding errors.
const PROGRESS: f64 = 1e-12;
/// A start tetrahedron thinner than this, relative to the size of A − B, counts as flat.
const FLAT: f64 = 1e-9;
/// Largest number of rounds. Pairs of pieces with some hundred corners need about ten.
const ROUNDS: usize = 512;

/// Depth and witness of a pair of pieces, in b's frame: moving a by `depth · normal` separates the
/// pieces.
///
/// The points satisfy `point_a − point_b = −depth · normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Penetration {
    /// Witness point on a.
    pub point_a: DVec3,
    /// Witness point on b.
    pub point_b: DVec3,
    /// Unit normal from b into a.
    pub normal: DVec3,
    /// Penetration depth; negative if the pieces are apart.
    pub depth: f64,
}

/// A corner of A − B, and the points of A and B that give it.
#[derive(Clone, Copy)]
struct Corner {
    w: DVec3,
    a: DVec3,
    b: DVec3,
}

/// A face of the growing polytope, counter-clockwise from outside.
#[derive(Clone, Copy)]
struct Face {
    corners: [usize; 3],
    /// Unit outward normal.
    normal: DVec3,
    /// Signed distance from the origin to the face's plane, positive if the origin is inside.
    distance: f64,
}

/// Returns the depth of an overlapping pair; `None` if A − B has no volume.
pub fn penetration(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> Option<Penetration> {
    let support = |direction: DVec3| {
        let on_a = pose_ba.point(a.vertex(a.support(pose_ba.inverse_vector(direction))));
        let on_b = b.vertex(b.support(-direction));
        Corner { w: on_a - on_b, a: on_a, b: on_b }
    };
    let size = a.radius() + b.radius();
    let mut corners = start(&support, size)?.to_vec();
    let mut faces = Vec::new();
    for triangle in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
        faces.push(face(&corners, triangle)?);
    }
    for _ in 0..ROUNDS {
        let nearest = *faces.iter().min_by(|f, g| f.distance.total_cmp(&g.distance))?;
        let new = support(nearest.normal);
        if new.w.dot(nearest.normal) - nearest.distance <= PROGRESS * size {
            break;
        }
        corners.push(new);
        if !grow(&corners, &mut faces) {
            break;
        }
    }
    witness(&corners, &faces, size)
}

/// Returns four corners that span a volume.
fn start(support: &impl Fn(DVec3) -> Corner, size: f64) -> Option<[Corner; 4]> {
    let (p, q) = (support(DVec3::X), support(DVec3::NEG_X));
    let line = (q.w - p.w).try_normalize()?;
    let across = line.any_orthonormal_vector();
    // At least one of these directions perpendicular to the line gives a corner off the line.
    let around = [across, line.cross(across), -across, across.cross(line)].map(support);
    let off_line = |c: &Corner| (c.w - p.w).cross(line).length();
    let r = around.into_iter().max_by(|c, d| off_line(c).total_cmp(&off_line(d)))?;
    let normal = (q.w - p.w).cross(r.w - p.w).try_normalize()?;
    let (above, below) = (support(normal), support(-normal));
    let height = |c: &Corner| (c.w - p.w).dot(normal);
    if height(&above).max(-height(&below)) <= FLAT * size {
        return None;
    }
    // The caller's faces point outward if the fourth corner is above the plane of the first three.
    Some(if height(&above) >= -height(&below) { [p, q, r, above] } else { [p, r, q, below] })
}

fn face(corners: &[Corner], triangle: [usize; 3]) -> Option<Face> {
    let [p, q, r] = triangle.map(|k| corners[k].w);
    let normal = (q - p).cross(r - p).try_normalize()?;
    Some(Face { corners: triangle, normal, distance: normal.dot(p) })
}

/// Adds the last corner to the polytope. Returns false, and changes nothing, if rounding makes a
/// new face degenerate.
fn grow(corners: &[Corner], faces: &mut Vec<Face>) -> bool {
    let new = corners.len() - 1;
    let sees = |f: &Face| f.normal.dot(corners[new].w) > f.distance;
    // Directed sides of the removed faces. A side without its reversed side in this list belongs to
    // the rim of the hole.
    let sides: Vec<[usize; 2]> = faces
        .iter()
        .filter(|f| sees(f))
        .flat_map(|f| [[f.corners[0], f.corners[1]], [f.corners[1], f.corners[2]], [f.corners[2], f.corners[0]]])
        .collect();
    let rim = sides.iter().filter(|[tail, head]| !sides.contains(&[*head, *tail]));
    let Some(added) = rim.map(|&[tail, head]| face(corners, [tail, head, new])).collect::<Option<Vec<Face>>>() else {
        return false;
    };
    faces.retain(|f| !sees(f));
    faces.extend(added);
    true
}

/// Returns the boundary point nearest to the origin, with its points on a and b.
fn witness(corners: &[Corner], faces: &[Face], size: f64) -> Option<Penetration> {
    let least = faces.iter().map(|f| f.distance).min_by(f64::total_cmp)?;
    let miss = |f: &Face| {
        let [p, q, r] = f.corners.map(|k| corners[k].w);
        let foot = f.normal * f.distance;
        (closest_on_triangle(foot, p, q, r) - foot).length_squared()
    };
    let in_plane = faces.iter().filter(|f| f.distance <= least + PROGRESS * size);
    let nearest = in_plane.min_by(|f, g| miss(f).total_cmp(&miss(g)))?;
    let [p, q, r] = nearest.corners.map(|k| corners[k]);
    let foot = closest_on_triangle(nearest.normal * nearest.distance, p.w, q.w, r.w);
    let doubled_area = (q.w - p.w).cross(r.w - p.w).dot(nearest.normal);
    let weight_q = (foot - p.w).cross(r.w - p.w).dot(nearest.normal) / doubled_area;
    let weight_r = (q.w - p.w).cross(foot - p.w).dot(nearest.normal) / doubled_area;
    let mix = |p: DVec3, q: DVec3, r: DVec3| p + (q - p) * weight_q + (r - p) * weight_r;
    let (point_a, point_b) = (mix(p.a, q.a, r.a), mix(p.b, q.b, r.b));
    Some(Penetration { point_a, point_b, normal: -nearest.normal, depth: nearest.distance })
}

#[cfg(test)]
mod tests {
    use glam::DQuat;
    use palpus::algebra::Pose;
    use palpus::body::Body;
    use palpus::depth::{Certainty, CertificateMemory, DepthScratch, Seed, depth_proven};

    use super::*;
    use palpus::algebra::Random;

    const SEED: u64 = 0xE7A0;

    fn cloud(random: &mut Random, points: usize) -> Body {
        let points: Vec<DVec3> = (0..points).map(|_| random.vector() * 0.02).collect();
        Body::from_convex(&points).expect("points in a cube have a hull")
    }

    #[test]
    fn depth_equals_the_proven_depth() {
        let mut random = Random::new(SEED);
        let mut scratch = DepthScratch::new();
        let mut proven = 0;
        for round in 0..200 {
            let (a, b) = (cloud(&mut random, 4 + round % 30), cloud(&mut random, 4 + round % 17));
            let axis = random.vector();
            let pose = Pose::new(DQuat::from_scaled_axis(axis * 3.0), random.vector() * 0.01).placement();
            let (a, b) = (&a.polytopes()[0], &b.polytopes()[0]);
            let truth = depth_proven(a, b, &pose, &[Seed::CentroidLine], &mut CertificateMemory::new(), &mut scratch);
            if truth.certainty != Certainty::GloballyOptimal || truth.depth <= 0.0 {
                continue;
            }
            proven += 1;
            let found = penetration(a, b, &pose).expect("the clouds have volume");
            let error = (found.depth - truth.depth).abs();
            assert!(error < 1e-12, "seed {SEED:#x}, round {round}: {} against {}", found.depth, truth.depth);
            let gap = found.point_a - found.point_b + found.normal * found.depth;
            assert!(gap.length() < 1e-12, "seed {SEED:#x}, round {round}: witness off by {gap}");
        }
        assert!(proven > 100, "seed {SEED:#x}: only {proven} pairs overlap");
    }

    #[test]
    fn box_in_box_has_the_depth_of_its_faces() {
        let corners = |half: DVec3| -> Vec<DVec3> {
            let sign = |k: usize, bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            (0..8).map(|k| half * DVec3::new(sign(k, 0), sign(k, 1), sign(k, 2))).collect()
        };
        let a = Body::from_convex(&corners(DVec3::new(0.03, 0.02, 0.01))).expect("a box has a hull");
        let b = Body::from_convex(&corners(DVec3::new(0.2, 0.2, 0.05))).expect("a box has a hull");
        let pose = Pose::from_translation(DVec3::new(0.01, -0.02, 0.0592)).placement();
        let found = penetration(&a.polytopes()[0], &b.polytopes()[0], &pose).expect("boxes have volume");
        assert!((found.depth - 0.0008).abs() < 1e-14);
        assert!((found.normal - DVec3::Z).length() < 1e-14);
        assert!((found.point_a.z - 0.0492).abs() < 1e-14 && (found.point_b.z - 0.05).abs() < 1e-14);
    }
}
