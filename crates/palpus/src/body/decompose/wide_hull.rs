//! The hull of a large patch. Unlike `trial_hull` it stores neighbours, so that no step visits the
//! whole hull.
//!
//! A patch of fifty thousand facets has tested fifty thousand times whether one more may join. Each
//! of these tests is local:
//!
//! 1. *Insertion* starts at a face that the new point sees, found from a vertex near the point. It
//!    removes all faces that the point sees and closes the hole with a fan. Signs are exact, as in
//!    `trial_hull`. A journal makes insertions undoable.
//! 2. *Support*: the highest vertex along a direction, by climbing from vertex to vertex.
//! 3. *Entering*: does a triangle enter the hull deeper than a given depth? The triangle is clipped
//!    by one plane at a time: the plane that its middle is most beyond, seen from an interior
//!    point. If its middle is beyond no plane, it is inside. The face is found by climbing from
//!    face to face: the faces are the vertices of the polar body, where "most beyond" is a linear
//!    function. Where faces lie in one plane up to rounding, the climb looks at all of them.

use glam::DVec3;

use crate::algebra::Plane;
use crate::algebra::tolerance::{WIDE_CUTS, WIDE_FENCE};
use crate::body::decompose::facet::NONE;
use crate::body::decompose::trial_hull::{TrialFace, spanning_simplex};
use crate::body::{Aabb, decompose::contain};

/// A face with its neighbours; `neighbours[k]` is across the side from corner k to corner k + 1.
#[derive(Clone, Debug)]
struct WideFace {
    face: TrialFace,
    neighbours: [u32; 3],
    /// How far the inner point lies below the plane, metres.
    depth: f64,
}

/// Changes of an insertion, to be undone from the last to the first.
#[derive(Clone, Copy, Debug)]
enum Change {
    Buried(u32),
    Born(u32),
    Neighbour { face: u32, side: usize, before: u32 },
    At { point: u32, before: u32 },
    Point,
}

/// The hull; see the module's description.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideHull {
    points: Vec<DVec3>,
    /// The mesh vertex of each point.
    vertices: Vec<u32>,
    faces: Vec<WideFace>,
    free: Vec<u32>,
    /// A face at each point; `NONE` for a point that is not a corner of the hull.
    face_at: Vec<u32>,
    journal: Vec<Change>,
    inner: DVec3,
    /// Largest coordinate among the points.
    reach: f64,
    /// For each face, the number of the last search that visited it.
    stamps: Vec<u32>,
    stamp: u32,
    queue: Vec<u32>,
    /// Sides of the hole: tail, head, the face beyond.
    horizon: Vec<(u32, u32, u32)>,
    /// For each point, the new face that begins there.
    starts: Vec<u32>,
    cuts: contain::Cuts,
}

impl WideHull {
    /// Hull of points with their mesh vertices; false when they all lie within `thickness` of one
    /// plane.
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
        // Sides in the order (0, 1), (1, 2), (2, 0) of each face's corners.
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

    /// Adds a point; `beside` are places of points near it. Returns true when it lay outside.
    pub(crate) fn insert(&mut self, p: DVec3, vertex: u32, beside: &[u32]) -> bool {
        self.reach = self.reach.max(p.abs().max_element());
        let Some(first) = self.seen_face(p, beside) else { return false };
        self.bury(p, first);
        let apex = self.push_point(p, vertex);
        self.journal.push(Change::Point);
        self.close(apex);
        true
    }

    /// Makes the present state final.
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

    /// Bounds of the hull's growth since it was final: the removed faces and the new points; `None`
    /// without growth.
    pub(crate) fn gained(&self) -> Option<Aabb> {
        let corners = self.journal.iter().filter_map(|change| match change {
            Change::Buried(face) | Change::Born(face) => Some(self.faces[*face as usize].face.corners),
            _ => None,
        });
        let mut corners = corners.flatten().peekable();
        corners.peek()?;
        Some(Aabb::around(corners.map(|k| self.points[k as usize])))
    }

    /// The mesh vertices of the faces that were removed since the last final state, with
    /// repetitions.
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

    /// The planes of the largest new faces, without needles. Most triangles outside the hull lie
    /// above one of these few planes.
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

    /// True if a point of the hull is higher above `plane` than `tolerance`. The search begins at
    /// corner `near`.
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

    /// A corner of the hull among these places if there is one, else any corner.
    pub(crate) fn corner_among(&self, places: &[u32]) -> u32 {
        let corner = places.iter().copied().find(|&k| self.face_at[k as usize] != NONE);
        corner.unwrap_or_else(|| self.any_corner())
    }

    /// The mesh vertex of each point.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// True when the triangle comes deeper than `depth` into the hull.
    pub(crate) fn enters(&mut self, triangle: [DVec3; 3], fence: &[Plane], depth: f64) -> bool {
        if fence.iter().any(|plane| triangle.iter().all(|p| plane.height(*p) >= -depth)) {
            return false;
        }
        let mut cuts = std::mem::take(&mut self.cuts);
        cuts.begin(triangle);
        // Whatever the hull has gained lies below the new faces.
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
        let face = &self.faces[face as usize].face;
        face.is_seen_from(p, face.corners.map(|k| self.points[k as usize]))
    }

    /// Visits the faces around a corner until `visit` is false.
    fn around<'a>(&'a self, point: u32, mut visit: impl FnMut(&'a WideFace) -> bool) {
        let first = self.face_at[point as usize];
        let mut place = first;
        while let Some(face) = self.faces.get(place as usize) {
            // Across the side that ends at the point.
            let side = face.face.corners.iter().position(|&k| k == point).map_or(0, |k| (k + 2) % 3);
            place = face.neighbours[side];
            if !visit(face) || place == first {
                return;
            }
        }
    }

    /// A face that `p` sees, if there is one.
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

    /// The face that `p` is most beyond: its height above the plane, relative to the depth of the
    /// inner point below that plane, is largest.
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
                    // A needle's plane is noise, but the faces behind it may be usable.
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

    /// Removes the faces that `p` sees, and finds the sides of the hole.
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

    /// Closes the hole by a fan about `apex`.
    fn close(&mut self, apex: u32) {
        let horizon = std::mem::take(&mut self.horizon);
        for &(tail, head, beyond) in &horizon {
            let place = self.push_face([tail, head, apex], [beyond, NONE, NONE]);
            self.journal.push(Change::Born(place));
            self.starts[tail as usize] = place;
            let outer = &mut self.faces[beyond as usize];
            // The face beyond runs along the side the other way.
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
