//! Balls around witness points that no surface enters.
//!
//! The check of a moved depth (`confirm`) asks whether a witness point is inside a body and no
//! surface of the body is nearer than a distance. The answer for one point also holds for points
//! nearby. So the query stores a ball without surfaces around the point, and searches the mesh
//! again when the ball is too small. Results do not depend on the stored balls.

use glam::DVec3;

use crate::algebra::PairTable;
use crate::body::Body;

/// Number of pairs of pieces for which there is a place.
const PLACES: usize = 256;

/// A ball that no surface of a body enters, or the distance of a surface from its centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClearBall {
    /// The point, in the frame of the body.
    center: DVec3,
    /// No surface is nearer to the centre than this, in model units.
    radius: f64,
    /// A surface is at most this far from the centre, in model units.
    surface: f64,
    /// True if the ball is inside the body, or if the body is open.
    inside: bool,
}

impl ClearBall {
    const NONE: Self = Self { center: DVec3::NAN, radius: 0.0, surface: f64::INFINITY, inside: false };

    /// Returns true if no surface of the body is nearer to `point` (in its frame) than `least`, and
    /// the point is inside the body or the body is open. `self` is the last ball near this point.
    /// `depth` is the depth of the contact. The contact's own surface is about that far from the
    /// point, so a larger ball is not searched.
    pub(super) fn lies_within(&mut self, body: &Body, point: DVec3, least: f64, depth: f64) -> bool {
        let motion = point.distance(self.center);
        if motion + self.surface < least {
            return false;
        }
        if motion + least <= self.radius {
            return self.inside;
        }
        let tree = body.tree();
        // In fast motion, a larger ball would not serve in the next query.
        let reach = if least + motion < depth { depth } else { least };
        let nearest = tree.nearest_within(point, reach).map(|surface| surface.distance);
        let (radius, surface) = (nearest.unwrap_or(reach), nearest.unwrap_or(f64::INFINITY));
        let inside = radius >= least && (!body.mesh().is_closed() || tree.inside(point));
        // If a surface is too near, the test of the inside is skipped, so the ball is not stored.
        *self = Self { center: point, radius: if radius < least { 0.0 } else { radius }, surface, inside };
        inside
    }
}

/// The balls of pairs of pieces: around the point of a in b, and around the point of b in a.
#[derive(Clone, Debug)]
pub(super) struct ClearBalls(PairTable<[ClearBall; 2]>);

impl ClearBalls {
    pub(super) fn new() -> Self {
        Self(PairTable::new(PLACES, || [ClearBall::NONE; 2]))
    }

    /// Returns the balls of a pair of pieces.
    pub(super) fn of(&mut self, pieces: [u32; 2]) -> &mut [ClearBall; 2] {
        self.0.of(pieces, |balls| *balls = [ClearBall::NONE; 2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;
    use crate::body::shapes::torus;
    use crate::body::{Body, BodySettings};

    const SEED: u64 = 0xC1EA2;

    #[test]
    fn results_do_not_depend_on_stored_balls() {
        let body = Body::build(torus(0.03, 0.01, 24, 16), &BodySettings::default(), &mut |_| ()).unwrap();
        let mut random = Random::new(SEED);
        let mut balls = ClearBalls::new();
        let (mut point, mut depth, mut kept, mut within) = (DVec3::new(0.03, 0.0, 0.0), 0.004, 0, 0);
        for tick in 0..20_000 {
            point += random.direction() * random.between(0.0, 3e-4);
            if point.distance(DVec3::new(0.03, 0.0, 0.0)) > 0.012 {
                point = DVec3::new(0.03, 0.0, 0.0);
            }
            depth = (depth + random.between(-1e-4, 1e-4)).clamp(1e-4, 0.01);
            let ball = &mut balls.of([1, 2])[0];
            let before = ball.center;
            let stored = ball.lies_within(&body, point, 0.8 * depth, depth);
            kept += u32::from(ball.center == before);
            let mut new = ClearBall::NONE;
            let anew = new.lies_within(&body, point, 0.8 * depth, depth);
            assert_eq!(stored, anew, "seed {SEED:#x}, tick {tick}: {point}, {depth}");
            within += u32::from(anew);
        }
        assert!(kept > 5_000 && (2_000..18_000).contains(&within), "{kept} kept, {within} within");
    }
}
