//! The outlines of the faces or edges of a piece that are flat enough for a patch (step 1 of
//! [`super`]).

use glam::{DVec2, DVec3};

use super::Touch;
use crate::algebra::Placement;
use crate::algebra::tolerance::{PATCH_FACES, PATCH_SIDES};
use crate::body::{Feature, Polytope, Provenance, Valley};

/// The outlines of the faces of one piece that nearly lie in the contact plane. If no face is flat
/// enough, the list has outlines of edges.
#[derive(Clone, Debug)]
pub(super) struct Outlines {
    list: [Outline; PATCH_FACES],
    pub(super) count: usize,
    /// All faces and edges flatter than this are in the list (tangent of the angle to the contact
    /// plane).
    pub(super) slope: f64,
}

/// A polygon (counter-clockwise about the normal) or a segment, in the contact frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    corners: [DVec2; PATCH_SIDES],
    pub(super) count: usize,
    /// The height above the contact plane at the origin, and its gradient.
    height: f64,
    rise: DVec2,
    pub(super) feature: Feature,
    /// Bit k is set if side k is a valley.
    valleys: u32,
}

/// A side of an outline.
#[derive(Clone, Copy)]
pub(super) struct Side {
    from: DVec2,
    pub(super) along: DVec2,
}

impl Side {
    pub(super) fn ends(&self) -> [DVec2; 2] {
        [self.from, self.from + self.along]
    }

    /// Returns the signed distance of `p` from this side's line, times the side's length. The
    /// result is positive on the inner side.
    pub(super) fn inward(&self, p: DVec2) -> f64 {
        self.along.perp_dot(p - self.from)
    }

    /// Returns the point of the side's line that is nearest to `p`. `None` if this point is not
    /// between the side's ends.
    pub(super) fn foot(&self, p: DVec2) -> Option<DVec2> {
        let share = self.along.dot(p - self.from) / self.along.length_squared();
        (0.0..=1.0).contains(&share).then(|| self.from + self.along * share)
    }
}

/// The axes and the origin of the contact plane, in the frame of one of the bodies.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub(super) origin: DVec3,
    pub(super) x: DVec3,
    pub(super) y: DVec3,
    pub(super) z: DVec3,
}

impl Frame {
    pub(super) fn about(touch: &Touch) -> Self {
        let (x, y) = touch.normal.any_orthonormal_pair();
        Self { origin: touch.point_a.midpoint(touch.point_b), x, y, z: touch.normal }
    }

    /// Returns this frame in the coordinates of a body whose pose is `place`.
    pub(super) fn seen_from(&self, place: &Placement) -> Self {
        let axis = |axis| place.inverse_vector(axis);
        Self { origin: place.inverse_point(self.origin), x: axis(self.x), y: axis(self.y), z: axis(self.z) }
    }

    fn point(&self, p: DVec3) -> DVec3 {
        self.vector(p - self.origin)
    }

    fn vector(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }
}

impl Outline {
    const NONE: Self = Self {
        corners: [DVec2::ZERO; PATCH_SIDES],
        count: 0,
        height: 0.0,
        rise: DVec2::ZERO,
        feature: Feature::Vertex(0),
        valleys: 0,
    };

    pub(super) fn corners(&self) -> &[DVec2] {
        &self.corners[..self.count]
    }

    pub(super) fn is_segment(&self) -> bool {
        self.count == 2
    }

    pub(super) fn height(&self, place: DVec2) -> f64 {
        self.height + self.rise.dot(place)
    }

    pub(super) fn side_count(&self) -> usize {
        if self.is_segment() { 1 } else { self.count }
    }

    pub(super) fn side(&self, k: usize) -> Side {
        let from = self.corners[k];
        let next = if k + 1 == self.count { 0 } else { k + 1 };
        Side { from, along: self.corners[next] - from }
    }

    /// Returns true if side `k` is a valley.
    pub(super) fn is_valley(&self, k: usize) -> bool {
        self.valleys & (1 << k) != 0
    }

    /// Replaces this outline by that of a face. `turned` is true for a face whose loop runs
    /// clockwise about the normal.
    fn set_face(&mut self, polytope: &Polytope, valleys: &[Valley], face: u32, frame: &Frame, turned: bool) {
        (self.feature, self.count, self.valleys) = (Feature::Face(face), 0, 0);
        let corners = polytope.face_vertices(face);
        let stride = corners.len().div_ceil(PATCH_SIDES);
        for k in (0..corners.len()).step_by(stride) {
            let from = corners.at(k);
            let place = frame.point(polytope.vertex(from));
            // A side that leaves corners out is not an edge.
            let is_valley = |valley: &Valley| valley.face == face && valley.ends[0] == from;
            self.valleys |= u32::from(stride == 1 && valleys.iter().any(is_valley)) << self.count;
            self.corners[self.count] = place.truncate();
            self.count += 1;
        }
        if turned {
            self.corners[..self.count].reverse();
            // Side k led to corner k + 1, and now begins there.
            if self.valleys != 0 {
                let count = self.count as u32;
                let reversed = self.valleys.reverse_bits() >> (u32::BITS - count);
                self.valleys = reversed >> 1 | (reversed & 1) << (count - 1);
            }
        }
        let plane = polytope.plane(face);
        let normal = frame.vector(plane.normal);
        self.rise = -normal.truncate() / normal.z;
        self.height = -plane.height(frame.origin) / normal.z;
    }

    /// Returns the outline of an edge. `None` if the edge is perpendicular to the contact plane.
    fn of_edge(polytope: &Polytope, edge: u32, frame: &Frame) -> Option<Self> {
        let ends = polytope.edge(edge);
        let [tail, head] = [ends.tail, ends.head].map(|v| frame.point(polytope.vertex(v)));
        let along = (head - tail).truncate();
        let mut outline = Self { feature: Feature::Edge(edge), count: 2, ..Self::NONE };
        (outline.corners[0], outline.corners[1]) = (tail.truncate(), head.truncate());
        outline.rise = along * ((head.z - tail.z) / along.length_squared());
        outline.height = tail.z - outline.rise.dot(tail.truncate());
        outline.rise.is_finite().then_some(outline)
    }
}

impl Outlines {
    pub(super) const NONE: Self = Self { list: [Outline::NONE; PATCH_FACES], count: 0, slope: 0.0 };

    pub(super) fn list(&self) -> &[Outline] {
        &self.list[..self.count]
    }

    /// Does step 1 for one piece. `outward` is 1 if the piece's surface faces along the normal, and
    /// −1 if the surface faces against the normal.
    pub(super) fn gather(
        &mut self,
        polytope: &Polytope,
        valleys: &[Valley],
        feature: Feature,
        frame: &Frame,
        outward: f64,
        slope: f64,
    ) {
        (self.count, self.slope) = (0, slope);
        if let Feature::Vertex(v) = feature
            && is_steep(polytope, v, frame, slope)
        {
            return;
        }
        let mut near =
            NearFaces { polytope, up: frame.z * outward, slope, faces: [(0, 0.0); 2 * PATCH_FACES], count: 0 };
        match feature {
            Feature::Face(face) => near.visit(face),
            Feature::Edge(edge) => {
                let edge = polytope.edge(edge);
                near.visit(edge.left);
                near.visit(edge.right);
            }
            Feature::Vertex(v) => polytope.ring(v).iter().for_each(|spoke| near.visit(spoke.left)),
        }
        near.spread();
        let faces = &mut near.faces[..near.count];
        faces.sort_unstable_by(|x, y| x.1.total_cmp(&y.1).then(x.0.cmp(&y.0)));
        if let Some(&(_, left_out)) = faces.get(PATCH_FACES) {
            self.slope = left_out.sqrt();
        }
        for &(face, _) in faces.iter().take(PATCH_FACES) {
            self.list[self.count].set_face(polytope, valleys, face, frame, outward < 0.0);
            self.count += 1;
        }
        if self.count == 0 {
            self.gather_edges(polytope, feature, frame);
        }
    }

    /// Does step 1 for edges, if no face is flat enough.
    fn gather_edges(&mut self, polytope: &Polytope, feature: Feature, frame: &Frame) {
        match feature {
            Feature::Face(_) => {}
            Feature::Edge(edge) => self.push_edge(polytope, edge, frame),
            Feature::Vertex(v) => polytope.ring(v).iter().for_each(|spoke| self.push_edge(polytope, spoke.edge, frame)),
        }
    }

    fn push_edge(&mut self, polytope: &Polytope, edge: u32, frame: &Frame) {
        let ends = polytope.edge(edge);
        let along = polytope.vertex(ends.head) - polytope.vertex(ends.tail);
        if !is_flat(along, frame, self.slope) || polytope.edge_provenance(edge) != Provenance::Original {
            return;
        }
        let Some(outline) = Outline::of_edge(polytope, edge, frame) else { return };
        if self.count < PATCH_FACES {
            self.list[self.count] = outline;
            self.count += 1;
        } else {
            self.slope = outline.rise.length();
        }
    }
}

/// Returns true if the slope of `along` relative to the contact plane is less than `slope`.
fn is_flat(along: DVec3, frame: &Frame, slope: f64) -> bool {
    let rise = frame.z.dot(along);
    rise * rise < slope * slope * (along.length_squared() - rise * rise)
}

/// Returns true if no edge at vertex `v` is flat. Then no face at the vertex is flat either. Most
/// contacts at a single point have only steep edges and need no further work.
fn is_steep(polytope: &Polytope, v: u32, frame: &Frame, slope: f64) -> bool {
    let from = polytope.vertex(v);
    polytope.ring(v).iter().all(|spoke| !is_flat(polytope.vertex(spoke.neighbour) - from, frame, slope))
}

/// The search for faces that are flat enough.
struct NearFaces<'p> {
    polytope: &'p Polytope,
    /// Unit vector in the piece's frame: out of the piece, toward the other piece.
    up: DVec3,
    slope: f64,
    /// Each face with the square of its slope.
    faces: [(u32, f64); 2 * PATCH_FACES],
    count: usize,
}

impl NearFaces<'_> {
    fn visit(&mut self, face: u32) {
        let normal = self.polytope.plane(face).normal;
        let upright = normal.dot(self.up);
        // Most faces are steep and need no further work.
        if upright <= 0.0 || upright * upright * (1.0 + self.slope * self.slope) <= 1.0 {
            return;
        }
        let slope = (normal - self.up * upright).length_squared() / (upright * upright);
        let is_known = || self.faces[..self.count].iter().any(|known| known.0 == face);
        if slope < self.slope * self.slope
            && self.count < self.faces.len()
            && !is_known()
            && self.polytope.face_provenance(face) == Provenance::Original
        {
            self.faces[self.count] = (face, slope);
            self.count += 1;
        }
    }

    /// Visits the neighbours of all faces that were found.
    fn spread(&mut self) {
        let mut next = 0;
        while next < self.count {
            let face = self.faces[next].0;
            for edge in self.polytope.face_edges(face).iter() {
                let sides = self.polytope.edge(edge);
                self.visit(if sides.left == face { sides.right } else { sides.left });
            }
            next += 1;
        }
    }
}
