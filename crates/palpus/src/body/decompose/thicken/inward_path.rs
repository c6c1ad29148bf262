//! Computes inward paths from the vertices of a closed surface to the medial axis of the solid, and
//! then along the medial axis to the locally thickest part.
//!
//! From a vertex, the distance to the surface grows fastest along the axis of the narrowest cone
//! around the inward normals of the vertex's facets. On a planar part, the axis is the inward
//! normal. At a convex or reflex edge, the axis is the bisector.
//!
//! 1. Go from the vertex along that direction as long as the facets at the vertex are the nearest
//!    part of the surface, or nearly. This step ends at the medial axis.
//! 2. At the medial axis, another part of the surface is equally near. From the direction to that
//!    part and the normals of the facets, compute the direction in which the distance to all these
//!    parts grows fastest. This direction leads along the medial axis. Continue as long as the
//!    distance to the surface grows at the expected rate.
//! 3. The path ends if no direction leads away from all near parts of the surface, for example
//!    between opposite walls. The path also ends after a fixed number of steps.
//!
//! The length of a step is found by iteration. The expected distance at the end of the step is
//! known. If a surface point `x` is nearer, the step is shortened until the expected distance holds
//! for `x`, and the search is repeated. The iteration converges like the shrinking ball of J. Ma,
//! S. Bae, S. Choi, *3D medial axis point approximation using nearest neighbors and the normal
//! field*, 2012. Each query is cheap, because it searches only for points nearer than the expected
//! distance.

use glam::DVec3;

use crate::algebra::tolerance::{
    HULL_POINT_GAIN, HULL_POINT_STEPS, INWARD_CUT, INWARD_FIRST_SLOPE, INWARD_PATHS_PER_PART, INWARD_SEARCHES,
    INWARD_SLACK, INWARD_SLOPE, INWARD_STEPS,
};
use crate::algebra::{Workers, map_in_order};
use crate::body::TriangleTree;
use crate::body::decompose::Patch;
use crate::body::decompose::facet::{Facets, Surface};

/// A point of an inward path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PathPoint {
    pub(crate) point: DVec3,
    /// Lower bound of the distance from the point to the surface (m).
    pub(crate) distance: f64,
}

/// The inward paths from all vertices of a surface.
#[derive(Clone, Debug, Default)]
pub(crate) struct InwardPaths {
    starts: Vec<u32>,
    points: Vec<PathPoint>,
    /// For each vertex, whether it needs an inward path.
    wanted: Vec<bool>,
}

impl InwardPaths {
    /// Computes the inward paths from the corners of all patches of closed components. Leaves out
    /// patches that are a whole component.
    pub(crate) fn new(
        surface: &Surface<'_>,
        facets: &Facets,
        tree: &TriangleTree,
        patches: &[Patch],
        workers: &dyn Workers,
        progress: &mut dyn FnMut(f64),
    ) -> Self {
        let wanted = wanted(surface, facets, patches);
        let around = Around::new(surface, facets);
        let of_vertex = |v: usize| {
            let mut path = Vec::new();
            if wanted[v] {
                let mut normals = around.of(v).iter().map(|&f| facets.plane(f).normal).collect();
                inward_path(surface.vertex(v as u32), &mut normals, tree, surface.noise(), &mut path);
            }
            path
        };
        let found = map_in_order(workers, surface.vertex_count(), INWARD_PATHS_PER_PART, of_vertex, progress);
        let mut paths = Self { starts: vec![0], points: Vec::new(), wanted };
        for path in found {
            paths.points.extend(path);
            paths.starts.push(paths.points.len() as u32);
        }
        paths
    }

    /// Returns true if the patch has inward paths.
    pub(super) fn reach(&self, patch: &Patch, facets: &Facets) -> bool {
        let corner = facets.corners(patch.facets[0])[0];
        self.wanted.get(corner as usize).is_some_and(|&wanted| wanted)
    }

    /// Returns the points of the inward path of vertex `v`, from the surface inward; empty if there
    /// is no path.
    pub(crate) fn of(&self, v: u32) -> &[PathPoint] {
        if self.starts.is_empty() {
            return &[];
        }
        &self.points[self.starts[v as usize] as usize..self.starts[v as usize + 1] as usize]
    }
}

/// Returns for each vertex whether it is a corner of a patch that needs inward paths.
fn wanted(surface: &Surface<'_>, facets: &Facets, patches: &[Patch]) -> Vec<bool> {
    let sizes = surface.component_sizes();
    let mut wanted = vec![false; surface.vertex_count()];
    for patch in patches {
        let component = surface.component(facets.triangles(patch.facets[0])[0]);
        let size: usize = patch.facets.iter().map(|&f| facets.triangles(f).len()).sum();
        if surface.is_closed(component) && size < sizes[component as usize] {
            patch.facets.iter().flat_map(|&f| facets.corners(f)).for_each(|&v| wanted[v as usize] = true);
        }
    }
    wanted
}

/// The facets with a corner at each vertex.
struct Around {
    starts: Vec<u32>,
    facets: Vec<u32>,
}

impl Around {
    fn new(surface: &Surface<'_>, facets: &Facets) -> Self {
        let mut starts = vec![0u32; surface.vertex_count() + 1];
        let all = || (0..facets.len() as u32).flat_map(|f| facets.corners(f).iter().map(move |&v| (f, v)));
        for (_, v) in all() {
            starts[v as usize + 1] += 1;
        }
        for v in 1..starts.len() {
            starts[v] += starts[v - 1];
        }
        let mut next = starts.clone();
        let mut list = vec![0; starts[starts.len() - 1] as usize];
        for (f, v) in all() {
            list[next[v as usize] as usize] = f;
            next[v as usize] += 1;
        }
        Self { starts, facets: list }
    }

    fn of(&self, v: usize) -> &[u32] {
        &self.facets[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// Appends the points of the inward path from `vertex` to `path`. `normals` are the outward unit
/// normals of the facets at the vertex. Each step appends to `normals` the direction to the surface
/// point that limited the step.
pub(super) fn inward_path(
    vertex: DVec3,
    normals: &mut Vec<DVec3>,
    tree: &TriangleTree,
    noise: f64,
    path: &mut Vec<PathPoint>,
) {
    let mut at = PathPoint { point: vertex, distance: 0.0 };
    for k in 0..INWARD_STEPS {
        let axis = shortest_of_hull(normals);
        let slope = axis.length();
        if slope < if k == 0 { INWARD_FIRST_SLOPE } else { INWARD_SLOPE } {
            return;
        }
        let step =
            Step { from: at.point, along: -axis / slope, distance: at.distance, slope: (1.0 - INWARD_SLACK) * slope };
        let Some((length, near)) = step.length(tree, noise) else { return };
        at = PathPoint { point: step.at(length), distance: step.promise(length) };
        path.push(at);
        normals.push((near - at.point).normalize_or_zero());
    }
}

/// A step from `from` along `along` (unit). At length t (m), the expected distance to the surface
/// is `distance + slope · t`.
struct Step {
    from: DVec3,
    along: DVec3,
    distance: f64,
    slope: f64,
}

impl Step {
    fn at(&self, length: f64) -> DVec3 {
        self.from + self.along * length
    }

    /// Returns the expected distance to the surface at `length`.
    fn promise(&self, length: f64) -> f64 {
        self.distance + self.slope * length
    }

    /// Returns the length up to which the expected distance holds, and the surface point that
    /// limits it; `None` if the length is too short.
    fn length(&self, tree: &TriangleTree, noise: f64) -> Option<(f64, DVec3)> {
        // A hit near t = 0 is the part of the surface at which the path starts.
        let mut wall = f64::INFINITY;
        let _ = tree.visit_ray(self.from, self.along, f64::INFINITY, |hit| {
            if hit.t > noise && hit.t < wall {
                wall = hit.t;
            }
            std::ops::ControlFlow::Continue(wall)
        });
        if !wall.is_finite() {
            return None;
        }
        let mut near = self.at(wall);
        let mut length = (wall - self.distance) / (1.0 + self.slope);
        for _ in 0..INWARD_SEARCHES {
            if length <= noise {
                return None;
            }
            let Some(nearer) = tree.some_within(self.at(length), self.promise(length), |_| true) else {
                return Some((length, near));
            };
            near = nearer;
            length = (1.0 - INWARD_CUT) * self.reach_against(near).min(length);
        }
        None
    }

    /// Returns the smallest length at which the distance to `x` equals the expected distance.
    fn reach_against(&self, x: DVec3) -> f64 {
        // Solves |w + t u|² = (d + s t)² for the length t.
        let w = self.from - x;
        let square = 1.0 - self.slope * self.slope;
        let half = w.dot(self.along) - self.distance * self.slope;
        let rest = w.length_squared() - self.distance * self.distance;
        let root = (half * half - square * rest).max(0.0).sqrt();
        // This formula gives the smaller root without cancellation. If a root exists, `half` is
        // negative.
        if half < 0.0 { rest / (root - half) } else { 0.0 }
    }
}

/// Returns the point of the convex hull of unit vectors that is nearest to the origin (E. Gilbert,
/// 1966). The length of the returned point is the smallest cosine between its direction and the
/// vectors.
fn shortest_of_hull(normals: &[DVec3]) -> DVec3 {
    let Some(&first) = normals.first() else { return DVec3::ZERO };
    let mut best = first;
    for _ in 0..HULL_POINT_STEPS {
        let mut lowest = first;
        for n in normals {
            if best.dot(*n) < best.dot(lowest) {
                lowest = *n;
            }
        }
        let toward = lowest - best;
        let gain = -best.dot(toward);
        if gain <= HULL_POINT_GAIN {
            break;
        }
        best += toward * (gain / toward.length_squared()).min(1.0);
    }
    best
}
