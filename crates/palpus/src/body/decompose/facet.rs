//! Facets: convex planar polygons of merged coplanar triangles. Patches are grown from facets \[K02
//! §3.2\].
//!
//! Programs cut a planar face, such as the cap of a CAD part, into many triangles. The tool of
//! \[EL01\] treats the edges between these triangles as reflex. This module removes the edges
//! before the decomposition.
//!
//! 1. *Regions.* Start at the largest triangle without a region, and add neighbours by flood fill.
//!    A triangle belongs to the region if all its vertices lie within the surface's noise of the
//!    plane of the **first** triangle. Therefore a long chain of nearly coplanar triangles cannot
//!    drift.
//! 2. *Convex partition* (Hertel and Mehlhorn). Remove the sides between the polygons of a region,
//!    longest first, if the corners at both ends stay convex. Repeat until no side can be removed.
//!    Earlier removals can leave two polygons that meet along a chain of collinear sides. Then
//!    remove the whole chain at once.
//! 3. *Links.* Find which facets meet along a side, and whether the surface is convex, coplanar or
//!    reflex at this side.
//!
//! The result is deterministic: of equal candidates, the one with the smaller index is taken.

use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{COPLANAR, FOLDED, NOISE_PER_STEP};
use crate::body::{HalfEdges, Mesh};

/// Stands for a missing index of a facet, a vertex or another item.
pub(crate) const NONE: u32 = u32::MAX;

/// Kind of bend between two neighbouring facets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bend {
    /// Each facet lies below the plane of the other.
    Convex,
    /// Both facets lie in one plane.
    Coplanar,
    /// One facet rises above the plane of the other, so both cannot lie on one hull.
    Reflex,
}

/// A neighbour of a facet across a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Link {
    pub(crate) facet: u32,
    pub(crate) bend: Bend,
}

/// A mesh with the neighbours of its triangles.
#[derive(Clone, Copy)]
pub(crate) struct Surface<'a> {
    mesh: &'a Mesh,
    edges: &'a HalfEdges,
    noise: f64,
}

impl<'a> Surface<'a> {
    /// Creates a surface. `step` is the distance between neighbouring values of the file's
    /// coordinates (m), or zero if it is unknown. The noise follows from `step`, but is at most
    /// `flatness` times the mesh's bounding diagonal. The limit is needed for models that a person
    /// wrote with few digits: their coordinates are exact.
    pub(crate) fn new(mesh: &'a Mesh, edges: &'a HalfEdges, step: f64, flatness: f64) -> Self {
        let size = mesh.bounding_diagonal();
        let noise = (NOISE_PER_STEP * step).clamp(COPLANAR * size, flatness.max(COPLANAR) * size);
        Self { mesh, edges, noise }
    }

    /// Returns the noise: the largest distance of the vertices of a planar face from its plane (m).
    pub(crate) fn noise(&self) -> f64 {
        self.noise
    }

    pub(crate) fn vertex(&self, v: u32) -> DVec3 {
        self.mesh.vertices()[v as usize]
    }

    pub(crate) fn vertex_count(&self) -> usize {
        self.mesh.vertices().len()
    }

    /// Returns the connected component of triangle `t`.
    pub(crate) fn component(&self, t: u32) -> u32 {
        self.mesh.component(t)
    }

    /// Returns the number of triangles of each component.
    pub(crate) fn component_sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; self.mesh.component_count()];
        (0..self.triangle_count()).for_each(|t| sizes[self.component(t) as usize] += 1);
        sizes
    }

    /// Returns true if a component is closed.
    pub(crate) fn is_closed(&self, component: u32) -> bool {
        self.mesh.is_component_closed(component)
    }

    /// Returns true if triangle `t` belongs to a sheet.
    pub(crate) fn is_sheet(&self, t: u32) -> bool {
        self.mesh.is_sheet(t)
    }

    fn triangle_count(&self) -> u32 {
        self.mesh.triangles().len() as u32
    }

    fn triangle(&self, t: u32) -> [u32; 3] {
        self.mesh.triangles()[t as usize]
    }

    /// Returns the neighbours of triangle `t`, as pairs of side and triangle.
    fn across(&self, t: u32) -> impl Iterator<Item = (usize, u32)> + use<'a> {
        let edges = self.edges;
        (0..3).filter_map(move |k| edges.neighbour(t, k).map(|(n, _)| (k, n)))
    }

    fn plane(&self, t: u32) -> Plane {
        let [a, b, c] = self.mesh.triangle_points(t);
        let normal = self.mesh.triangle_normal(t);
        Plane { normal, offset: normal.dot((a + b + c) / 3.0) }
    }
}

/// The convex planar facets of a surface. Each triangle is in exactly one facet.
#[derive(Clone, Debug, Default)]
pub(crate) struct Facets {
    planes: Vec<Plane>,
    areas: Vec<f64>,
    loop_starts: Vec<u32>,
    loop_vertices: Vec<u32>,
    triangle_starts: Vec<u32>,
    triangles: Vec<u32>,
    facet_of: Vec<u32>,
    link_starts: Vec<u32>,
    links: Vec<Link>,
}

impl Facets {
    /// Partitions the triangles of a surface into facets.
    pub(crate) fn of(surface: &Surface<'_>) -> Self {
        let planes: Vec<Plane> = (0..surface.triangle_count()).map(|t| surface.plane(t)).collect();
        let regions = coplanar_regions(surface, &planes);
        let polygons = convex_partition(surface, &planes, &regions);
        let mut facets = collect(surface, &planes, &regions, &polygons);
        facets.link(surface);
        facets
    }

    /// Returns the number of facets.
    pub(crate) fn len(&self) -> usize {
        self.planes.len()
    }

    /// Returns the outward plane of facet `f`.
    pub(crate) fn plane(&self, f: u32) -> Plane {
        self.planes[f as usize]
    }

    /// Returns the area of facet `f` (m²).
    pub(crate) fn area(&self, f: u32) -> f64 {
        self.areas[f as usize]
    }

    /// Returns the mesh vertices around facet `f`, counter-clockwise as seen from outside. Some of
    /// them may be collinear.
    pub(crate) fn corners(&self, f: u32) -> &[u32] {
        &self.loop_vertices[self.loop_starts[f as usize] as usize..self.loop_starts[f as usize + 1] as usize]
    }

    /// Returns the mesh triangles of facet `f`.
    pub(crate) fn triangles(&self, f: u32) -> &[u32] {
        &self.triangles[self.triangle_starts[f as usize] as usize..self.triangle_starts[f as usize + 1] as usize]
    }

    /// Returns the facet of triangle `t`.
    pub(crate) fn of_triangle(&self, t: u32) -> u32 {
        self.facet_of[t as usize]
    }

    /// Returns the facets that meet facet `f` along a side, by ascending index.
    pub(crate) fn links(&self, f: u32) -> &[Link] {
        &self.links[self.link_starts[f as usize] as usize..self.link_starts[f as usize + 1] as usize]
    }

    /// Returns the facets at each mesh vertex as two flat arrays. The first array has the start of
    /// each vertex's entries, and the end of the last one. The second array has all entries.
    pub(crate) fn at_vertices(&self) -> (Vec<u32>, Vec<u32>) {
        let vertices = self.loop_vertices.iter().max().map_or(0, |&v| v as usize + 1);
        let mut starts = vec![0; vertices + 1];
        for &v in &self.loop_vertices {
            starts[v as usize + 1] += 1;
        }
        for v in 0..vertices {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut facets = vec![NONE; self.loop_vertices.len()];
        for f in 0..self.len() as u32 {
            for &v in self.corners(f) {
                facets[next[v as usize] as usize] = f;
                next[v as usize] += 1;
            }
        }
        (starts, facets)
    }

    fn link(&mut self, surface: &Surface<'_>) {
        self.link_starts = vec![0];
        let mut near: Vec<u32> = Vec::new();
        for f in 0..self.len() as u32 {
            near.clear();
            for &t in self.triangles(f) {
                near.extend(surface.across(t).map(|(_, n)| self.of_triangle(n)).filter(|&g| g != f));
            }
            near.sort_unstable();
            near.dedup();
            for &g in &near {
                let bend = self.bend(surface, f, g);
                self.links.push(Link { facet: g, bend });
            }
            self.link_starts.push(self.links.len() as u32);
        }
    }

    fn bend(&self, surface: &Surface<'_>, f: u32, g: u32) -> Bend {
        let tolerance = surface.noise();
        let span = |plane: Plane, facet: u32| {
            let heights = self.corners(facet).iter().map(|&v| plane.height(surface.vertex(v)));
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)))
        };
        let (f_plane, g_plane) = (self.plane(f), self.plane(g));
        let (g_low, g_high) = span(f_plane, g);
        let (f_low, f_high) = span(g_plane, f);
        if g_high.max(f_high) > tolerance {
            Bend::Reflex
        } else if g_low.min(f_low) < -tolerance {
            Bend::Convex
        } else if f_plane.normal.dot(g_plane.normal) > FOLDED {
            Bend::Coplanar
        } else {
            Bend::Reflex
        }
    }
}

/// Returns for each triangle the first triangle of its region, whose plane is the plane of the
/// region.
fn coplanar_regions(surface: &Surface<'_>, planes: &[Plane]) -> Vec<u32> {
    let count = surface.triangle_count();
    let areas: Vec<f64> = (0..count).map(|t| surface.mesh.triangle_area(t)).collect();
    let mut order: Vec<u32> = (0..count).collect();
    order.sort_by(|&s, &t| areas[t as usize].total_cmp(&areas[s as usize]).then(s.cmp(&t)));
    let tolerance = surface.noise();
    let mut region = vec![NONE; count as usize];
    let mut front = Vec::new();
    for first in order {
        if region[first as usize] != NONE {
            continue;
        }
        region[first as usize] = first;
        front.push(first);
        let plane = planes[first as usize];
        while let Some(t) = front.pop() {
            for (_, n) in surface.across(t) {
                if region[n as usize] != NONE || planes[n as usize].normal.dot(plane.normal) < FOLDED {
                    continue;
                }
                if surface.mesh.triangle_points(n).iter().all(|p| plane.height(*p).abs() <= tolerance) {
                    region[n as usize] = first;
                    front.push(n);
                }
            }
        }
    }
    region
}

/// A polygon of the unfinished partition.
struct Polygon {
    corners: Vec<u32>,
    triangles: Vec<u32>,
}

/// Merges the triangles of each region into convex polygons. Polygons that were merged into others
/// stay in the list without triangles.
fn convex_partition(surface: &Surface<'_>, planes: &[Plane], regions: &[u32]) -> Vec<Polygon> {
    let mut polygons: Vec<Polygon> = (0..surface.triangle_count())
        .map(|t| Polygon { corners: surface.triangle(t).to_vec(), triangles: vec![t] })
        .collect();
    let mut owner: Vec<u32> = (0..polygons.len() as u32).collect();
    let mut sides = inner_sides(surface, regions);
    loop {
        let before = sides.len();
        sides.retain(|&(tail, head, t, n)| {
            let (left, right) = (owner[t as usize], owner[n as usize]);
            if left == right {
                return false;
            }
            let normal = planes[regions[t as usize] as usize].normal;
            let (keep, gone) = if polygons[left as usize].corners.len() >= polygons[right as usize].corners.len() {
                (left, right)
            } else {
                (right, left)
            };
            let side = if keep == left { (tail, head) } else { (head, tail) };
            let (large, small) = (&polygons[keep as usize].corners, &polygons[gone as usize].corners);
            let Some(union) = join(surface, normal, large, small, side) else { return true };
            let moved = std::mem::take(&mut polygons[gone as usize].triangles);
            for &m in &moved {
                owner[m as usize] = keep;
            }
            polygons[gone as usize].corners.clear();
            polygons[keep as usize].corners = union;
            polygons[keep as usize].triangles.extend(moved);
            false
        });
        if sides.len() == before {
            return polygons;
        }
    }
}

/// Returns the sides inside regions, longest first. Each tuple has the tail, the head, the triangle
/// to the left and the triangle to the right.
fn inner_sides(surface: &Surface<'_>, regions: &[u32]) -> Vec<(u32, u32, u32, u32)> {
    let mut sides = Vec::new();
    for t in 0..surface.triangle_count() {
        for (k, n) in surface.across(t) {
            if t < n && regions[t as usize] == regions[n as usize] {
                let corners = surface.triangle(t);
                sides.push((corners[k], corners[(k + 1) % 3], t, n));
            }
        }
    }
    let length = |side: &(u32, u32, u32, u32)| surface.vertex(side.0).distance_squared(surface.vertex(side.1));
    sides.sort_by(|s, t| length(t).total_cmp(&length(s)).then((s.2, s.3).cmp(&(t.2, t.3))));
    sides
}

/// Returns the union of two convex polygons that share the side `tail → head` of `large`; `None` if
/// the union is not convex.
fn join(
    surface: &Surface<'_>,
    normal: DVec3,
    large: &[u32],
    small: &[u32],
    (tail, head): (u32, u32),
) -> Option<Vec<u32>> {
    let (n, m) = (large.len(), small.len());
    let position = |corners: &[u32], u: u32, v: u32| {
        (0..corners.len()).find(|&k| corners[k] == u && corners[(k + 1) % corners.len()] == v)
    };
    let mut start = position(large, tail, head)?;
    let mut end = (start + 1) % n;
    // In `small`, the shared chain has the opposite direction.
    let mut small_end = position(small, head, tail)?;
    let mut small_start = (small_end + 1) % m;
    let mut shared = 1;
    while shared < n.min(m) - 1 && large[(end + 1) % n] == small[(small_end + m - 1) % m] {
        end = (end + 1) % n;
        small_end = (small_end + m - 1) % m;
        shared += 1;
    }
    while shared < n.min(m) - 1 && large[(start + n - 1) % n] == small[(small_start + 1) % m] {
        start = (start + n - 1) % n;
        small_start = (small_start + 1) % m;
        shared += 1;
    }
    let turn = |u: u32, v: u32, w: u32| {
        let [u, v, w] = [u, v, w].map(|k| surface.vertex(k));
        // At a left turn, v lies to the right of the line u → w. The first condition tests the
        // distance of v from this line.
        normal.cross(w - u).normalize_or_zero().dot(u - v) >= -surface.noise()
            && (v - u).dot(w - v) > -(v - u).length() * (w - v).length()
    };
    if !turn(large[(start + n - 1) % n], large[start], small[(small_start + 1) % m])
        || !turn(small[(small_end + m - 1) % m], large[end], large[(end + 1) % n])
    {
        return None;
    }
    let mut union: Vec<u32> = (0..n - shared).map(|k| large[(end + k) % n]).collect();
    union.extend((0..m - shared).map(|k| small[(small_start + k) % m]));
    Some(union)
}

fn collect(surface: &Surface<'_>, planes: &[Plane], regions: &[u32], polygons: &[Polygon]) -> Facets {
    let mut facets = Facets {
        loop_starts: vec![0],
        triangle_starts: vec![0],
        facet_of: vec![NONE; surface.mesh.triangles().len()],
        ..Facets::default()
    };
    for polygon in polygons.iter().filter(|p| !p.triangles.is_empty()) {
        let f = facets.planes.len() as u32;
        facets.planes.push(planes[regions[polygon.triangles[0] as usize] as usize]);
        facets.areas.push(polygon.triangles.iter().map(|&t| surface.mesh.triangle_area(t)).sum());
        facets.loop_vertices.extend_from_slice(&polygon.corners);
        facets.loop_starts.push(facets.loop_vertices.len() as u32);
        for &t in &polygon.triangles {
            facets.facet_of[t as usize] = f;
        }
        facets.triangles.extend_from_slice(&polygon.triangles);
        facets.triangle_starts.push(facets.triangles.len() as u32);
    }
    facets
}
