//! Convex hulls of small, large, flat and needle-like point sets \[K02 §3.2\].
//!
//! A piece is the convex hull of a patch. A patch may be three points, a coplanar polygon, a
//! needle, or a sliver that is flat up to rounding. Therefore the result states the hull's
//! dimension, and every sign that decides topology is computed exactly.
//!
//! 1. Sort the points by coordinates and drop exact duplicates. After this step the result does not
//!    depend on the order of the given points.
//! 2. Find four points that span a volume. If the set is too thin in one direction, the result is a
//!    polygon. If the set is too thin in two or three directions, the result is a segment or a
//!    point.
//! 3. Run quickhull from that tetrahedron (Barber, Dobkin, Huhdanpaa 1996) with Shewchuk's exact
//!    orientation predicate. The result is a triangulated hull, which is correct for any degenerate
//!    input (`quickhull`).
//! 4. Replace a hull that is thinner than the merge distance by a polygon (`polygon`).
//! 5. Merge coplanar triangles into planar faces (`merge`), but skip each merge that would break
//!    the topology.
//!
//! Two deviations from the published quickhull: exact signs replace its "thick facets", and faces
//! are merged only after the hull is complete.

mod merge;
mod normal;
mod polygon;
mod quickhull;
#[cfg(test)]
mod tests;

use glam::DVec3;

use self::{merge::Unmergeable, normal::cross_of, quickhull::Shell};
use super::{Polytope, Provenance};
use crate::algebra::tolerance::{HULL_LARGEST, HULL_SMALLEST};

/// The convex hull of a point set, by its dimension. `inputs` are indices into the given points.
#[derive(Clone, Debug)]
pub enum Hull {
    /// All points lie within the merge distance of one point.
    Point {
        /// Index of that point.
        input: u32,
    },
    /// All points lie within the merge distance of a segment.
    Segment {
        /// The indices of the segment's ends.
        inputs: [u32; 2],
    },
    /// All points lie within the merge distance of a plane.
    Polygon {
        /// The plate over the convex polygon. Its front face is original; its back face and its
        /// rims are virtual.
        polytope: Polytope,
        /// Vertex `v` of the polytope is the given point `inputs[v]`.
        inputs: Vec<u32>,
    },
    /// The points span a volume.
    Solid {
        /// The hull with merged planar faces, all tagged original (see
        /// [`Polytope::with_provenance`]).
        polytope: Polytope,
        /// Vertex `v` of the polytope is the given point `inputs[v]`.
        inputs: Vec<u32>,
    },
}

impl Hull {
    /// Returns the plate or solid, and for each of its vertices the index of the given point;
    /// `None` for a point or a segment.
    pub fn into_polytope(self) -> Option<(Polytope, Vec<u32>)> {
        match self {
            Self::Point { .. } | Self::Segment { .. } => None,
            Self::Polygon { polytope, inputs } | Self::Solid { polytope, inputs } => Some((polytope, inputs)),
        }
    }
}

/// The reason why the hull of a point set cannot be computed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HullError {
    /// There are no points.
    #[error("a convex hull needs at least one point")]
    Empty,
    /// A coordinate is NaN or infinite.
    #[error("point {0} has a coordinate that is not a finite number")]
    NotFinite(u32),
    /// A coordinate is too large for exact orientation tests.
    #[error("point {0} has a coordinate too large for exact arithmetic")]
    TooLarge(u32),
    /// There are more points than 32-bit indices can address.
    #[error("a convex hull of more than 2^31 points")]
    TooMany,
    /// [`convex_polygon`] was called, but the points do not lie in one plane within the merge
    /// distance.
    #[error("the points do not lie in one plane")]
    NotFlat,
    /// The exact tests contradicted each other. Some coordinates are much smaller than others, and
    /// products of these coordinates underflow.
    #[error("exact arithmetic fails: some coordinates are extremely small compared with others")]
    Inconsistent,
}

/// Computes the convex hull of `points`.
///
/// `coplanar` is the merge distance in model units. Hull triangles become one face if all their
/// vertices lie within this distance of a common supporting plane. If the merge distance is zero,
/// only exactly coplanar triangles become one face. No vertex moves. A given point lies above a
/// face of a solid by at most the merge distance. A given point lies above a face of a plate by at
/// most twice the merge distance. If the hull is a polygon, either side may become its front. With
/// [`convex_polygon`], the caller chooses the front.
///
/// # Errors
/// See [`HullError`]. This function never returns [`HullError::NotFlat`].
pub fn convex_hull(points: &[DVec3], coplanar: f64) -> Result<Hull, HullError> {
    hull_of(&Cloud::new(points)?, coplanar.max(0.0), DVec3::ZERO)
}

/// Computes the convex hull of points that lie in one plane within the merge distance. The hull's
/// front is on the side to which `normal` points. `normal` need not have unit length. The plane is
/// fitted to the points, so `normal` only selects the side.
///
/// # Errors
/// Fails with [`HullError::NotFlat`] if the points do not lie in one plane, or for the same reasons
/// as [`convex_hull`].
pub fn convex_polygon(points: &[DVec3], normal: DVec3, coplanar: f64) -> Result<Hull, HullError> {
    match hull_of(&Cloud::new(points)?, coplanar.max(0.0), normal)? {
        Hull::Solid { .. } => Err(HullError::NotFlat),
        hull => Ok(hull),
    }
}

/// The distinct points in lexicographic order.
struct Cloud {
    points: Vec<DVec3>,
    /// For each distinct point, the index of the first given point at that place.
    inputs: Vec<u32>,
}

impl Cloud {
    fn new(given: &[DVec3]) -> Result<Self, HullError> {
        if given.is_empty() {
            return Err(HullError::Empty);
        }
        if given.len() > (u32::MAX / 2) as usize {
            return Err(HullError::TooMany);
        }
        if let Some(k) = given.iter().position(|p| !p.is_finite()) {
            return Err(HullError::NotFinite(k as u32));
        }
        if let Some(k) = given.iter().position(|p| p.abs().max_element() > HULL_LARGEST) {
            return Err(HullError::TooLarge(k as u32));
        }
        // Replaces negative zero and values near zero by positive zero. Then products do not
        // underflow, and equal coordinates have equal bits.
        let clean = |x: f64| if x.abs() < HULL_SMALLEST { 0.0 } else { x };
        let key = |k: u32| given[k as usize].to_array().map(clean);
        let mut inputs: Vec<u32> = (0..given.len() as u32).collect();
        inputs.sort_unstable_by(|&i, &j| {
            let (p, q) = (key(i), key(j));
            p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(p[2].total_cmp(&q[2])).then(i.cmp(&j))
        });
        inputs.dedup_by(|later, first| key(*later) == key(*first));
        Ok(Self { points: inputs.iter().map(|&k| DVec3::from_array(key(k))).collect(), inputs })
    }

    /// Returns this cloud without the points at the indices `dropped`, which must be ascending.
    fn without(&self, dropped: &[u32]) -> Self {
        let kept = || (0..self.points.len()).filter(|&k| dropped.binary_search(&(k as u32)).is_err());
        Self { points: kept().map(|k| self.points[k]).collect(), inputs: kept().map(|k| self.inputs[k]).collect() }
    }
}

/// The affine hull of the points: point, line, plane or space.
enum Span {
    Point(u32),
    Segment(u32, u32),
    /// The points lie in the plane with this normal.
    Plane(DVec3),
    /// Four points that span a non-zero volume.
    Volume([u32; 4]),
}

/// Computes the hull. The front of a polygon is on the side of `front`. If `front` is zero, the
/// front may be on either side.
fn hull_of(cloud: &Cloud, coplanar: f64, front: DVec3) -> Result<Hull, HullError> {
    match span(&cloud.points, coplanar) {
        Span::Point(p) => Ok(Hull::Point { input: cloud.inputs[p as usize] }),
        Span::Segment(p, q) => Ok(Hull::Segment { inputs: [cloud.inputs[p as usize], cloud.inputs[q as usize]] }),
        Span::Plane(normal) => plate(cloud, normal, front, coplanar),
        Span::Volume(tetrahedron) => {
            let shell = quickhull::quickhull(&cloud.points, tetrahedron)?;
            if let Some(normal) = thin_direction(&cloud.points, &shell, coplanar) {
                return plate(cloud, normal, front, coplanar);
            }
            match merge::merged(&cloud.points, &shell, coplanar) {
                Ok((polytope, vertices)) => {
                    debug_assert_eq!(polytope.validate(coplanar), Ok(()));
                    Ok(Hull::Solid { polytope, inputs: vertices.iter().map(|&v| cloud.inputs[v as usize]).collect() })
                }
                Err(Unmergeable { collinear }) if collinear.is_empty() => Err(HullError::Inconsistent),
                // Without the collinear points, the hull is smaller only by rounding errors. Each
                // call has fewer points, so the recursion ends.
                Err(Unmergeable { collinear }) => hull_of(&cloud.without(&collinear), coplanar, front),
            }
        }
    }
}

/// Finds the affine hull within the merge distance `coplanar`. Picks two distant points, a third
/// point far from their line, and a fourth point far from their plane.
fn span(points: &[DVec3], coplanar: f64) -> Span {
    let (p, q) = distant_pair(points);
    let (a, b) = (points[p as usize], points[q as usize]);
    if a.distance(b) <= coplanar.max(HULL_SMALLEST) {
        return Span::Point(p);
    }
    let along = (b - a).normalize();
    let off_line = |x: DVec3| (x - a).cross(along).length();
    let (r, width) = farthest(points, off_line);
    if width <= coplanar {
        return Span::Segment(p, q);
    }
    // Rounding can give exactly collinear points a small width.
    let Some(r) = first_that(points, r, |c| !polygon::collinear(a, b, c)) else { return Span::Segment(p, q) };
    let c = points[r as usize];
    let normal = normal::unit(cross_of(a, b, c));
    let height = |x: DVec3| normal.dot(x - a);
    let (s, _) = farthest(points, |x| height(x).abs());
    let (low, high) = range(points, height);
    if high - low <= coplanar {
        return Span::Plane(normal);
    }
    match first_that(points, s, |d| quickhull::orientation(a, b, c, d) != 0.0) {
        None => Span::Plane(normal),
        Some(s) if quickhull::orientation(a, b, c, points[s as usize]) > 0.0 => Span::Volume([p, q, r, s]),
        Some(s) => Span::Volume([p, r, q, s]),
    }
}

/// Returns the two points that are farthest apart among the extreme points along the axes. Their
/// distance is at least the largest distance of the set divided by √3.
fn distant_pair(points: &[DVec3]) -> (u32, u32) {
    let mut extremes = [0u32; 6];
    for (k, p) in points.iter().enumerate() {
        for axis in 0..3 {
            if p[axis] < points[extremes[axis] as usize][axis] {
                extremes[axis] = k as u32;
            }
            if p[axis] > points[extremes[axis + 3] as usize][axis] {
                extremes[axis + 3] = k as u32;
            }
        }
    }
    let mut best = (extremes[0], extremes[0], -1.0);
    for (k, &i) in extremes.iter().enumerate() {
        for &j in &extremes[k + 1..] {
            let distance = points[i as usize].distance(points[j as usize]);
            if distance > best.2 {
                best = (i, j, distance);
            }
        }
    }
    (best.0, best.1)
}

/// Returns the point with the largest `measure`, and that value.
fn farthest(points: &[DVec3], measure: impl Fn(DVec3) -> f64) -> (u32, f64) {
    let mut best = (0, f64::NEG_INFINITY);
    for (k, &p) in points.iter().enumerate() {
        let m = measure(p);
        if m > best.1 {
            best = (k as u32, m);
        }
    }
    best
}

/// Returns `preferred` if it satisfies `wanted`, else the first point that does.
fn first_that(points: &[DVec3], preferred: u32, wanted: impl Fn(DVec3) -> bool) -> Option<u32> {
    if wanted(points[preferred as usize]) {
        return Some(preferred);
    }
    points.iter().position(|&p| wanted(p)).map(|k| k as u32)
}

fn range(points: &[DVec3], measure: impl Fn(DVec3) -> f64) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &p| {
        let m = measure(p);
        (low.min(m), high.max(m))
    })
}

/// Finds a direction along which the hull is at most as thick as the merge distance; `None` if both
/// candidates fail.
///
/// The candidates are the normal of the largest triangle, and the area-weighted mean normal of all
/// triangles that face to the same side. For a thin slab, this mean is the direction of the largest
/// projected area.
fn thin_direction(points: &[DVec3], shell: &Shell, coplanar: f64) -> Option<DVec3> {
    let areas: Vec<DVec3> = shell
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            (b - a).cross(c - a)
        })
        .collect();
    let largest = areas.iter().enumerate().max_by(|x, y| x.1.length_squared().total_cmp(&y.1.length_squared()))?.0;
    let [a, b, c] = shell.triangles[largest].map(|v| points[v as usize]);
    let first = normal::unit(cross_of(a, b, c));
    let second = normal::unit(areas.iter().filter(|area| area.dot(first) > 0.0).sum());
    [first, second].into_iter().find(|n| {
        let (low, high) = range(points, |x| n.dot(x - a));
        high - low <= coplanar
    })
}

/// Builds the plate over points that lie near a plane with this normal.
fn plate(cloud: &Cloud, normal: DVec3, front: DVec3, coplanar: f64) -> Result<Hull, HullError> {
    let normal = if normal.dot(front) < 0.0 { -normal } else { normal };
    let corners = polygon::convex_polygon_corners(&cloud.points, normal, coplanar);
    if corners.len() < 3 {
        let (p, q) = distant_pair(&cloud.points);
        return Ok(Hull::Segment { inputs: [cloud.inputs[p as usize], cloud.inputs[q as usize]] });
    }
    let vertices: Vec<DVec3> = corners.iter().map(|&v| cloud.points[v as usize]).collect();
    let fitted = polygon::fitted_normal(&vertices, normal);
    let polytope =
        Polytope::from_polygon(vertices, fitted, Provenance::Original).map_err(|_| HullError::Inconsistent)?;
    // Checks only the topology. The points lie in a plane only within the merge distance, so their
    // heights above the rims have no bound.
    debug_assert_eq!(polytope.validate_topology(), Ok(()));
    Ok(Hull::Polygon { polytope, inputs: corners.iter().map(|&v| cloud.inputs[v as usize]).collect() })
}
