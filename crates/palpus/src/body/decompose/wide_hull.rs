//! The hull of a large patch. Unlike `trial_hull`, it stores the neighbours of each face, so that
//! no step visits the whole hull.
//!
//! A patch of 50 000 facets needs 50 000 tests of whether another facet may join. Each test
//! consists of local operations:
//!
//! 1. *Insertion* adds a point. The search starts at a nearby vertex and finds a face that the
//!    point sees. All faces that the point sees are removed. A fan of new faces closes the hole.
//!    Signs are exact, as in `trial_hull`. A journal records the changes, so that the hull can undo
//!    them.
//! 2. *Support* finds the highest vertex along a direction, by climbing from vertex to vertex.
//! 3. *Entering* tests whether a triangle enters the hull deeper than a given depth. The triangle
//!    is repeatedly clipped by one face's plane. The *excess* of a point over a plane is its height
//!    above the plane, divided by the depth of an interior point below the plane. Each clip uses
//!    the plane over which the middle of the remaining polygon has the largest excess. If the
//!    middle lies below all planes, the triangle enters.
//!
//! The search for the plane with the largest excess climbs from face to face. The faces correspond
//! to the vertices of the polar body, on which the excess is a linear function. If faces are
//! coplanar up to rounding, the search visits all of them.

use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{WIDE_CUTS, WIDE_FENCE};
use crate::body::decompose::facet::NONE;
use crate::body::decompose::trial_hull::{TrialFace, spanning_simplex};
use crate::body::{Aabb, decompose::contain};

/// A face with its neighbours. `neighbours[k]` is across the side from corner k to corner k + 1.
#[derive(Clone, Debug)]
struct WideFace {
    face: TrialFace,
    neighbours: [u32; 3],
    /// Depth of the hull's interior point below the plane (m).
    depth: f64,
}

/// One change that an insertion makes, as an entry of the journal. Changes are undone in reverse
/// order.
#[derive(Clone, Copy, Debug)]
enum Change {
    /// This face was removed.
    Buried(u32),
    /// This face was added.
    Born(u32),
    /// The neighbour of a face across a side was replaced. The old neighbour was `before`.
    Neighbour { face: u32, side: usize, before: u32 },
    /// The entry of `face_at` for a point was replaced. The old entry was `before`.
    At { point: u32, before: u32 },
    /// A point was appended.
    Point,
}

/// A hull with adjacency, for large patches.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideHull {
    points: Vec<DVec3>,
    /// The mesh vertex of each point.
    vertices: Vec<u32>,
    faces: Vec<WideFace>,
    /// Indices of removed faces, for reuse.
    free: Vec<u32>,
    /// A face at each point; `NONE` if the point is not a corner of the hull.
    face_at: Vec<u32>,
    journal: Vec<Change>,
    /// A point in the interior of the hull.
    inner: DVec3,
    /// Largest coordinate of the points (m).
    reach: f64,
    /// For each face, the value of `stamp` in the last search that visited it.
    stamps: Vec<u32>,
    stamp: u32,
    queue: Vec<u32>,
    /// Sides of the hole, as tuples of tail, head and the face on the other side.
    horizon: Vec<(u32, u32, u32)>,
    /// For each point of the horizon, the new face whose horizon side starts at the point.
    starts: Vec<u32>,
    cuts: contain::Cuts,
}

impl WideHull {
    /// Builds the hull of `points`; `vertices` are their mesh vertices. Returns false if all points
    /// lie within `thickness` (m) of one plane.
    pub(crate) fn start(&mut self, points: &[DVec3], vertices: &[u32], thickness: f64) -> bool {
        let Some(simplex) = spanning_simplex(points, thickness) else { return false };
        self.points.clear();
        self.vertices.clear();
        self.faces.clear();
        self.free.clear();
        self.face_at.clear();
        self.stamps.clear();
        self.starts.clear();
        self.reach = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        self.inner = simplex.iter().map(|&k| points[k]).sum::<DVec3>() / 4.0;
        for k in simplex {
            self.push_point(points[k], vertices[k]);
        }
        // The neighbours are across the sides (0, 1), (1, 2) and (2, 0) of each face's corners.
        for (corners, neighbours) in
            [([0, 1, 2], [1, 2, 3]), ([0, 3, 1], [3, 2, 0]), ([1, 3, 2], [1, 3, 0]), ([2, 3, 0], [2, 1, 0])]
        {
            self.push_face(corners, neighbours);
        }
        for (k, &p) in points.iter().enumerate() {
            if !simplex.contains(&k) {
                self.insert(p, vertices[k], &[]);
            }
        }
        self.settle();
        true
    }

    /// Adds the point `p`. `beside` are the indices of points near `p`. Returns true if `p` was
    /// outside the hull.
    pub(crate) fn insert(&mut self, p: DVec3, vertex: u32, beside: &[u32]) -> bool {
        self.reach = self.reach.max(p.abs().max_element());
        let Some(first) = self.seen_face(p, beside) else { return false };
        self.bury(p, first);
        let apex = self.push_point(p, vertex);
        self.journal.push(Change::Point);
        self.close(apex);
        true
    }

    /// Makes the current state final.
    pub(crate) fn settle(&mut self) {
        let Self { journal, free, .. } = self;
        free.extend(journal.drain(..).filter_map(|change| match change {
            Change::Buried(face) => Some(face),
            _ => None,
        }));
    }

    /// Returns to the last final state.
    pub(crate) fn undo(&mut self) {
        while let Some(change) = self.journal.pop() {
            match change {
                Change::Buried(face) => self.faces[face as usize].face.alive = true,
                Change::Born(face) => {
                    self.faces[face as usize].face.alive = false;
                    self.free.push(face);
                }
                Change::Neighbour { face, side, before } => self.faces[face as usize].neighbours[side] = before,
                Change::At { point, before } => self.face_at[point as usize] = before,
                Change::Point => {
                    self.points.pop();
                    self.vertices.pop();
                    self.face_at.pop();
                    self.starts.pop();
                }
            }
        }
    }

    /// Returns a box around the volume that the hull gained since the last final state; `None` if
    /// the hull did not grow. The box contains the removed and the added faces.
    pub(crate) fn gained(&self) -> Option<Aabb> {
        let corners = self.journal.iter().filter_map(|change| match change {
            Change::Buried(face) | Change::Born(face) => Some(self.faces[*face as usize].face.corners),
            _ => None,
        });
        let mut corners = corners.flatten().peekable();
        corners.peek()?;
        Some(Aabb::around(corners.map(|k| self.points[k as usize])))
    }

    /// Writes into `into` the mesh vertices of the faces that were removed since the last final
    /// state, sorted and without duplicates.
    pub(crate) fn buried_vertices(&self, into: &mut Vec<u32>) {
        into.clear();
        for change in &self.journal {
            if let Change::Buried(face) = change {
                into.extend(self.faces[*face as usize].face.corners.map(|k| self.vertices[k as usize]));
            }
        }
        into.sort_unstable();
        into.dedup();
    }

    /// Writes into `into` the planes of the largest new faces, without needles. Most triangles
    /// outside the hull lie above one of these few planes.
    pub(crate) fn fence(&mut self, into: &mut Vec<Plane>) {
        let born = self.journal.iter().filter_map(|change| match change {
            Change::Born(face) => Some(*face),
            _ => None,
        });
        self.queue.clear();
        self.queue.extend(born.filter(|&f| self.faces[f as usize].face.alive));
        let Self { faces, points, queue, .. } = self;
        if queue.len() > WIDE_FENCE {
            let area = |f: u32| {
                let [a, b, c] = faces[f as usize].face.corners.map(|k| points[k as usize]);
                (b - a).cross(c - a).length_squared()
            };
            queue.sort_unstable_by(|&f, &g| area(g).total_cmp(&area(f)).then(f.cmp(&g)));
            queue.truncate(WIDE_FENCE);
        }
        into.clear();
        into.extend(queue.iter().map(|&f| faces[f as usize].face).filter(|f| f.slack.is_finite()).map(|f| f.plane));
    }

    /// Returns true if a point of the hull is higher above `plane` than `tolerance` (m). The search
    /// starts at corner `near`.
    pub(crate) fn is_above(&self, plane: Plane, tolerance: f64, near: u32) -> bool {
        let mut here = near;
        let mut height = plane.height(self.points[here as usize]);
        loop {
            if height > tolerance {
                return true;
            }
            let from = here;
            self.around(from, |face| {
                for k in face.face.corners {
                    let h = plane.height(self.points[k as usize]);
                    if h > height {
                        (here, height) = (k, h);
                    }
                }
                true
            });
            if here == from {
                return false;
            }
        }
    }

    /// Returns a corner of the hull: one of `places`, or any corner if none of them is one.
    pub(crate) fn corner_among(&self, places: &[u32]) -> u32 {
        let corner = places.iter().copied().find(|&k| self.face_at[k as usize] != NONE);
        corner.unwrap_or_else(|| self.any_corner())
    }

    /// Returns the mesh vertex of each point.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Returns true if a part of the triangle is deeper than `depth` (m) inside the hull. `fence`
    /// are the planes from [`Self::fence`].
    pub(crate) fn enters(&mut self, triangle: [DVec3; 3], fence: &[Plane], depth: f64) -> bool {
        if fence.iter().any(|plane| triangle.iter().all(|p| plane.height(*p) >= -depth)) {
            return false;
        }
        let mut cuts = std::mem::take(&mut self.cuts);
        cuts.begin(triangle);
        // The volume that the hull gained lies below the new faces.
        if !fence.iter().all(|&plane| cuts.cut(plane, depth)) {
            self.cuts = cuts;
            return false;
        }
        let mut face = self.journal.iter().rev().find_map(|change| match change {
            Change::Born(face) => Some(*face),
            _ => None,
        });
        let mut enters = true;
        for _ in 0..WIDE_CUTS {
            let start = face.unwrap_or_else(|| self.face_at[self.any_corner() as usize]);
            let beyond = self.most_beyond(cuts.middle(), start);
            face = Some(beyond);
            let plane = self.faces[beyond as usize].face.plane;
            if plane.height(cuts.middle()) < -depth {
                break;
            }
            if !cuts.cut(plane, depth) {
                enters = false;
                break;
            }
        }
        self.cuts = cuts;
        enters
    }

    fn any_corner(&self) -> u32 {
        self.face_at.iter().rposition(|&face| face != NONE).unwrap_or(0) as u32
    }

    fn push_point(&mut self, p: DVec3, vertex: u32) -> u32 {
        self.points.push(p);
        self.vertices.push(vertex);
        self.face_at.push(NONE);
        self.starts.push(NONE);
        self.points.len() as u32 - 1
    }

    fn push_face(&mut self, corners: [u32; 3], neighbours: [u32; 3]) -> u32 {
        let face = TrialFace::new(corners, corners.map(|k| self.points[k as usize]), self.reach);
        let depth = -face.plane.height(self.inner);
        let face = WideFace { face, neighbours, depth };
        let place = match self.free.pop() {
            Some(place) => {
                self.faces[place as usize] = face;
                place
            }
            None => {
                self.faces.push(face);
                self.stamps.push(0);
                self.faces.len() as u32 - 1
            }
        };
        for k in corners {
            self.set_face_at(k, place);
        }
        place
    }

    fn set_face_at(&mut self, point: u32, face: u32) {
        let before = std::mem::replace(&mut self.face_at[point as usize], face);
        self.journal.push(Change::At { point, before });
    }

    fn sees(&self, p: DVec3, face: u32) -> bool {
        self.faces[face as usize].face.is_seen_from(p, &self.points)
    }

    /// Visits the faces around a corner until `visit` returns false.
    fn around<'a>(&'a self, point: u32, mut visit: impl FnMut(&'a WideFace) -> bool) {
        let first = self.face_at[point as usize];
        let mut place = first;
        while let Some(face) = self.faces.get(place as usize) {
            // Continue across the side that ends at the point.
            let side = face.face.corners.iter().position(|&k| k == point).map_or(0, |k| (k + 2) % 3);
            place = face.neighbours[side];
            if !visit(face) || place == first {
                return;
            }
        }
    }

    /// Returns a face that `p` sees; `None` if `p` is not outside the hull. `beside` are the
    /// indices of points near `p`.
    fn seen_face(&mut self, p: DVec3, beside: &[u32]) -> Option<u32> {
        for &k in beside {
            let mut place = *self.face_at.get(k as usize)?;
            let first = place;
            while place != NONE {
                if self.sees(p, place) {
                    return Some(place);
                }
                let face = &self.faces[place as usize];
                let side = face.face.corners.iter().position(|&corner| corner == k).map_or(0, |k| (k + 2) % 3);
                place = face.neighbours[side];
                if place == first {
                    break;
                }
            }
        }
        let start = beside.iter().map(|&k| self.face_at[k as usize]).find(|&face| face != NONE);
        let start = start.unwrap_or_else(|| self.face_at[self.any_corner() as usize]);
        let face = self.most_beyond(p, start);
        let near = [face].into_iter().chain(self.faces[face as usize].neighbours);
        near.into_iter().find(|&face| self.sees(p, face))
    }

    /// Returns the face over which `p` has the largest excess (see step 3 of the module's
    /// description).
    fn most_beyond(&mut self, p: DVec3, start: u32) -> u32 {
        self.stamp += 1;
        let Self { faces, stamps, stamp, queue, .. } = self;
        let beyond = |f: u32| faces[f as usize].face.plane.height(p) / faces[f as usize].depth;
        let rounding = |f: u32| faces[f as usize].face.slack / faces[f as usize].depth;
        let is_plain = |f: u32| faces[f as usize].face.slack.is_finite() && faces[f as usize].depth > 0.0;
        let mut best = start;
        let mut most = if is_plain(start) { beyond(start) } else { f64::NEG_INFINITY };
        stamps[start as usize] = *stamp;
        queue.clear();
        queue.push(start);
        while let Some(f) = queue.pop() {
            for g in faces[f as usize].neighbours {
                if std::mem::replace(&mut stamps[g as usize], *stamp) == *stamp {
                    continue;
                }
                if !is_plain(g) {
                    // The plane of a needle consists of rounding errors. Its neighbours may still
                    // be useful.
                    queue.push(g);
                    continue;
                }
                let much = beyond(g);
                let noise = rounding(g) + if is_plain(best) { rounding(best) } else { 0.0 };
                if much > most + noise {
                    queue.clear();
                }
                if much > most {
                    (best, most) = (g, much);
                    queue.push(g);
                } else if much >= most - noise {
                    queue.push(g);
                }
            }
        }
        best
    }

    /// Removes the faces that `p` sees, starting at face `first`, and finds the sides of the hole.
    fn bury(&mut self, p: DVec3, first: u32) {
        self.horizon.clear();
        self.queue.clear();
        self.queue.push(first);
        self.faces[first as usize].face.alive = false;
        let mut done = 0;
        while let Some(&place) = self.queue.get(done) {
            done += 1;
            self.journal.push(Change::Buried(place));
            let WideFace { face, neighbours, .. } = self.faces[place as usize];
            for (k, beyond) in neighbours.into_iter().enumerate() {
                if !self.faces[beyond as usize].face.alive {
                    continue;
                }
                if self.sees(p, beyond) {
                    self.faces[beyond as usize].face.alive = false;
                    self.queue.push(beyond);
                } else {
                    self.horizon.push((face.corners[k], face.corners[(k + 1) % 3], beyond));
                }
            }
        }
        for k in 0..self.queue.len() {
            for corner in self.faces[self.queue[k] as usize].face.corners {
                if self.face_at[corner as usize] != NONE {
                    self.set_face_at(corner, NONE);
                }
            }
        }
    }

    /// Closes the hole with a fan of faces from `apex`.
    fn close(&mut self, apex: u32) {
        let horizon = std::mem::take(&mut self.horizon);
        for &(tail, head, beyond) in &horizon {
            let place = self.push_face([tail, head, apex], [beyond, NONE, NONE]);
            self.journal.push(Change::Born(place));
            self.starts[tail as usize] = place;
            let outer = &mut self.faces[beyond as usize];
            // The neighbouring face lists this side in the opposite direction.
            let corners = outer.face.corners;
            if let Some(side) = (0..3).find(|&k| corners[k] == head && corners[(k + 1) % 3] == tail) {
                let before = std::mem::replace(&mut outer.neighbours[side], place);
                self.journal.push(Change::Neighbour { face: beyond, side, before });
            }
        }
        for &(tail, head, _) in &horizon {
            let (here, after) = (self.starts[tail as usize], self.starts[head as usize]);
            self.faces[here as usize].neighbours[1] = after;
            self.faces[after as usize].neighbours[2] = here;
        }
        self.horizon = horizon;
    }
}
