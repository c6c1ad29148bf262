//! Test bodies, and an exhaustive distance algorithm (the oracle) with which tests compare the
//! march and GJK.
//!
//! The oracle compares every vertex with every polygon and every edge with every edge. It shares
//! only the closed formulas of `algebra::closest` with the tested algorithms. For edges parallel
//! within 1e-8 rad, the error of these formulas is up to 1e-8 of the edges' length. But then a
//! vertex and a face give the distance too.

use glam::{DMat3, DQuat, DVec3};

use super::{March, Proximity};
pub(crate) use crate::algebra::Random;
use crate::algebra::tolerance::COPLANAR;
use crate::algebra::{Placement, Plane, Pose, closest_on_segment, closest_on_triangle, closest_segment_segment};
use crate::body::{Feature, Hull, Polytope, Provenance, convex_hull};

impl Random {
    pub(crate) fn rotation(&mut self) -> DQuat {
        let [a, b, c, d] = [0; 4].map(|_| self.between(-1.0, 1.0));
        DQuat::from_xyzw(a, b, c, d + 1e-3).normalize()
    }

    pub(crate) fn feature(&mut self, p: &Polytope) -> Feature {
        match self.below(3) {
            0 => Feature::Vertex(self.below(p.vertices().len()) as u32),
            1 => Feature::Edge(self.below(p.edges().len()) as u32),
            _ => Feature::Face(self.below(p.face_count()) as u32),
        }
    }
}

/// Returns a solid from its loops. A plane's normal is computed at the corner of its face that is
/// nearest to a right angle. In Newell's sum over a sliver, the rounding of the diagonals would
/// tilt the normal.
pub(crate) fn solid(vertices: Vec<DVec3>, loops: &[Vec<u32>]) -> Polytope {
    let planes = loops
        .iter()
        .map(|face| {
            let n = face.len();
            let at = |k: usize| vertices[face[k % n] as usize];
            let corner = |k: usize| {
                let (d, e) = (at(k + 1) - at(k), at(k + n - 1) - at(k));
                let cross = d.cross(e);
                (cross.length_squared() / (d.length_squared() * e.length_squared()), cross)
            };
            let normal = (0..n).map(corner).max_by(|p, q| p.0.total_cmp(&q.0)).unwrap().1.normalize();
            let offset = (0..n).map(|k| normal.dot(at(k))).sum::<f64>() / n as f64;
            Plane { normal, offset }
        })
        .collect();
    let provenance = vec![Provenance::Original; loops.len()];
    Polytope::from_faces(vertices, loops, planes, provenance).unwrap()
}

/// Returns the image of a solid under an affine map with a positive determinant.
pub(crate) fn mapped(p: &Polytope, map: DMat3, shift: DVec3) -> Polytope {
    let vertices: Vec<_> = p.vertices().iter().map(|v| map * *v + shift).collect();
    if p.is_flat() {
        let (u, v) = (vertices[1] - vertices[0], vertices[2] - vertices[0]);
        return Polytope::from_polygon(vertices, u.cross(v).normalize(), Provenance::Original).unwrap();
    }
    let loops: Vec<_> = (0..p.face_count() as u32).map(|f| p.face_vertices(f).to_vec()).collect();
    solid(vertices, &loops)
}

/// A box of the given half extents.
pub(crate) fn cuboid(half: DVec3) -> Polytope {
    let sign = |bit: bool| if bit { 1.0 } else { -1.0 };
    let vertices = (0..8).map(|k| half * DVec3::new(sign(k & 1 != 0), sign(k & 2 != 0), sign(k & 4 != 0))).collect();
    let loops = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    solid(vertices, &loops.map(Vec::from))
}

/// Returns a prism over a regular polygon of circumradius `radius`, from z = −height/2 to height/2.
pub(crate) fn prism(sides: u32, radius: f64, height: f64) -> Polytope {
    let corner = |k: u32, z: f64| {
        let angle = f64::from(k) * std::f64::consts::TAU / f64::from(sides);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
    };
    let vertices =
        (0..sides).map(|k| corner(k, -height / 2.0)).chain((0..sides).map(|k| corner(k, height / 2.0))).collect();
    let mut loops = vec![(0..sides).rev().collect::<Vec<_>>(), (sides..2 * sides).collect()];
    for k in 0..sides {
        let next = (k + 1) % sides;
        loops.push(vec![k, next, sides + next, sides + k]);
    }
    solid(vertices, &loops)
}

/// Returns a sphere of radius 1 by latitude and longitude: planar trapezoids, and triangles at the
/// poles.
pub(crate) fn globe(bands: u32, sides: u32) -> Polytope {
    let mut vertices = vec![-DVec3::Z];
    for band in 1..bands {
        let latitude = std::f64::consts::PI * (f64::from(band) / f64::from(bands) - 0.5);
        for k in 0..sides {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(sides);
            let r = latitude.cos();
            vertices.push(DVec3::new(r * angle.cos(), r * angle.sin(), latitude.sin()));
        }
    }
    vertices.push(DVec3::Z);
    let top = vertices.len() as u32 - 1;
    let at = |band: u32, k: u32| 1 + (band - 1) * sides + k % sides;
    let mut loops = Vec::new();
    for k in 0..sides {
        loops.push(vec![0, at(1, k + 1), at(1, k)]);
        for band in 1..bands - 1 {
            loops.push(vec![at(band, k), at(band, k + 1), at(band + 1, k + 1), at(band + 1, k)]);
        }
        loops.push(vec![at(bands - 1, k), at(bands - 1, k + 1), top]);
    }
    solid(vertices, &loops)
}

/// Returns a random tetrahedron in the unit cube, not too flat.
pub(crate) fn tetrahedron(random: &mut Random) -> Polytope {
    loop {
        let v = [0; 4].map(|_| random.vector());
        let volume = (v[1] - v[0]).cross(v[2] - v[0]).dot(v[3] - v[0]);
        if volume > 0.2 {
            return solid(v.to_vec(), &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(Vec::from));
        }
    }
}

/// Returns a plate over a regular polygon of circumradius 1 in the plane z = 0, squeezed along y.
pub(crate) fn plate(sides: u32, squeeze: f64) -> Polytope {
    let vertices = (0..sides)
        .map(|k| {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(sides);
            DVec3::new(angle.cos(), squeeze * angle.sin(), 0.0)
        })
        .collect();
    Polytope::from_polygon(vertices, DVec3::Z, Provenance::Original).unwrap()
}

/// Returns the hull of random points: on an ellipsoid, in a cube, on a lattice (with many coplanar
/// points), or near a plane.
pub(crate) fn random_hull(random: &mut Random, points: usize) -> Polytope {
    let kind = random.below(4);
    let points: Vec<_> = (0..points)
        .map(|_| match kind {
            0 => random.direction() * DVec3::new(1.0, 0.7, 0.5),
            1 => random.vector(),
            2 => (random.vector() * 3.0).round() / 3.0 + DVec3::new(0.1, 0.2, 0.3),
            _ => random.vector() * DVec3::new(1.0, 1.0, 1e-4),
        })
        .collect();
    let hull = convex_hull(&points, COPLANAR).ok().and_then(Hull::into_polytope);
    hull.map_or_else(|| cuboid(DVec3::ONE), |(polytope, _)| polytope)
}

/// Returns every kind of test body, each in its own oblique frame and of about size 1.
pub(crate) fn menagerie(random: &mut Random) -> Vec<(&'static str, Polytope)> {
    let mut oblique = |p: Polytope, stretch: DVec3| {
        let map = DMat3::from_quat(random.rotation()) * DMat3::from_diagonal(stretch);
        let shift = random.vector() * 0.5;
        mapped(&p, map, shift)
    };
    let mut zoo = vec![
        ("box", cuboid(DVec3::new(0.5, 0.7, 0.9))),
        ("oblique box", oblique(cuboid(DVec3::ONE), DVec3::new(0.5, 0.3, 1.0))),
        ("hexagonal prism", oblique(prism(6, 0.7, 1.2), DVec3::ONE)),
        ("cylinder", oblique(prism(32, 0.5, 1.5), DVec3::ONE)),
        ("ellipsoid", oblique(globe(8, 12), DVec3::new(1.0, 0.6, 0.8))),
        ("fine ellipsoid", oblique(globe(16, 24), DVec3::new(0.5, 0.9, 0.7))),
        ("needle", oblique(cuboid(DVec3::ONE), DVec3::new(1e-3, 1e-3, 1.0))),
        ("round needle", oblique(globe(6, 8), DVec3::new(1e-3, 2e-3, 1.0))),
        ("sliver", oblique(prism(5, 1.0, 1.0), DVec3::new(1.0, 1.0, 1e-6))),
        ("triangle", oblique(plate(3, 1.0), DVec3::ONE)),
        ("plate", oblique(plate(7, 0.6), DVec3::ONE)),
        ("narrow plate", oblique(plate(4, 1e-3), DVec3::ONE)),
        ("flat plate", plate(4, 1.0)),
    ];
    let sizes = [8, 20, 60, 8 + random.below(120)];
    zoo.extend(
        ["hull of 8", "hull of 20", "hull of 60", "hull"].into_iter().zip(sizes.map(|n| random_hull(random, n))),
    );
    let (t, u) = (tetrahedron(random), tetrahedron(random));
    zoo.push(("tetrahedron", t));
    zoo.push(("thin tetrahedron", mapped(&u, DMat3::from_diagonal(DVec3::new(1.0, 1.0, 1e-4)), DVec3::ZERO)));
    zoo
}

/// Returns the body scaled by `scale`.
pub(crate) fn scaled(p: &Polytope, scale: f64) -> Polytope {
    mapped(p, DMat3::from_diagonal(DVec3::splat(scale)), DVec3::ZERO)
}

/// Returns a placement of a in b's frame. The distance of the centroids is `apart` times the sum of
/// radii.
pub(crate) fn random_pose(random: &mut Random, a: &Polytope, b: &Polytope, apart: f64) -> Placement {
    let rotation = random.rotation();
    let centre = b.centroid() + random.direction() * apart * (a.radius() + b.radius());
    Pose::new(rotation, centre - rotation * a.centroid()).placement()
}

/// Returns the largest gap of two polytopes over all separating axes (face normals and cross
/// products of edges). The gap is minus the depth if they overlap.
pub(crate) fn widest_gap(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> f64 {
    let va: Vec<_> = a.vertices().iter().map(|v| pose_ba.point(*v)).collect();
    let gap = |n: DVec3| {
        let low = va.iter().map(|v| n.dot(*v)).fold(f64::INFINITY, f64::min);
        let high = b.vertices().iter().map(|v| n.dot(*v)).fold(f64::NEG_INFINITY, f64::max);
        low - high
    };
    let mut best = f64::NEG_INFINITY;
    for plane in a.planes() {
        best = best.max(gap(-pose_ba.vector(plane.normal)));
    }
    for plane in b.planes() {
        best = best.max(gap(plane.normal));
    }
    for e in a.edges() {
        let d = va[e.head as usize] - va[e.tail as usize];
        for g in b.edges() {
            let n = d.cross(b.vertex(g.head) - b.vertex(g.tail));
            if n.length_squared() > 1e-20 * d.length_squared() {
                let n = n.normalize();
                best = best.max(gap(n)).max(gap(-n));
            }
        }
    }
    best
}

fn polygon_distance(p: DVec3, corners: &[DVec3]) -> f64 {
    (1..corners.len().max(2) - 1)
        .map(|k| closest_on_triangle(p, corners[0], corners[k], corners[k + 1]).distance(p))
        .fold(f64::INFINITY, f64::min)
}

/// Returns the distance of two polytopes that are known to be apart, from all pairs of features.
pub(crate) fn exhaustive_distance(a: &Polytope, b: &Polytope, pose_ba: &Placement) -> f64 {
    let va: Vec<_> = a.vertices().iter().map(|v| pose_ba.point(*v)).collect();
    let vb = b.vertices();
    let mut best = f64::INFINITY;
    let corners = |face: &[u32], of: &[DVec3]| face.iter().map(|&v| of[v as usize]).collect::<Vec<_>>();
    for f in 0..a.face_count() as u32 {
        let corners = corners(&a.face_vertices(f).to_vec(), &va);
        for p in vb {
            best = best.min(polygon_distance(*p, &corners));
        }
    }
    for f in 0..b.face_count() as u32 {
        let corners = corners(&b.face_vertices(f).to_vec(), vb);
        for p in &va {
            best = best.min(polygon_distance(*p, &corners));
        }
    }
    for e in a.edges() {
        let (p, q) = (va[e.tail as usize], va[e.head as usize]);
        for g in b.edges() {
            let pair = closest_segment_segment(p, q, vb[g.tail as usize], vb[g.head as usize]);
            best = best.min(pair.first.distance(pair.second));
        }
    }
    best
}

/// Returns the distance of `p` from the closure of feature `f`.
fn distance_from_feature(p: DVec3, polytope: &Polytope, f: Feature) -> f64 {
    match f {
        Feature::Vertex(v) => polytope.vertex(v).distance(p),
        Feature::Edge(e) => {
            let (tail, head) = (polytope.vertex(polytope.edge(e).tail), polytope.vertex(polytope.edge(e).head));
            tail.lerp(head, closest_on_segment(p, tail, head)).distance(p)
        }
        Feature::Face(f) => {
            // The distance is computed from the heights over the face and its sides, because closed
            // formulas for triangles lose digits on slivers.
            let normal = polytope.plane(f).normal;
            let corners = polytope.face_vertices(f);
            let beyond = (0..corners.len()).map(|k| {
                let (u, v) = (polytope.vertex(corners.at(k)), polytope.vertex(corners.at((k + 1) % corners.len())));
                (v - u).cross(normal).normalize().dot(p - u)
            });
            polytope.plane(f).height(p).abs().max(beyond.fold(0.0, f64::max))
        }
    }
}

/// Checks a result without another algorithm. Its points must lie on its features, which gives an
/// upper bound of the distance. Its normal must separate the bodies by nearly the distance, which
/// gives a lower bound. Returns the distance minus the lower bound. Overlaps are not checked here.
/// `off` is the allowed distance of a point from its feature, relative to the coordinates.
pub(crate) fn judge(a: &Polytope, b: &Polytope, pose_ba: &Placement, answer: &March, off: f64) -> Result<f64, String> {
    let Proximity::Disjoint(closest) = answer.proximity else { return Ok(0.0) };
    let size = a.radius() + b.radius();
    let reach = size + a.centroid().length() + b.centroid().length() + pose_ba.translation.length();
    let distance = closest.distance;
    if !(distance > 0.0 && (closest.normal.length() - 1.0).abs() < 1e-14) {
        return Err(format!("distance {distance}, normal {}", closest.normal));
    }
    let mismatch = (closest.point_a - closest.point_b - closest.normal * distance).length();
    if mismatch > 4e-15 * reach {
        return Err(format!("points differ from distance times normal by {mismatch:e}"));
    }
    let off_a = distance_from_feature(pose_ba.inverse_point(closest.point_a), a, closest.features.a);
    let off_b = distance_from_feature(closest.point_b, b, closest.features.b);
    if off_a.max(off_b) > off * reach {
        return Err(format!("points lie off their features by {off_a:e} and {off_b:e}"));
    }
    let low = a.vertices().iter().map(|v| closest.normal.dot(pose_ba.point(*v))).fold(f64::INFINITY, f64::min);
    let high = b.vertices().iter().map(|v| closest.normal.dot(*v)).fold(f64::NEG_INFINITY, f64::max);
    let missing = distance - (low - high);
    // The error of the direction between two near points is the rounding of the points over their
    // distance.
    let allowed = off.max(1e-10) * distance + off * size + 4e-15 * reach * size / distance;
    if missing > allowed {
        return Err(format!("distance {distance} is {missing:e} more than the normal proves, allowed {allowed:e}"));
    }
    Ok(missing.max(0.0))
}

/// Allowed distance of a point of the march from its feature, relative to the coordinates:
/// rounding.
pub(crate) const OFF_MARCH: f64 = 2e-14;

/// Like [`OFF_MARCH`], for hulls. Their merged faces are planar within `COPLANAR` of the size
/// before scaling.
pub(crate) const OFF_MERGED: f64 = 4e-9;

/// Like [`OFF_MARCH`], for GJK. GJK may return the diagonal of two faces whose planes differ by
/// rounding.
pub(crate) const OFF_GJK: f64 = 1e-10;
