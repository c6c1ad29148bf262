//! Force shading \[K02 §4.4.1; Morgenbesser and Srinivasan 1996\]: the force of a contact points
//! along smoothed normals.
//!
//! A mesh approximates a smooth surface, but its normal jumps at every edge, and a hand feels the
//! edges. As in Gouraud shading, the direction of a contact's force follows normals that are
//! interpolated between the corners of triangles, here the triangles at the contact's two points.
//! The contact keeps its depth, so the force keeps its magnitude.
//!
//! 1. On each body, find the smooth outward normal and the curvature at the witness point. A body
//!    whose feature is a crease has no smooth normal. It uses the other body's normal, limited to
//!    the directions between its surface faces ([`super::SmoothBody::confine`]).
//! 2. *Combine* b's normal with the reversed normal of a. For spheres with the radii r_a and r_b,
//!    the vector between the centres is along r_b n_b − r_a n_a. So the weight of each side is its
//!    radius, 1 / curvature. A flat side determines the direction alone, and two equally curved
//!    sides have equal weights.
//!    Each side turns the true normal by at most the sum of both sides' *spreads*. The spread is
//!    the largest angle between the smooth normal and the triangles around it. The true normal of
//!    two closest features is within the spread of both sides. At a corner of a patch, two faces
//!    are only nearly parallel, and the true normal may be outside. A flat side has no spread,
//!    because flat faces approximate no other surface. So two flat sides leave the true normal as
//!    it is.
//! 3. *Reduce* the weight of a side by its angle from the true normal: the factor is 1 within
//!    half of `most_turn`, and falls to 0 at `most_turn`. The rest of the weight goes to the true
//!    normal. So the result is within `most_turn` of the true normal. (A deep contact may lie on a
//!    rim of a piece, where the surface has a very different direction.)
//!
//! **Continuity.** Within half of `most_turn`, the combination, before it is normalised, changes by
//! at most
//!
//! |dn| + w_a |dn_a| + w_b |dn_b| + |dσ| + 2 (|dκ_a| + |dκ_b|) σ / (κ_a + κ_b)
//!
//! with the true normal n, the smooth normals n_a and n_b, the weights w, the sum of the spreads σ
//! and the curvatures κ. A vector that is shortened to a length changes by at most the sum of both
//! changes, and shortening n_a − n instead of taking it whole does not increase the effect of n.
//! The last term is that of the weights. Its fraction is a length: how far the mesh must be
//! followed for the normals to turn by the spread, about one triangle. Spread and curvature fall to
//! 0 together towards a flat face, and the fraction stays finite. The combination has at least the
//! length cos(`most_turn` / 2), so the direction changes by at most this bound divided by the
//! cosine.
//!
//! Deviation: the paper only names Gouraud shading, and \[MS96\] treats a point against one
//! surface. The rule for two surfaces is ours.

use glam::DVec3;

/// Settings of force shading.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct ShadingSettings {
    /// Edges where the mesh bends by more than this angle stay sharp, rad.
    pub crease_angle: f64,
    /// Largest rotation of a force by shading, rad.
    pub most_turn: f64,
}

/// The smoothed surface of one body at a witness point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothNormal {
    /// Outward unit vector in b's frame.
    pub normal: DVec3,
    /// Rotation of the normal per length along the surface, rad/m; 0 where the surface is flat.
    pub curvature: f64,
    /// Largest distance between the normal and the unit normals of the triangles around it, at a
    /// vertex. Linear between vertices, and 0 where the surface is flat.
    pub spread: f64,
}

/// Returns the unit direction of the force on a, which replaces the contact normal `normal` (unit,
/// from b into a).
pub fn shade(normal: DVec3, side_a: Option<SmoothNormal>, side_b: Option<SmoothNormal>, most_turn: f64) -> DVec3 {
    let (share_a, share_b) = match (&side_a, &side_b) {
        (None, None) => return normal,
        (Some(_), None) => (1.0, 0.0),
        (None, Some(_)) => (0.0, 1.0),
        (Some(a), Some(b)) => {
            let both = a.curvature + b.curvature;
            let share_b = if both > 0.0 { a.curvature / both } else { 0.5 };
            (1.0 - share_b, share_b)
        }
    };
    let spread = [side_a, side_b].into_iter().flatten().map(|side| side.spread).sum();
    let mut direction = normal;
    for (side, sign, share) in [(side_a, -1.0, share_a), (side_b, 1.0, share_b)] {
        if let Some(SmoothNormal { normal: outward, .. }) = side {
            let smooth = sign * outward;
            let turn = (smooth - normal).clamp_length_max(spread);
            direction += share * confidence(smooth, normal, most_turn) * turn;
        }
    }
    direction.normalize_or(normal)
}

/// Returns the factor of step 3 for the direction `smooth`: 1 within half of `most_turn` of
/// `normal`, falling to 0 at `most_turn`.
fn confidence(smooth: DVec3, normal: DVec3, most_turn: f64) -> f64 {
    let (none, all) = (most_turn.cos(), (0.5 * most_turn).cos());
    let cosine = smooth.dot(normal);
    if cosine >= all {
        1.0
    } else if cosine <= none {
        0.0
    } else {
        (cosine - none) / (all - none)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Random;
    use super::*;

    const SEED: u64 = 0x5AAD;

    /// Returns a side with normals in all directions.
    fn side(normal: DVec3, curvature: f64) -> Option<SmoothNormal> {
        Some(SmoothNormal { normal, curvature, spread: 2.0 })
    }

    fn flat(normal: DVec3) -> Option<SmoothNormal> {
        Some(SmoothNormal { normal, curvature: 0.0, spread: 0.0 })
    }

    #[test]
    fn two_spheres_push_along_the_line_of_their_centres() {
        // The faceted surfaces may meet at any point between the spheres.
        let mut random = Random::new(SEED);
        for round in 0..200 {
            let (r_a, r_b) = (random.between(0.01, 0.1), random.between(0.01, 0.1));
            let axis = random.direction();
            let (center_a, center_b) = (axis * (r_a + r_b), DVec3::ZERO);
            let meet = axis * r_b + random.point(0.1 * r_a.min(r_b));
            let n_a = (meet - center_a) / r_a;
            let n_b = (meet - center_b) / r_b;
            let answer = shade(axis, side(n_a, 1.0 / r_a), side(n_b, 1.0 / r_b), 1.2);
            assert!((answer - axis).length() < 1e-12, "seed {SEED:#x}, round {round}");
        }
    }

    #[test]
    fn flat_side_decides_and_crease_is_ignored() {
        let n = DVec3::Z;
        let tilted = DVec3::new(0.1, 0.0, 1.0).normalize();
        assert!((shade(n, side(-tilted, 20.0), flat(n), 0.5) - n).length() < 1e-15);
        assert!((shade(n, flat(-n), side(tilted, 20.0), 0.5) - n).length() < 1e-15);
        assert!((shade(n, None, side(tilted, 20.0), 0.5) - tilted).length() < 1e-15);
        assert_eq!(shade(n, flat(-tilted), None, 0.5), n);
        assert_eq!(shade(n, None, None, 0.5), n);
    }

    /// The rim of a tilted peg on a plate: the corner of their patch lies on two flat faces.
    #[test]
    fn two_flat_faces_keep_the_normal_of_their_contact() {
        let tilted = DVec3::new(0.05, 0.0, 1.0).normalize();
        // Curvatures and spreads of flat faces have rounding errors.
        let rounded = |normal: DVec3, curvature: f64| Some(SmoothNormal { normal, curvature, spread: 1e-15 });
        for (curvature_a, curvature_b) in [(0.0, 0.0), (0.0, 1e-13), (1e-13, 0.0)] {
            let answer = shade(DVec3::Z, rounded(-tilted, curvature_a), rounded(DVec3::Z, curvature_b), 0.5);
            assert!((answer - DVec3::Z).length() < 1e-14);
        }
    }

    /// The bound of the module's description, between flat and curved sides too.
    #[test]
    fn direction_changes_no_faster_than_its_bound() {
        const MOST: f64 = 0.8;
        /// Spread over curvature, m.
        const LENGTH: f64 = 1e-3;
        let mut random = Random::new(SEED ^ 2);
        for round in 0..20_000 {
            let n = random.direction();
            // Most of the sides are nearly flat.
            let mut before = [0, 1].map(|_| SmoothNormal {
                normal: (n + random.point(0.2)).normalize(),
                curvature: random.between(0.0, 1.0).powi(8) * 300.0,
                spread: 0.0,
            });
            before.iter_mut().for_each(|side| side.spread = random.between(0.0, LENGTH) * side.curvature);
            let after = before.map(|side| SmoothNormal {
                normal: (side.normal + random.point(1e-6)).normalize(),
                curvature: side.curvature * (1.0 + random.between(0.0, 1e-6)),
                spread: side.spread * (1.0 + random.between(0.0, 1e-6)),
            });
            let n_after = (n + random.point(1e-6)).normalize();
            let direction = |n: DVec3, [a, b]: [SmoothNormal; 2]| {
                shade(n, Some(SmoothNormal { normal: -a.normal, ..a }), Some(b), MOST)
            };
            let both = before[0].curvature + before[1].curvature;
            let spread = |sides: &[SmoothNormal; 2]| sides[0].spread + sides[1].spread;
            let own = |k: usize| {
                let (from, to) = (before[k], after[k]);
                let weights = 2.0 * (to.curvature - from.curvature) * spread(&before) / both;
                before[1 - k].curvature / both * to.normal.distance(from.normal) + weights
            };
            let wider = spread(&after) - spread(&before);
            let bound = (n_after.distance(n) + own(0) + own(1) + wider) / (0.5 * MOST).cos();
            let moved = direction(n_after, after).distance(direction(n, before));
            assert!(moved <= bound + 1e-11, "seed {SEED:#x}, round {round}: {moved} above {bound}");
        }
    }

    #[test]
    fn turn_is_bounded_and_continuous() {
        let most = 0.4;
        let mut random = Random::new(SEED ^ 1);
        for round in 0..500 {
            let n = random.direction();
            let mut any = || side((n + random.point(0.6)).normalize(), random.between(0.0, 50.0));
            let answer = shade(n, any().map(|s| SmoothNormal { normal: -s.normal, ..s }), any(), most);
            assert!((answer.length() - 1.0).abs() < 1e-12, "seed {SEED:#x}, round {round}");
            assert!(answer.angle_between(n) <= most + 1e-7, "seed {SEED:#x}, round {round}");
        }
        let at = |angle: f64| shade(DVec3::Z, None, side(DVec3::new(angle.sin(), 0.0, angle.cos()), 1.0), most);
        assert!((at(0.5 * most) - DVec3::new((0.5 * most).sin(), 0.0, (0.5 * most).cos())).length() < 1e-12);
        assert_eq!(at(most + 1e-9), DVec3::Z);
        for k in 0..1000 {
            let angle = f64::from(k) * 1e-3;
            assert!(at(angle).distance(at(angle + 1e-3)) < 5e-3, "at {angle}");
        }
        assert_eq!(shade(DVec3::Z, side(DVec3::Z, 1.0), side(-DVec3::Z, 1.0), most), DVec3::Z);
    }
}
