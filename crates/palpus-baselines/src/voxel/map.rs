//! The environment as voxels: free space, interior, surface, and the layers around the surface.

use std::collections::{BTreeMap, VecDeque};

use glam::DVec3;
use palpus::body::Body;

use super::grid::Grid;
use crate::BaselineError;

/// Kind of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Free space, far from the surface.
    Free,
    /// The layer outside the force field, where approaching points are braked.
    Braking,
    /// The force field: the surface, or a layer of proximity voxels outside it.
    Force,
    /// Behind the force field: layers between the field and the surface, the surface, and the
    /// interior.
    Behind,
}

/// Voxels of the environment, in its frame.
#[derive(Clone, Debug)]
pub(super) struct Voxmap {
    grid: Grid,
    kinds: Vec<Kind>,
    /// The nearest voxel of the force field, for voxels in the field and behind it; otherwise
    /// [`NONE`].
    field: Vec<u32>,
}

const NONE: u32 = u32::MAX;
/// Memory for a voxel, bytes.
const BYTES: usize = 1 + 4;

impl Voxmap {
    /// Makes voxels of `size` (m) whose force field lies `offset` layers outside the surface.
    pub(super) fn new(body: &Body, size: f64, offset: u32, memory: usize) -> Result<Self, BaselineError> {
        // One additional layer is for braking. Another layer stays free and connects the whole
        // outside space.
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

    /// Returns the kind of the voxel at a point, and the centre of the nearest voxel of the force
    /// field.
    pub(super) fn at(&self, p: DVec3) -> (Kind, DVec3) {
        let Some(voxel) = self.grid.holding(p) else { return (Kind::Free, p) };
        match self.field[voxel] {
            NONE => (self.kinds[voxel], p),
            field => (self.kinds[voxel], self.grid.center(field as usize)),
        }
    }
}

/// Largest number of layers between the surface and the force field; a larger value is an error.
pub(super) const MOST_LAYERS: u32 = 64;

/// Returns all voxels that the surface meets, sorted by number.
fn surface_voxels(body: &Body, grid: &Grid) -> Vec<usize> {
    let mut met = vec![false; grid.len()];
    for t in 0..body.mesh().triangles().len() as u32 {
        grid.visit_met(&body.mesh().triangle_points(t), |voxel| met[voxel] = true);
    }
    (0..met.len()).filter(|&voxel| met[voxel]).collect()
}

/// Marks surface voxels as the force field and interior voxels as behind it. For each connected
/// region of other voxels, one query decides whether the region is inside.
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

/// Sets the free voxels around a layer to `kind`, and returns them.
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

/// Returns the nearest voxel of the field for each voxel in the field and behind it. The search
/// spreads from neighbour to neighbour.
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

/// Returns the *point shell* of a body in its frame: the centres of the voxels that its surface
/// meets, with the mean normal of the triangles there.
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

/// If the sum of the unit normals in a voxel is shorter than this, the normal of the nearest
/// triangle is used instead. An example is a voxel with two opposite sides of a sheet.
const CANCELLED: f64 = 1e-6;

/// A sample point of the probe's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShellPoint {
    /// Position in the probe's frame, m.
    pub(super) center: DVec3,
    /// Unit normal into the probe.
    pub(super) inward: DVec3,
}
