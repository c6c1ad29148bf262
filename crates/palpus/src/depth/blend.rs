//! Where flat and nearly flat contact is, as a point that moves continuously \[K02 §3.3.3 leaves it open\].
//!
//! When an edge lies on a face or a face on a face, many points are equally close, and the exact witness of a box that tilts
//! through flat jumps from corner to corner. A force at a jumping point is a jumping torque, so the renderer asks for the
//! *blended* witness instead: the mean of the middle between the closest points over all small *pulls* of that middle
//! ([`PulledGap`]). A pull makes the bodies choose closest points that are farther along it, at a price of twice the pull in
//! distance per length; so features that open by more than the angle withstand it, and have their exact witness. Flush features
//! are pulled to their ends all around, and the mean is the middle of their overlap (its Steiner point: the middle of a stretch or
//! of a rectangle, the mean of a polygon's corners weighted by how far each turns). In between, the pulls are shared.
//!
//! The mean needs no pull's closest points. The middle is the derivative of the pulled gap by the pull, so that the mean over a line
//! of pulls is a difference of two gaps. The lines are the six axes of an icosahedron in b's frame: Σ w wᵀ is isotropic, so
//! that a middle that all pulls share comes out unchanged. No normal enters, and so it does not matter how fast that turns.
//!
//! Bodies that overlap are first moved apart by the depth along its normal, where they touch as the witness has it.
//!
//! **Continuity.** Let p = tan(angle / 2). Of bodies that are apart, no motion that moves no point of a by more than δ moves the blend by
//! more than `(1 + √5)/4 · (1 + p)/p · δ`, which for 5° is 19.4 δ, whatever the shapes, their size, their distance, and however
//! the normal turns. *Proof.* A gap is the least of |a − b| − q·(a + b), |q| = p, over points of the two, and a moves by at most
//! δ: so no gap changes by more than (1 + p) δ. The blend is −Σ w (gap(p w) − gap(−p w)) / 8p over the six axes w. Its change along a unit u
//! then is at most 2 (1 + p) δ Σ |w·u| / 8p, and Σ |w·u| is at most 1 + √5. ∎ Of bodies that overlap, the same holds for the pair moved apart,
//! so to δ is added the change of the vector `depth · normal`, and half of that to the witness, which lies midway in the
//! depth. Through zero separation that vector is continuous. Where a depth is attained in two directions at once, the normal must jump
//! (as on the way over a table's edge, when sideways becomes the shorter way out), and the blend then jumps by some depths: by the
//! above 28 at the most where the normal turns over by a right angle, as measured 7.8. It does not jump by the length of the features, as the
//! exact witness does.
//!
//! Measured over δ (exact witnesses jump by up to 5e6 δ): a box tilting on a table by −2° to 2° in steps of 1e-4°, from 1 mm apart to 1 mm
//! deep, 7.3, about its middle through zero separation 13.0; sliding over the table's edge and on at twists of 0 to 30°, 7.8 at
//! any separation, and 8.7 from touching to apart where the normal turns at once; edges rolling over
//! a face 7.5; random prisms 11.7.
//!
//! **What it is not.** Not the area centroid, and no bound of this kind can have that: the centroid of a triangle of length L and no width is
//! at L/3 and that of a segment at L/2, though they differ by no motion to speak of. (A box that leaves a table's edge at a twist of 1e-3° shows
//! it: there the exact witness, which is the centroid, moves 57 000 δ.) No choice of a
//! point of a convex set has a smaller bound than Steiner's (Przesławski, Yost 1989). Of flush
//! irregular polygons the middle may lie up to 0.32 of their radius from the centroid, and, twelve pulls being few, it depends by up
//! to 0.14 of the radius on how b's frame is turned. Stretches and polygons with a centre of symmetry have exactly that centre in every
//! frame.
//!
//! The normal and the separation remain those of the exact answer, and `point_a − point_b = separation · normal` still holds.
//! The points may lie off their bodies by the height that the angle gives to a part of the feature in contact.
//!
//! 1. A vertex over a face, an edge or a vertex, or crossing edges, where all pulls are withstood for certain: the exact witness.
//! 2. The gaps at both ends of each of the six axes, each from the last one's basis.
//! 3. The mean from the six differences, and from the six sums how far the common part reaches.

use glam::DVec3;

use super::HubPair;
use super::cso::Cso;
use super::pulled_gap::PulledGap;
use crate::algebra::Placement;
use crate::algebra::tolerance::{BLEND_LEANING, BLEND_PARTED, BLEND_ROUNDING};
use crate::body::{Edge, Feature, FeaturePair, Polytope};

/// A contact whose witness is to be blended; in b's frame.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// On which the exact witness points lie.
    pub features: FeaturePair,
    /// Exact.
    pub point_a: DVec3,
    /// Exact.
    pub point_b: DVec3,
    /// Unit, from b into a.
    pub normal: DVec3,
}

/// The answer of [`blend`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    /// How far the middle of the contact moves from the exact one.
    pub shift: DVec3,
    /// How far the common part of the features reaches: the root of the sum of the squares of its two widths. The length of a
    /// stretch, the diagonal of the box about an ellipse; of a square, by how b's frame is turned, 1.21 to 1.31 times its
    /// diagonal. It is as continuous as the middle.
    pub extent: f64,
    /// Vertex pairs asked for; 0 where the contact was steep.
    pub rounds: u32,
    /// False if a gap ran out of rounds, and the exact points stay.
    pub converged: bool,
}

/// Blends the witness of `touch` over all pulls that features opening by `angle` (rad, less than a right angle) just withstand.
pub fn blend(a: &Polytope, b: &Polytope, pose_ba: &Placement, touch: &Touch, angle: f64) -> Blend {
    let cso = Cso { a, b, pose_ba };
    let pull = (0.5 * angle).tan();
    let apart = touch.normal.dot(touch.point_a - touch.point_b);
    let moved = touch.normal * (BLEND_PARTED * cso.size() - apart).max(0.0);
    let origin = (touch.point_a + moved + touch.point_b) * 0.5;
    let rounding = BLEND_ROUNDING * (cso.size() + origin.length() + pose_ba.translation.length());
    let steep = Steep { cso: &cso, touch, pull, apart: apart.max(BLEND_PARTED * cso.size()), rounding };
    if steep.is_steep() {
        return Blend { shift: DVec3::ZERO, extent: 0.0, rounds: 0, converged: true };
    }
    let mut gap = PulledGap::new(&cso, moved, origin, touch.normal, first_hub(&cso, touch), rounding);
    let reach = pulled_reach(&mut gap, pull, steep.apart).filter(|(shift, extent)| (*shift + *extent).is_finite());
    let (shift, extent) = reach.unwrap_or_default();
    Blend { shift, extent, rounds: gap.rounds, converged: reach.is_some() }
}

/// The six axes of the icosahedron, unit, in an order in which neighbours are near.
const AXES: [DVec3; 6] = {
    // 1/√(1 + g²) and g/√(1 + g²), g being the golden ratio.
    const S: f64 = 0.525_731_112_119_133_6;
    const L: f64 = 0.850_650_808_352_039_9;
    [
        DVec3::new(0.0, S, L),
        DVec3::new(L, 0.0, S),
        DVec3::new(S, L, 0.0),
        DVec3::new(-S, L, 0.0),
        DVec3::new(-L, 0.0, S),
        DVec3::new(0.0, -S, L),
    ]
};

/// The mean of the middle over the pulls, from the origin, and how far the pulls spread it; `apart` is the gap without a pull.
fn pulled_reach(gap: &mut PulledGap<'_, '_>, pull: f64, apart: f64) -> Option<(DVec3, f64)> {
    let mut sum = DVec3::ZERO;
    let mut widths = [0.0; 6];
    for sign in [1.0, -1.0] {
        for (axis, width) in AXES.iter().zip(&mut widths) {
            let gap = gap.at(*axis * (sign * pull))?;
            sum -= *axis * (sign * gap);
            *width += (apart - gap) / (2.0 * pull);
        }
    }
    // The gap falls by twice the middle's way along the pull, Σ w wᵀ over six axes is twice the identity, and the ends of an axis
    // are two pulls apart. An ellipse's squared width along w is quadratic in w, and so half their sum is its form's trace.
    // Edges that cross beside each other widen by leaning alone, steep ones by no more than this (see `edge_on_edge`), and count as points.
    let leaning = apart * (1.0 - (1.0 - BLEND_LEANING * BLEND_LEANING).sqrt()) / pull;
    let squares: f64 = widths.iter().map(|width| (width - leaning).max(0.0).powi(2)).sum();
    Some((sum / (8.0 * pull), (0.5 * squares).sqrt()))
}

/// Is the blend the exact witness for certain?
struct Steep<'c, 'p> {
    cso: &'c Cso<'p>,
    touch: &'c Touch,
    pull: f64,
    /// After a was moved: greater than zero.
    apart: f64,
    rounding: f64,
}

impl Steep<'_, '_> {
    fn is_steep(&self) -> bool {
        let Touch { features, point_a, point_b, normal } = *self.touch;
        let (a, b) = (self.cso.a, self.cso.b);
        let to_a = |p: DVec3| self.cso.pose_ba.inverse_point(p);
        match (features.a, features.b) {
            (Feature::Vertex(v), Feature::Face(f)) => {
                self.vertex_on_face((a, v, to_a(point_a), self.cso.toward_b(normal)), (b, f, point_b))
            }
            (Feature::Face(f), Feature::Vertex(v)) => {
                self.vertex_on_face((b, v, point_b, normal), (a, f, to_a(point_a)))
            }
            (Feature::Vertex(v), Feature::Edge(e)) => {
                self.vertex_on_edge((a, v, to_a(point_a), self.cso.toward_b(normal)), (b, e, point_b, normal))
            }
            (Feature::Edge(e), Feature::Vertex(v)) => {
                self.vertex_on_edge((b, v, point_b, normal), (a, e, to_a(point_a), self.cso.toward_b(normal)))
            }
            (Feature::Edge(e), Feature::Edge(f)) => self.edge_on_edge(e, f),
            (Feature::Vertex(v), Feature::Vertex(w)) => {
                // w is the line between the vertices, whatever the pull.
                let slope = self.pull / (1.0 - self.pull * self.pull).sqrt();
                self.is_parted() && rises(a, v, self.cso.toward_b(normal), slope) && rises(b, w, normal, slope)
            }
            (Feature::Face(_), _) | (_, Feature::Face(_)) => false,
        }
    }

    /// True if the bodies are farther apart than they would be moved, so that a was not moved.
    fn is_parted(&self) -> bool {
        self.apart > BLEND_PARTED * self.cso.size()
    }

    /// A vertex over the inside of a face stays where it is if all its edges rise steeply enough: a pull q leans w by its part q' in
    /// the plane, and the body of the vertex feels it twice.
    fn vertex_on_face(&self, tip: (&Polytope, u32, DVec3, DVec3), face: (&Polytope, u32, DVec3)) -> bool {
        let (polytope, v, point, outward) = tip;
        let (ground, f, foot) = face;
        polytope.vertex(v).distance_squared(point) <= self.rounding * self.rounding
            && rises(polytope, v, outward, 2.0 * self.pull / (self.upright() - self.pull))
            && is_within(ground, f, foot, self.apart * self.pull / self.upright())
    }

    /// A vertex over the inside of an edge likewise, if also the edge is sharp enough.
    fn vertex_on_edge(&self, tip: (&Polytope, u32, DVec3, DVec3), edge: (&Polytope, u32, DVec3, DVec3)) -> bool {
        let (polytope, v, _, outward) = tip;
        let (ground, e, foot, ground_outward) = edge;
        let edge = ground.edge(e);
        let tail = ground.vertex(edge.tail);
        let along = ground.vertex(edge.head) - tail;
        let (length, share) = (along.length(), (foot - tail).dot(along) / along.length());
        let margin = self.apart * self.pull / self.upright();
        let slope = self.pull / (self.upright() - self.pull);
        self.is_parted()
            && rises(polytope, v, outward, 2.0 * slope)
            && is_sharp(ground, &edge, ground_outward, slope)
            && share > margin
            && share < length - margin
    }

    /// The least height of a unit w that leans by the pull.
    fn upright(&self) -> f64 {
        (1.0 - self.pull * self.pull).sqrt()
    }

    /// Crossing edges stay where they are if along each of them the faces of the other rise steeply enough.
    ///
    /// The pulled w keeps w·a = q·a and w·b = −q·b along the edges' directions, so that its part across the normal is at most two pulls
    /// over the sine between them; a's faces then feel a rise of 2 q·b over that sine along their side of the edge, and b's likewise.
    fn edge_on_edge(&self, e: u32, f: u32) -> bool {
        let Touch { point_a, point_b, normal, .. } = *self.touch;
        let (a, b) = (self.cso.a, self.cso.b);
        let (e, f) = (a.edge(e), b.edge(f));
        let along = |polytope: &Polytope, edge: &Edge| polytope.vertex(edge.head) - polytope.vertex(edge.tail);
        let (along_a, along_b) = (self.cso.pose_ba.vector(along(a, &e)), along(b, &f));
        let (length_a, length_b) = (along_a.length(), along_b.length());
        let crossing = along_a.cross(along_b).length() / (length_a * length_b);
        let leaning = 2.0 * self.pull / crossing;
        if leaning >= BLEND_LEANING {
            return false;
        }
        let upright = (1.0 - leaning * leaning).sqrt();
        let slope = leaning / (upright - self.pull);
        let margin = self.apart * leaning / (upright * crossing);
        let inside = |p: DVec3, tail: DVec3, along: DVec3, length: f64| {
            let share = (p - tail).dot(along) / length;
            share > margin && share < length - margin
        };
        inside(point_a, self.cso.point_a(e.tail), along_a, length_a)
            && inside(point_b, b.vertex(f.tail), along_b, length_b)
            && is_sharp(a, &e, self.cso.toward_b(normal), slope)
            && is_sharp(b, &f, normal, slope)
    }
}

/// True if no edge of vertex `v` leaves the plane across `outward` (unit, local) by less than `slope`.
fn rises(polytope: &Polytope, v: u32, outward: DVec3, slope: f64) -> bool {
    let from = polytope.vertex(v);
    // rise ≥ slope · run, with run² = length² − rise².
    let least = slope * slope / (1.0 + slope * slope);
    polytope.ring(v).iter().all(|spoke| {
        let edge = polytope.vertex(spoke.neighbour) - from;
        let rise = -outward.dot(edge);
        rise >= 0.0 && rise * rise >= least * edge.length_squared()
    })
}

/// True if both faces of an edge fall off from the plane across `outward` (unit, local) by at least `slope`.
fn is_sharp(polytope: &Polytope, edge: &Edge, outward: DVec3, slope: f64) -> bool {
    let most = 1.0 / (1.0 + slope * slope).sqrt();
    [edge.left, edge.right].into_iter().all(|face| polytope.plane(face).normal.dot(outward) <= most)
}

/// True if `point` (local) lies inside of every side of face `f` by at least `margin`.
fn is_within(polytope: &Polytope, f: u32, point: DVec3, margin: f64) -> bool {
    let normal = polytope.plane(f).normal;
    let corners = polytope.face_vertices(f);
    let mut from = polytope.vertex(corners.last());
    corners.iter().all(|v| {
        let to = polytope.vertex(v);
        let inward = normal.cross(to - from);
        let height = inward.dot(point - from);
        from = to;
        height > 0.0 && height * height >= margin * margin * inward.length_squared()
    })
}

fn first_hub(cso: &Cso<'_>, touch: &Touch) -> HubPair {
    HubPair { a: touch.features.a.some_vertex(cso.a), b: touch.features.b.some_vertex(cso.b) }
}
