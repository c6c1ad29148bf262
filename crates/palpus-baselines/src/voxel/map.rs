//! The environment as voxels: free space, interior, surface, and layers around it.

use std::collections::{BTreeMap, VecDeque};

use glam::DVec3;
use palpus::body::Body;

use super::grid::Grid;
use crate::BaselineError;

/// Kind of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Nothing is near.
    Free,
    /// Points are braked here.
    Braking,
    /// The force field: the surface, or a layer of proximity voxels around it.
    Force,
    /// Behind the force field: proximity nearer to the surface, surface and solid.
    Behind,
}

/// Voxels of the environment, in its frame.
#[derive(Clone, Debug)]
pub(super) struct Voxmap {
    grid: Grid,
    kinds: Vec<Kind>,
    /// For voxels behind the force field the nearest one of the field, for those of the field
    /// themselves; otherwise a mark.
    field: Vec<u32>,
}

const NONE: u32 = u32::MAX;
/// Memory for a voxel.
const BYTES: usize = 1 + 4;

impl Voxmap {
    /// Voxels of `size` whose force field lies `offset` layers outside the surface.
    pub(super) fn new(body: &Body, size: f64, offset: u32, memory: usize) -> Result<Self, BaselineError> {
        // One more layer for braking, and a free one, through which all that is outside hangs
        // together.
        let margin = offset.min(MOST_LAYERS) as i32 + 2;
        let grid = Grid::around(&body.mesh().bounds(), size, margin, BYTES, memory)?;
        let surface = surface_voxels(body, &grid);
        let mut kinds = solid(body, &grid, &surface);
        let mut layer = surface;
        for _ in 0..offset.min(MOST_LAYERS) {
            layer.iter().for_each(|&voxel| kinds[voxel] = Kind::Behind);
            layer = next_layer(&grid, &mut kinds, &layer, Kind::Force);
        }
        next_layer(&grid, &mut kinds, &layer, Kind::Braking);
        let field = nearest_of_field(&grid, &kinds, &layer);
        Ok(Self { grid, kinds, field })
    }

    /// Returns the kind at a point, and the centre of the voxel of the force field that applies to
    /// it.
    pub(super) fn at(&self, p: DVec3) -> (Kind, DVec3) {
        let Some(voxel) = self.grid.holding(p) else { return (Kind::Free, p) };
        match self.field[voxel] {
            NONE => (self.kinds[voxel], p),
            field => (self.kinds[voxel], self.grid.center(field as usize)),
        }
    }
}

/// Most layers by which a force field may be moved outward; a larger value is taken for an error.
pub(super) const MOST_LAYERS: u32 = 64;

/// Every voxel that the surface meets, in the order of their numbers.
fn surface_voxels(body: &Body, grid: &Grid) -> Vec<usize> {
    let mut met = vec![false; grid.len()];
    for t in 0..body.mesh().triangles().len() as u32 {
        grid.visit_met(&body.mesh().triangle_points(t), |voxel| met[voxel] = true);
    }
    (0..met.len()).filter(|&voxel| met[voxel]).collect()
}

/// Surface voxels as the force field, what they enclose behind it. Each part of the rest that hangs
/// together is asked once whether it lies in the solid.
fn solid(body: &Body, grid: &Grid, surface: &[usize]) -> Vec<Kind> {
    let mut kinds: Vec<Option<Kind>> = vec![None; grid.len()];
    surface.iter().for_each(|&voxel| kinds[voxel] = Some(Kind::Force));
    let mut stack = Vec::new();
    for start in 0..kinds.len() {
        if kinds[start].is_some() {
            continue;
        }
        let kind = if body.tree().inside(grid.center(start)) { Kind::Behind } else { Kind::Free };
        kinds[start] = Some(kind);
        stack.push(start);
        while let Some(voxel) = stack.pop() {
            for other in grid.beside(voxel) {
                if kinds[other].is_none() {
                    kinds[other] = Some(kind);
                    stack.push(other);
                }
            }
        }
    }
    kinds.into_iter().map(|kind| kind.unwrap_or(Kind::Free)).collect()
}

/// Gives `kind` to the free voxels around a layer, and answers them.
fn next_layer(grid: &Grid, kinds: &mut [Kind], layer: &[usize], kind: Kind) -> Vec<usize> {
    let mut next = Vec::new();
    for &voxel in layer {
        for other in grid.around_voxel(voxel) {
            if kinds[other] == Kind::Free {
                kinds[other] = kind;
                next.push(other);
            }
        }
    }
    next
}

/// For every voxel of the field and behind it the nearest one of the field, handed on from
/// neighbour to neighbour.
fn nearest_of_field(grid: &Grid, kinds: &[Kind], field: &[usize]) -> Vec<u32> {
    let mut nearest = vec![NONE; grid.len()];
    let mut waiting: VecDeque<usize> = field.iter().copied().collect();
    field.iter().for_each(|&voxel| nearest[voxel] = voxel as u32);
    let distance = |voxel: usize, to: u32| grid.center(voxel).distance_squared(grid.center(to as usize));
    while let Some(voxel) = waiting.pop_front() {
        let own = nearest[voxel];
        for other in grid.around_voxel(voxel).filter(|&other| kinds[other] == Kind::Behind) {
            if nearest[other] == NONE || distance(other, own) < distance(other, nearest[other]) {
                nearest[other] = own;
                waiting.push_back(other);
            }
        }
    }
    nearest
}

/// The centres of the voxels that a body's surface meets, with the mean of its triangles' normals
/// there: the body's *point shell*, in its frame.
pub(super) fn point_shell(body: &Body, size: f64, memory: usize) -> Result<Vec<ShellPoint>, BaselineError> {
    let grid = Grid::around(&body.mesh().bounds(), size, 1, 1, memory)?;
    let mut outward: BTreeMap<usize, DVec3> = BTreeMap::new();
    for t in 0..body.mesh().triangles().len() as u32 {
        let normal = body.mesh().triangle_normal(t);
        grid.visit_met(&body.mesh().triangle_points(t), |voxel| *outward.entry(voxel).or_default() += normal);
    }
    let point = |(voxel, sum): (usize, DVec3)| {
        let center = grid.center(voxel);
        let normal = if sum.length() > CANCELLED {
            sum.normalize()
        } else {
            body.mesh().triangle_normal(body.tree().nearest(center)?.triangle)
        };
        Some(ShellPoint { center, inward: -normal })
    };
    Ok(outward.into_iter().filter_map(point).collect())
}

/// A sum of unit normals shorter than this has no reliable direction (opposite sides of a sheet in
/// one voxel). The nearest triangle's normal is used instead.
const CANCELLED: f64 = 1e-6;

/// A sample of the probe's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShellPoint {
    /// In the probe's frame, m.
    pub(super) center: DVec3,
    /// Unit, into the probe.
    pub(super) inward: DVec3,
}
