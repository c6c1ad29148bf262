//! Grows one convex patch: tests whether a set of facets can join it \[EL01\].
//!
//! A set of facets can join if
//!
//! 1. every vertex of the patch lies below the planes of the new facets,
//! 2. every new vertex lies below the planes of the patch's facets, and
//! 3. the common hull stays inside the solid (see `contain`).
//!
//! Tests 1 and 2 ensure, within the surface's noise, that all facets lie on the common hull. These
//! two tests need no hull and refuse most candidates. A set that does not fit a patch does not fit
//! the patch after further growth either, because each test only becomes stricter.
//!
//! There is one exception. While the patch is *flat*, its hull has no interior. Then a coplanar
//! facet joins only if the union is a convex polygon, so that the patch does not cover a notch.
//! Other coplanar facets are postponed until the patch is solid, and then test 3 decides.
//!
//! A patch of a *sheet* ([`Mesh::is_sheet`](crate::body::Mesh::is_sheet)) stays flat. Its other
//! side can be touched too, and the hull of a bent patch would fill the hollow there.
//!
//! A patch with very many facets uses a hull with adjacency (`wide_hull`). Each test then visits
//! only the surroundings of the new facet. Test 1 climbs to the highest vertex. Test 2 tests only
//! the facets at the hull faces that the new vertex sees, because the vertex is not above any other
//! facet. Without this hull, the time for a smooth body with one dent would be quadratic in its
//! size.

use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{ENTERED, FENCE_PLANES, FLAT_PATCH, FOLDED, WIDE_PATCH};
use crate::body::decompose::contain::Clipper;
use crate::body::decompose::facet::{Facets, NONE, Surface};
use crate::body::decompose::trial_hull::TrialHull;
use crate::body::decompose::wide_hull::WideHull;
use crate::body::{Aabb, TriangleTree};

/// Result of [`Grower::try_add`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The set has joined the patch.
    Joined,
    /// The set can never join this patch, even when the patch is larger.
    Refused,
    /// The set cannot join while the patch is flat.
    Postponed,
}

/// A patch and its hull, with working memory for the tests.
pub(crate) struct Grower<'a> {
    surface: Surface<'a>,
    facets: &'a Facets,
    tree: &'a TriangleTree,
    members: Vec<u32>,
    planes: Vec<Plane>,
    points: Vec<DVec3>,
    /// The mesh vertex of each point.
    vertices: Vec<u32>,
    area: f64,
    /// The patch's hull. The hull is empty while the patch is flat, and until the first test that
    /// needs a hull.
    hull: TrialHull,
    /// True if `hull` is up to date, or the patch is known to be flat.
    hull_is_built: bool,
    /// The hull of a patch with at least `wide_from` points.
    wide: Wide,
    is_wide: bool,
    wide_from: usize,
    clipper: Clipper,
    /// The newest planes of the hull. A triangle wholly above one of them cannot enter the hull.
    fence: Vec<Plane>,
    /// Vertices that the tried facets would add.
    fresh: Vec<u32>,
    /// A facet or vertex is in the patch, or is being tried, if its stamp equals `stamp`.
    facet_stamps: Vec<u32>,
    vertex_stamps: Vec<u32>,
    stamp: u32,
    tries: usize,
}

impl<'a> Grower<'a> {
    pub(crate) fn new(surface: Surface<'a>, facets: &'a Facets, tree: &'a TriangleTree) -> Self {
        Self {
            surface,
            facets,
            tree,
            members: Vec::new(),
            planes: Vec::new(),
            points: Vec::new(),
            vertices: Vec::new(),
            area: 0.0,
            hull: TrialHull::default(),
            hull_is_built: true,
            wide: Wide::default(),
            is_wide: false,
            wide_from: WIDE_PATCH,
            clipper: Clipper::default(),
            fence: Vec::new(),
            fresh: Vec::new(),
            facet_stamps: vec![0; facets.len()],
            vertex_stamps: vec![0; surface.vertex_count()],
            stamp: 0,
            tries: 0,
        }
    }

    /// Sets the number of points from which patches use a wide hull. The results must not depend on
    /// this number.
    #[cfg(test)]
    pub(crate) fn with_wide_from(mut self, points: usize) -> Self {
        self.wide_from = points;
        self
    }

    /// Returns the facets of the surface.
    pub(crate) fn facets(&self) -> &'a Facets {
        self.facets
    }

    /// Returns the surface and the tree over its triangles.
    pub(crate) fn ground(&self) -> (Surface<'a>, &'a TriangleTree) {
        (self.surface, self.tree)
    }

    /// Returns the facets of the patch, in the order in which they joined.
    pub(crate) fn members(&self) -> &[u32] {
        &self.members
    }

    /// Returns the number of calls of [`Grower::try_add`], as a measure of work.
    pub(crate) fn tries(&self) -> usize {
        self.tries
    }

    /// Returns true if the patch lies in one plane.
    pub(crate) fn is_flat(&mut self) -> bool {
        if self.is_wide {
            return false;
        }
        if !self.hull_is_built {
            self.hull_is_built = true;
            self.hull.start(&self.points, self.flat_thickness());
        }
        self.hull.is_empty()
    }

    /// Replaces the current patch by `patch`, which must be valid. A single facet is always valid.
    pub(crate) fn load(&mut self, patch: &[u32]) {
        self.stamp += 1;
        self.members.clear();
        self.planes.clear();
        self.points.clear();
        self.vertices.clear();
        self.is_wide = false;
        self.area = 0.0;
        self.gather_fresh(patch);
        self.commit(patch);
        self.hull.clear();
        self.hull_is_built = false;
    }

    /// Adds a set of facets if the patch stays valid. The set by itself must be a valid patch; a
    /// single facet is always valid.
    pub(crate) fn try_add(&mut self, set: &[u32]) -> Verdict {
        self.tries += 1;
        let tolerance = self.surface.noise();
        let above = |plane: Plane, p: DVec3| plane.height(p) > tolerance;
        if self.is_wide {
            return self.try_add_wide(set);
        }
        if set.iter().any(|&c| self.points.iter().any(|p| above(self.facets.plane(c), *p))) {
            return Verdict::Refused;
        }
        self.gather_fresh(set);
        for &c in set {
            self.facet_stamps[c as usize] = self.stamp;
        }
        let convex = !self.fresh.iter().any(|&v| self.planes.iter().any(|plane| above(*plane, self.surface.vertex(v))));
        let verdict = if !convex {
            Verdict::Refused
        } else if self.is_flat() {
            self.leave_plane(set)
        } else {
            self.extend_hull()
        };
        if verdict == Verdict::Joined {
            self.commit(set);
            self.is_wide = self.points.len() >= self.wide_from
                && !self.is_flat()
                && self.wide.start(self.facets, &self.points, &self.vertices, self.flat_thickness());
        } else {
            self.abandon(set);
        }
        verdict
    }

    /// Adds a set to a very large patch, like [`Self::try_add`]. Visits only the surroundings of
    /// the new facets.
    fn try_add_wide(&mut self, set: &[u32]) -> Verdict {
        let tolerance = self.surface.noise();
        let corners: Vec<u32> = set.iter().flat_map(|&c| self.facets.corners(c)).copied().collect();
        if set.iter().any(|&c| self.wide.is_above(self.facets.plane(c), tolerance, &corners)) {
            return Verdict::Refused;
        }
        self.gather_fresh(set);
        let fresh = self.fresh.iter().map(|&v| (v, self.surface.vertex(v)));
        self.wide.insert(fresh, &corners);
        for &c in set {
            self.facet_stamps[c as usize] = self.stamp;
        }
        let Self { wide, facets, facet_stamps, stamp, fresh, surface, .. } = self;
        let is_member = |f: u32| facet_stamps[f as usize] == *stamp && !set.contains(&f);
        let is_spoilt = |f: u32| {
            let plane = facets.plane(f);
            fresh.iter().any(|&v| plane.height(surface.vertex(v)) > tolerance)
        };
        let refused = wide.buried_facets().any(|f| is_member(f) && is_spoilt(f)) || self.is_wide_entered();
        if refused {
            self.wide.undo();
            self.abandon(set);
            Verdict::Refused
        } else {
            self.wide.settle();
            self.commit(set);
            Verdict::Joined
        }
    }

    fn is_wide_entered(&mut self) -> bool {
        let Self { tree, facets, facet_stamps, stamp, wide, surface, fence, .. } = self;
        let depth = ENTERED * surface.noise();
        let Some(bounds) = wide.hull.gained() else { return false };
        wide.hull.fence(fence);
        tree.any_below(&bounds, fence, depth, |t, corners| {
            facet_stamps[facets.of_triangle(t) as usize] != *stamp && wide.hull.enters(*corners, fence, depth)
        })
    }

    fn extend_hull(&mut self) -> Verdict {
        let mark = self.hull.mark();
        for &v in &self.fresh {
            self.hull.insert(self.surface.vertex(v));
        }
        if self.hull.gained_since(mark).is_some_and(|bounds| self.is_entered(&bounds)) {
            self.hull.undo(mark);
            return Verdict::Refused;
        }
        self.hull.settle();
        Verdict::Joined
    }

    fn leave_plane(&mut self, set: &[u32]) -> Verdict {
        let mut points = self.points.clone();
        points.extend(self.fresh.iter().map(|&v| self.surface.vertex(v)));
        if self.hull.start(&points, self.flat_thickness()) {
            if self.is_sheet(set) || self.is_entered(&Aabb::around(points)) {
                self.hull.clear();
                return Verdict::Refused;
            }
            return Verdict::Joined;
        }
        let normal = self.planes[0].normal;
        if set.iter().any(|&c| self.facets.plane(c).normal.dot(normal) < FOLDED) {
            return Verdict::Refused;
        }
        let area = self.area + set.iter().map(|&c| self.facets.area(c)).sum::<f64>();
        let (whole, perimeter) = polygon_around(&points, normal);
        if area >= whole - self.surface.noise() * perimeter { Verdict::Joined } else { Verdict::Postponed }
    }

    /// Returns true if a facet of the patch or of `set` belongs to a sheet.
    fn is_sheet(&self, set: &[u32]) -> bool {
        let of_sheet = |&f: &u32| self.surface.is_sheet(self.facets.triangles(f)[0]);
        set.iter().chain(&self.members).any(of_sheet)
    }

    /// Returns true if a triangle outside the patch enters the hull. Tests only triangles near
    /// `bounds`.
    fn is_entered(&mut self, bounds: &Aabb) -> bool {
        let Self { tree, facets, facet_stamps, stamp, clipper, hull, surface, fence, .. } = self;
        let depth = ENTERED * surface.noise();
        fence.clear();
        fence.extend(hull.planes().take(FENCE_PLANES));
        tree.any_below(bounds, fence, depth, |t, corners| {
            facet_stamps[facets.of_triangle(t) as usize] != *stamp && clipper.enters(*corners, hull.planes(), depth)
        })
    }

    fn flat_thickness(&self) -> f64 {
        FLAT_PATCH * self.surface.noise()
    }

    fn gather_fresh(&mut self, set: &[u32]) {
        self.fresh.clear();
        for &c in set {
            for &v in self.facets.corners(c) {
                if self.vertex_stamps[v as usize] != self.stamp {
                    self.vertex_stamps[v as usize] = self.stamp;
                    self.fresh.push(v);
                }
            }
        }
    }

    fn commit(&mut self, set: &[u32]) {
        for &c in set {
            self.members.push(c);
            self.planes.push(self.facets.plane(c));
            self.area += self.facets.area(c);
            self.facet_stamps[c as usize] = self.stamp;
        }
        self.points.extend(self.fresh.iter().map(|&v| self.surface.vertex(v)));
        self.vertices.extend_from_slice(&self.fresh);
    }

    fn abandon(&mut self, set: &[u32]) {
        for &v in &self.fresh {
            self.vertex_stamps[v as usize] = 0;
        }
        for &c in set {
            self.facet_stamps[c as usize] = 0;
        }
    }
}

/// A wide hull, and maps from mesh vertices to its points and to facets.
#[derive(Default)]
struct Wide {
    hull: WideHull,
    /// Index of each mesh vertex among the hull's points. An entry is valid only if the hull's
    /// point with that index comes from this mesh vertex.
    places: Vec<u32>,
    /// The facets at mesh vertex `v` are `facets_at[first_at[v] .. first_at[v + 1]]`.
    first_at: Vec<u32>,
    facets_at: Vec<u32>,
    buried: Vec<u32>,
}

impl Wide {
    fn start(&mut self, facets: &Facets, points: &[DVec3], vertices: &[u32], thickness: f64) -> bool {
        if self.first_at.is_empty() {
            (self.first_at, self.facets_at) = facets.at_vertices();
            self.places = vec![NONE; self.first_at.len()];
        }
        let started = self.hull.start(points, vertices, thickness);
        for (place, &v) in self.hull.vertices().iter().enumerate() {
            self.places[v as usize] = place as u32;
        }
        started
    }

    /// Returns the indices of the given mesh vertices among the hull's points. Leaves out
    /// vertices that are not points of the hull.
    fn places_of(&self, vertices: &[u32]) -> Vec<u32> {
        let place = |&v: &u32| self.hull.vertices().get(self.places[v as usize] as usize).filter(|&&w| w == v);
        vertices.iter().filter(|v| place(v).is_some()).map(|&v| self.places[v as usize]).collect()
    }

    fn is_above(&self, plane: Plane, tolerance: f64, corners: &[u32]) -> bool {
        self.hull.is_above(plane, tolerance, self.hull.corner_among(&self.places_of(corners)))
    }

    /// Inserts vertices. `corners` are the corners of the facets to which the vertices belong.
    fn insert(&mut self, fresh: impl Iterator<Item = (u32, DVec3)>, corners: &[u32]) {
        for (v, p) in fresh {
            let beside = self.places_of(corners);
            if self.hull.insert(p, v, &beside) {
                self.places[v as usize] = self.hull.vertices().len() as u32 - 1;
            }
        }
        self.hull.buried_vertices(&mut self.buried);
    }

    /// Returns the facets at the corners of the hull faces that the insertion removed. A facet may
    /// occur several times.
    fn buried_facets(&self) -> impl Iterator<Item = u32> {
        let at = |v: u32| self.first_at[v as usize] as usize..self.first_at[v as usize + 1] as usize;
        self.buried.iter().flat_map(move |&v| self.facets_at[at(v)].iter().copied())
    }

    fn undo(&mut self) {
        self.hull.undo();
    }

    fn settle(&mut self) {
        self.hull.settle();
    }
}

/// Returns the area and the perimeter of the convex polygon around coplanar points (Andrew's
/// monotone chain).
fn polygon_around(points: &[DVec3], normal: DVec3) -> (f64, f64) {
    let x = normal.any_orthonormal_vector();
    let y = normal.cross(x);
    let mut flat: Vec<(f64, f64)> = points.iter().map(|p| (x.dot(*p), y.dot(*p))).collect();
    flat.sort_by(|p, q| p.0.total_cmp(&q.0).then(p.1.total_cmp(&q.1)));
    let mut ring: Vec<(f64, f64)> = Vec::new();
    for _ in 0..2 {
        let base = ring.len();
        for &p in &flat {
            while ring.len() >= base + 2 {
                let (a, b) = (ring[ring.len() - 2], ring[ring.len() - 1]);
                if (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0) > 0.0 {
                    break;
                }
                ring.pop();
            }
            ring.push(p);
        }
        ring.pop();
        flat.reverse();
    }
    let mut sums = (0.0, 0.0);
    for (k, p) in ring.iter().enumerate() {
        let q = ring[(k + 1) % ring.len()];
        sums.0 += 0.5 * (p.0 * q.1 - p.1 * q.0);
        sums.1 += (p.0 - q.0).hypot(p.1 - q.1);
    }
    sums
}
