//! The outlines of the faces or edges of a piece that are flat enough for a patch (step 1 of
//! [`super`]).

use glam::{DVec2, DVec3};

use super::Touch;
use crate::algebra::Placement;
use crate::algebra::tolerance::{PATCH_FACES, PATCH_SIDES};
use crate::body::{Border, FaceRim, Feature, FlatAround, Polytope, Provenance, Valley, is_near};

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
    /// For a face: how the flat face of the mesh continues beyond it.
    rim: FaceRim,
    /// The corners of the face of which one is a corner of the outline, in the face's order.
    stride: usize,
    /// True if the corners are in the reverse order of those of the face.
    turned: bool,
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

/// One of the two pieces of a contact.
pub(super) struct Half<'p> {
    pub(super) polytope: &'p Polytope,
    pub(super) border: &'p Border<'p>,
    /// The contact frame in the coordinates of the piece.
    pub(super) frame: Frame,
    /// 1 if the piece's surface faces along the normal, and −1 if it faces against the normal.
    pub(super) outward: f64,
}

impl Half<'_> {
    /// Returns the unit vector from this piece toward the other piece.
    fn upward(&self) -> DVec3 {
        self.frame.z * self.outward
    }

    /// Returns how much of the neighbourhood of `vertex` belongs to a flat face of the mesh whose
    /// slope is less than `slope`.
    pub(super) fn around(&self, vertex: u32, slope: f64) -> FlatAround {
        self.border.around(vertex, self.upward(), slope)
    }

    /// Returns how much of the neighbourhood of the frame's origin, on `feature`, belongs to a flat
    /// face of the mesh whose slope is less than `slope`.
    pub(super) fn around_origin(&self, feature: Feature, slope: f64, rounding: f64) -> FlatAround {
        let polytope = self.polytope;
        match feature {
            Feature::Vertex(v) => self.around(v, slope),
            Feature::Edge(edge) => self.beside(edge, slope),
            Feature::Face(face) => {
                let (corners, normal) = (polytope.face_vertices(face), polytope.plane(face).normal);
                let is_inside = |k: usize| {
                    let from = polytope.vertex(corners.at(k));
                    let along = polytope.vertex(corners.at((k + 1) % corners.len())) - from;
                    normal.cross(along).dot(self.frame.origin - from) > rounding * along.length()
                };
                if (0..corners.len()).all(is_inside) { FlatAround::All } else { FlatAround::Corner }
            }
        }
    }

    /// As [`Self::around`], for a point on an edge. If the mesh is flat along a part of the edge,
    /// the edge counts as a rim.
    fn beside(&self, edge: u32, slope: f64) -> FlatAround {
        let sides = self.polytope.edge(edge);
        let rim = |face: u32| {
            let is_flat = is_near(self.polytope.plane(face).normal, self.upward(), slope);
            let own = self.border.face(face).filter(|_| is_flat)?;
            let side = self.polytope.face_edges(face).iter().take(FaceRim::MOST).position(|e| e == edge)?;
            Some(self.border.rim_of_side(own.rim, face, side))
        };
        match [sides.left, sides.right].into_iter().find_map(rim) {
            None => FlatAround::Corner,
            Some([begin, end]) if end < begin => FlatAround::All,
            Some(_) => FlatAround::Half,
        }
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
        rim: FaceRim::NONE,
        stride: 1,
        turned: false,
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

    /// Returns how much of the neighbourhood of `place` belongs to a flat face of the mesh. `None`
    /// if the place is not on the outline or within it. Distances up to `rounding` do not count.
    pub(super) fn around(&self, half: &Half<'_>, place: DVec2, slope: f64, rounding: f64) -> Option<FlatAround> {
        let squared = rounding * rounding;
        let mut on_side = None;
        for k in 0..self.side_count() {
            let side = self.side(k);
            let inward = side.inward(place);
            if inward * inward <= squared * side.along.length_squared() {
                on_side = Some(k);
            } else if inward < 0.0 || self.is_segment() {
                return None;
            }
        }
        let Some(side) = on_side else { return Some(FlatAround::All) };
        let is_at = |corner: &DVec2| corner.distance_squared(place) <= squared;
        let corner = self.corners().iter().position(is_at);
        Some(match (self.feature, corner) {
            (Feature::Edge(edge), None) => half.beside(edge, slope),
            (Feature::Edge(edge), Some(k)) => {
                let ends = half.polytope.edge(edge);
                half.around([ends.tail, ends.head][k], slope)
            }
            (_, Some(k)) => {
                let k = if self.turned { self.count - 1 - k } else { k };
                self.rim.around(k * self.stride)
            }
            (_, None) => self.on_side(half.border, side, place, rounding),
        })
    }

    /// As [`Self::around`], for a place on side `k` of a face.
    fn on_side(&self, border: &Border<'_>, k: usize, place: DVec2, rounding: f64) -> FlatAround {
        let Feature::Face(face) = self.feature else { return FlatAround::Corner };
        // A side that leaves corners out may cross the flat face, and counts as a rim.
        if self.stride > 1 || !self.rim.continues() {
            return FlatAround::Half;
        }
        let side = self.side(k);
        let (squared, mut along) = (side.along.length_squared(), side.along.dot(place - side.from));
        let mut own = k;
        if self.turned {
            along = squared - along;
            own = if k + 1 < self.count { self.count - 2 - k } else { self.count - 1 };
        }
        let [begin, end] = border.rim_of_side(self.rim, face, own);
        let slack = rounding * squared.sqrt();
        if along < begin * squared - slack || along > end * squared + slack {
            FlatAround::All
        } else {
            FlatAround::Half
        }
    }

    /// Replaces this outline by that of a face.
    fn set_face(&mut self, half: &Half<'_>, face: u32) {
        let Half { polytope, border, frame, outward } = half;
        (self.feature, self.count, self.valleys) = (Feature::Face(face), 0, 0);
        let corners = polytope.face_vertices(face);
        let stride = corners.len().div_ceil(PATCH_SIDES);
        (self.rim, self.stride, self.turned) = (border.rim(face), stride, *outward < 0.0);
        for k in (0..corners.len()).step_by(stride) {
            let from = corners.at(k);
            let place = frame.point(polytope.vertex(from));
            // A side that leaves corners out is not an edge.
            let is_valley = |valley: &Valley| valley.face == face && valley.ends[0] == from;
            self.valleys |= u32::from(stride == 1 && border.valleys().iter().any(is_valley)) << self.count;
            self.corners[self.count] = place.truncate();
            self.count += 1;
        }
        // The loop of a face that faces against the normal runs clockwise about the normal.
        if self.turned {
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
    fn of_edge(half: &Half<'_>, edge: u32) -> Option<Self> {
        let ends = half.polytope.edge(edge);
        let [tail, head] = [ends.tail, ends.head].map(|v| half.frame.point(half.polytope.vertex(v)));
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

    /// Does step 1 for one piece, for tilts up to `slope`. `feature` is the piece's feature at the
    /// contact.
    pub(super) fn gather(&mut self, half: &Half<'_>, feature: Feature, slope: f64) {
        let (polytope, frame) = (half.polytope, &half.frame);
        (self.count, self.slope) = (0, slope);
        if let Feature::Vertex(v) = feature
            && is_steep(polytope, v, frame, slope)
        {
            return;
        }
        let mut near = NearFaces {
            polytope,
            border: half.border,
            up: half.upward(),
            slope,
            faces: [(0, 0.0); 2 * PATCH_FACES],
            count: 0,
        };
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
            self.list[self.count].set_face(half, face);
            self.count += 1;
        }
        if self.count == 0 {
            self.gather_edges(half, feature);
        }
    }

    /// Does step 1 for edges, if no face is flat enough.
    fn gather_edges(&mut self, half: &Half<'_>, feature: Feature) {
        match feature {
            Feature::Face(_) => {}
            Feature::Edge(edge) => self.push_edge(half, edge),
            Feature::Vertex(v) => half.polytope.ring(v).iter().for_each(|spoke| self.push_edge(half, spoke.edge)),
        }
    }

    fn push_edge(&mut self, half: &Half<'_>, edge: u32) {
        let (polytope, ends) = (half.polytope, half.polytope.edge(edge));
        let along = polytope.vertex(ends.head) - polytope.vertex(ends.tail);
        if !is_flat(along, &half.frame, self.slope) || polytope.edge_provenance(edge) != Provenance::Original {
            return;
        }
        let Some(outline) = Outline::of_edge(half, edge) else { return };
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
    border: &'p Border<'p>,
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
            && (self.polytope.face_provenance(face) == Provenance::Original
                || self.border.face(face).is_some_and(|own| own.covered))
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
