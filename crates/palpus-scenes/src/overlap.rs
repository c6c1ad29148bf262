//! The true overlap of two solids, measured with samples of both surfaces and without the engine's
//! contacts.
//!
//! 1. Sample each surface: its vertices, points along its edges, and the centroids of its
//!    triangles.
//! 2. For each sample inside the other solid (by the winding number), compute its distance to that
//!    solid's surface. The overlap is the largest distance.
//! 3. Along edges that enter the other solid, refine the deepest point between the samples.
//!
//! The result is a lower bound of the overlap. Samples miss a crossing of two edges that is
//! shallower than the spacing of the samples.

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::{Mesh, MeshError, PolygonSoup, TriangleTree};

/// Maximum number of samples along the edges of one mesh. The limit bounds the time for fine
/// meshes.
const MOST_SAMPLES: f64 = 40_000.0;
/// Distance between samples along an edge, m; larger if the mesh would need more than
/// [`MOST_SAMPLES`].
const SPACING: f64 = 0.25e-3;
/// Number of steps of the search for the deepest point of an edge. Each step shortens the interval
/// to 0.62 of its length.
const REFINEMENTS: usize = 20;

/// A closed surface with its samples.
#[derive(Clone, Debug)]
pub struct SampledSolid {
    tree: TriangleTree,
    points: Vec<DVec3>,
    /// The two ends of each edge, and the number of parts into which it is divided.
    edges: Vec<(DVec3, DVec3, usize)>,
}

impl SampledSolid {
    /// Samples the surface.
    ///
    /// # Errors
    /// Fails if the soup is not a valid mesh.
    pub fn new(soup: &PolygonSoup) -> Result<Self, MeshError> {
        let (mesh, _) = Mesh::from_soup(soup)?;
        let at = |v: u32| mesh.vertices()[v as usize];
        let mut pairs: Vec<[u32; 2]> =
            mesh.triangles().iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).filter(|[a, b]| a < b).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let length: f64 = pairs.iter().map(|&[a, b]| at(a).distance(at(b))).sum();
        let spacing = SPACING.max(length / MOST_SAMPLES);
        let edges = pairs
            .iter()
            .map(|&[a, b]| (at(a), at(b), (at(a).distance(at(b)) / spacing).ceil().max(1.0) as usize))
            .collect();
        let centroids = (0..mesh.triangles().len() as u32).map(|t| mesh.triangle_centroid(t));
        let points = mesh.vertices().iter().copied().chain(centroids).collect();
        Ok(Self { tree: mesh.tree(), points, edges })
    }

    /// Returns the vertices and the triangle centroids.
    pub fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Returns the signed distance of `p` to the surface, m: negative inside, at most `far`.
    pub fn signed_distance(&self, p: DVec3, far: f64) -> f64 {
        let inside = self.tree.bounds().holds(p) && self.tree.inside(p);
        if inside {
            return -self.tree.nearest(p).map_or(0.0, |near| near.distance);
        }
        self.tree.nearest_within(p, far).map_or(far, |near| near.distance)
    }

    /// Returns the depth of `p` in the solid, m; 0 if outside.
    fn depth(&self, p: DVec3) -> f64 {
        if !(self.tree.bounds().holds(p) && self.tree.inside(p)) {
            return 0.0;
        }
        self.tree.nearest(p).map_or(0.0, |near| near.distance)
    }

    /// Returns the largest depth of a sample of `other` in this solid, m. `pose` places `other` in
    /// this solid's frame.
    fn deepest_of(&self, other: &Self, pose: &Pose) -> f64 {
        let mut deepest = other.points.iter().map(|&p| self.depth(pose.point(p))).fold(0.0, f64::max);
        let bounds = self.tree.bounds();
        for &(a, b, parts) in &other.edges {
            let (a, b) = (pose.point(a), pose.point(b));
            let (low, high) = (a.min(b), a.max(b));
            if low.cmpgt(bounds.max).any() || high.cmplt(bounds.min).any() {
                continue;
            }
            let at = |k: f64| self.depth(a.lerp(b, k / parts as f64));
            let (mut best, mut place) = (0.0, 0.0);
            for k in 0..=parts {
                let depth = at(k as f64);
                if depth > best {
                    (best, place) = (depth, k as f64);
                }
            }
            if best > 0.0 {
                deepest = deepest.max(best).max(refined(&at, place, parts as f64));
            }
        }
        deepest
    }
}

/// Returns the largest value of `at` within one sample of `place`, by golden-section search.
fn refined(at: &impl Fn(f64) -> f64, place: f64, end: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = ((place - 1.0).max(0.0), (place + 1.0).min(end));
    for _ in 0..REFINEMENTS {
        let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if at(left) < at(right) {
            low = left;
        } else {
            high = right;
        }
    }
    at(0.5 * (low + high))
}

/// Returns the overlap of the solids `a` and `b`, m; 0 if they are apart. `pose_ba` places `a` in
/// b's frame.
pub fn overlap(a: &SampledSolid, b: &SampledSolid, pose_ba: &Pose) -> f64 {
    b.deepest_of(a, pose_ba).max(a.deepest_of(b, &pose_ba.inverse()))
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::shape::cuboid;

    fn solid(size: DVec3) -> SampledSolid {
        SampledSolid::new(&cuboid(size)).expect("a box is a valid mesh")
    }

    #[test]
    fn overlap_of_boxes_is_exact() {
        let (small, large) = (solid(DVec3::new(0.02, 0.01, 0.006)), solid(DVec3::splat(0.04)));
        for depth in [1e-6, 20e-6, 1e-3] {
            // The cases are a face, a tilted edge and a corner below the top face.
            for rotation in
                [DQuat::IDENTITY, DQuat::from_rotation_y(0.3), DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.3, 0.2)]
            {
                let turned = Pose::new(rotation, DVec3::ZERO);
                let lowest = small.points().iter().map(|&p| turned.point(p).z).fold(1.0, f64::min);
                let pose = Pose::new(rotation, DVec3::Z * (0.02 - lowest - depth));
                let found = overlap(&small, &large, &pose);
                assert!((found - depth).abs() < 1e-12, "{found} instead of {depth}");
                let apart = Pose::new(rotation, DVec3::Z * (0.02 - lowest + depth));
                assert_eq!(overlap(&small, &large, &apart), 0.0);
            }
        }
    }

    #[test]
    fn crossing_edges_are_found() {
        // Two rods cross at their edges, 0.1 mm deep along the line between the edges.
        let rod = solid(DVec3::new(0.05, 0.01, 0.01));
        let half = 0.005 * std::f64::consts::SQRT_2;
        let below = Pose::new(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_4), DVec3::ZERO);
        let above = Pose::new(
            DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2) * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_4),
            DVec3::Z * (2.0 * half - 1e-4),
        );
        let found = overlap(&rod, &rod, &(below.inverse() * above));
        // The deepest point of the edge has this distance from the nearer of two faces at 45°.
        assert!((found - 1e-4 / std::f64::consts::SQRT_2).abs() < 1e-7, "{found}");
    }
}
