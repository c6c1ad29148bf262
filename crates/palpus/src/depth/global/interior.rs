//! The inside of a solid as overlapping convex cells, computed once for each body.
//!
//! 1. Sample the surface: take the middle of each triangle, a point near each corner, and more
//!    points in large triangles.
//! 2. For each sample, find the largest ball in the solid that touches the surface at the sample
//!    (shrinking ball: J. Ma, S. Bae, S. Choi, *3D Medial Axis Point Approximation Using Nearest
//!    Neighbors and the Normal Field*, 2012).
//! 3. Process the balls in order of decreasing radius. Grow a cell around the centre of each ball,
//!    unless the ball's sample already lies in a cell.
//!
//! A surface that is not closed has no inside and no cells.

use glam::DVec3;

use super::cell::Cell;
use super::containment::first_vertices;
use super::slabs::{BoxTree, Slabs};
use crate::algebra::tolerance::{
    CELL_BATCH, CELL_BEYOND, CELL_DEPTH, CELL_SAMPLES, CELLS, CONVEX_SHORTFALL, SHRINKING_BALL_DONE,
    SHRINKING_BALL_STEPS,
};
use crate::algebra::{Workers, map_in_order};
use crate::body::{Body, Mesh};

/// Convex cells that fill a solid well enough for [`GlobalDepth`](super::GlobalDepth), in the
/// body's frame.
#[derive(Clone, Debug)]
pub struct Interior {
    pub(super) cells: Vec<Cell>,
    /// The slabs of the cells.
    pub(super) slabs: Vec<Slabs>,
    pub(super) tree: BoxTree,
    /// One vertex of each component of the surface.
    pub(super) components: Vec<DVec3>,
    /// Upper bound of the distance by which the piece of a convex solid extends beyond the solid.
    /// `None` if the solid is not convex.
    pub(super) convex: Option<f64>,
}

/// A point of the surface, and the ball below it.
#[derive(Clone, Copy)]
struct Sample {
    /// A point just below the surface; the cell should contain it.
    keep: DVec3,
    center: DVec3,
    radius: f64,
}

impl Interior {
    /// Computes the cells of `body`. The result does not depend on `workers`. Calls `progress` with
    /// the finished fraction, which rises to 1.
    pub fn new(body: &Body, workers: &dyn Workers, progress: &mut dyn FnMut(f64)) -> Self {
        let mesh = body.mesh();
        let components = first_vertices(mesh);
        if !mesh.is_closed() {
            progress(1.0);
            return Self::of_cells(body, Vec::new(), components);
        }
        let points = sample_points(mesh);
        let ball = |k: usize| ball_below(body, points[k].0, points[k].1);
        let balls = map_in_order(workers, points.len(), CELL_BATCH, ball, &mut |done| progress(0.5 * done));
        let mut samples: Vec<Sample> = balls.into_iter().flatten().collect();
        samples.sort_by(|p, q| q.radius.total_cmp(&p.radius));
        let cells = cover(body, samples, workers, &mut |done| progress(0.5 + 0.5 * done));
        progress(1.0);
        Self::of_cells(body, cells, components)
    }

    fn of_cells(body: &Body, cells: Vec<Cell>, components: Vec<DVec3>) -> Self {
        let slabs: Vec<Slabs> = cells.iter().map(|cell| Slabs::around(cell.corners.iter().copied())).collect();
        let boxes: Vec<_> = slabs.iter().map(Slabs::bounds).collect();
        let convex = shortfall(body).filter(|&gap| gap <= CONVEX_SHORTFALL * body.size());
        Self { cells, slabs, tree: BoxTree::new(&boxes), components, convex }
    }

    /// Returns the number of cells.
    pub fn cell_count(&self) -> usize {
        self.cells.len()
    }
}

/// Returns an upper bound of the distance by which the piece of a convex body extends beyond the
/// solid. `None` if the body is not convex.
///
/// Let e be the largest distance by which the piece extends beyond the planes of the triangles. The
/// surface of the solid is at most e away from the surface of the piece. So the solid contains all
/// points of the piece that are deeper than e. Let r be the radius of a ball around the centroid
/// inside the piece. Shrinking the piece toward its centroid by the fraction e / r leaves only
/// points that are deeper than e.
fn shortfall(body: &Body) -> Option<f64> {
    let mesh = body.mesh();
    let [piece] = body.polytopes() else { return None };
    if piece.is_flat() || !mesh.is_closed() || mesh.component_count() != 1 {
        return None;
    }
    let center = piece.centroid();
    let inner = piece.planes().iter().map(|plane| -plane.height(center)).fold(f64::INFINITY, f64::min);
    let outer = piece.vertices().iter().map(|p| p.distance(center)).fold(0.0, f64::max);
    let beyond = |t: u32| {
        let (normal, corner) = (mesh.triangle_normal(t), mesh.triangle_points(t)[0]);
        normal.dot(piece.vertices()[piece.support(normal) as usize] - corner)
    };
    let beyond = (0..mesh.triangles().len() as u32).map(beyond).fold(0.0, f64::max);
    (beyond < inner && body.tree().inside(center)).then(|| beyond / inner * outer)
}

/// Returns points of the surface with their outward normals.
fn sample_points(mesh: &Mesh) -> Vec<(DVec3, DVec3)> {
    let count = mesh.triangles().len();
    let stride = count.div_ceil(CELL_SAMPLES).max(1);
    let area: f64 = (0..count as u32).map(|t| mesh.triangle_area(t)).sum();
    let mut points = Vec::new();
    for t in (0..count as u32).step_by(stride) {
        let normal = mesh.triangle_normal(t);
        let [a, b, c] = mesh.triangle_points(t);
        let middle = (a + b + c) / 3.0;
        points.push((middle, normal));
        if 4 * count > CELL_SAMPLES {
            continue;
        }
        // Samples a square grid in barycentric coordinates. The number of rows follows from the
        // triangle's fraction of the total area.
        let share = mesh.triangle_area(t) / area * (CELL_SAMPLES - 4 * count) as f64;
        let rows = (share * 2.0).sqrt().floor() as usize;
        for i in 0..rows {
            for j in 0..rows - i {
                let (u, v) = ((i as f64 + 1.0 / 3.0) / rows as f64, (j as f64 + 1.0 / 3.0) / rows as f64);
                points.push((a + (b - a) * u + (c - a) * v, normal));
            }
        }
        points.extend([a, b, c].map(|corner| (corner + (middle - corner) * 0.1, normal)));
    }
    points
}

/// Returns the largest ball in the solid that touches the surface at `point`. `None` if the ball is
/// too small.
fn ball_below(body: &Body, point: DVec3, normal: DVec3) -> Option<Sample> {
    let size = body.size();
    let mut radius = 0.5 * size;
    for _ in 0..SHRINKING_BALL_STEPS {
        let center = point - normal * radius;
        let nearest = body.tree().nearest(center)?;
        if nearest.distance >= radius * (1.0 - SHRINKING_BALL_DONE) {
            break;
        }
        let chord = point - nearest.point;
        let drop = normal.dot(chord);
        if drop <= 0.0 {
            return None;
        }
        radius = chord.length_squared() / (2.0 * drop);
    }
    let center = point - normal * radius;
    let radius = body.tree().nearest(center)?.distance;
    if radius <= CELL_BEYOND * size || !body.tree().inside(center) {
        return None;
    }
    let keep = point - normal * (CELL_DEPTH * size).min(0.5 * radius);
    Some(Sample { keep, center, radius })
}

/// Grows cells until each sample lies in a cell. `samples` is sorted by decreasing radius.
fn cover(body: &Body, mut samples: Vec<Sample>, workers: &dyn Workers, progress: &mut dyn FnMut(f64)) -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    let all = samples.len().max(1) as f64;
    while !samples.is_empty() && cells.len() < CELLS {
        // The size of a batch does not depend on the number of workers.
        let batch: Vec<Sample> = samples.drain(..samples.len().min(CELL_BATCH)).collect();
        let grow = |k: usize| Cell::grow(body.tree(), batch[k].center, batch[k].keep, body.size());
        let grown = map_in_order(workers, batch.len(), 1, grow, &mut |_| ());
        let first_new = cells.len();
        for (sample, cell) in batch.iter().zip(grown) {
            let covered = cells[first_new..].iter().any(|cell| cell.holds(sample.keep));
            if let Some(cell) = cell.filter(|_| !covered) {
                cells.push(cell);
            }
        }
        let new = &cells[first_new..];
        samples.retain(|sample| !new.iter().any(|cell| cell.holds(sample.keep)));
        progress(1.0 - samples.len() as f64 / all);
    }
    cells
}
