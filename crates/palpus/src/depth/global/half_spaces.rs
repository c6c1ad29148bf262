//! Finds the point nearest to the origin that several half-spaces have in common. Adds one
//! half-space after another (R. Seidel, *Small-Dimensional Linear Programming and Convex Hulls Made
//! Easy*, 1991). If the newest half-space does not contain the previous point, the new point lies
//! on the plane of the newest half-space. The same method is then applied within this plane, and
//! within lines of the plane.

use glam::DVec3;

use crate::algebra::tolerance::PORTAL_ROUNDING;

/// All points p with `normal · p ≥ offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfSpace {
    /// Unit normal.
    pub(super) normal: DVec3,
    /// Height of the bounding plane along the normal.
    pub(super) offset: f64,
}

impl HalfSpace {
    fn lacks(&self, p: DVec3, slack: f64) -> bool {
        self.normal.dot(p) < self.offset - slack
    }
}

/// Returns the point nearest to the origin that all `spaces` contain; `None` if they have no common
/// point. The point may lie outside a half-space by up to `slack`.
pub(super) fn nearest_common(spaces: &[HalfSpace], slack: f64) -> Option<DVec3> {
    let mut best = DVec3::ZERO;
    for (k, space) in spaces.iter().enumerate() {
        if space.lacks(best, slack) {
            best = nearest_on_plane(space, &spaces[..k], slack)?;
        }
    }
    Some(best)
}

fn nearest_on_plane(plane: &HalfSpace, spaces: &[HalfSpace], slack: f64) -> Option<DVec3> {
    let mut best = plane.normal * plane.offset;
    for (k, space) in spaces.iter().enumerate() {
        if space.lacks(best, slack) {
            best = nearest_on_line(plane, space, &spaces[..k], slack)?;
        }
    }
    Some(best)
}

fn nearest_on_line(first: &HalfSpace, second: &HalfSpace, spaces: &[HalfSpace], slack: f64) -> Option<DVec3> {
    let across = first.normal.cross(second.normal);
    let squared = across.length_squared();
    if squared < PORTAL_ROUNDING {
        return None;
    }
    let base = (second.normal.cross(across) * first.offset + across.cross(first.normal) * second.offset) / squared;
    let along = across / squared.sqrt();
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for space in spaces {
        let (slope, missing) = (space.normal.dot(along), space.offset - space.normal.dot(base));
        if slope.abs() <= PORTAL_ROUNDING {
            if missing > slack {
                return None;
            }
        } else if slope > 0.0 {
            low = low.max(missing / slope);
        } else {
            high = high.min(missing / slope);
        }
    }
    (low <= high).then(|| base + along * 0.0_f64.clamp(low, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;

    const SEED: u64 = 0x51de_90b3;

    #[test]
    fn nearest_common_point_is_nearer_than_samples() {
        let mut random = Random::new(SEED);
        for case in 0..300 {
            let inside = random.vector() * 2.0;
            let spaces: Vec<HalfSpace> = (0..1 + random.below(12))
                .map(|_| {
                    let normal = random.direction();
                    HalfSpace { normal, offset: normal.dot(inside) - 0.3 * random.unit() }
                })
                .collect();
            let Some(best) = nearest_common(&spaces, 1e-12) else { panic!("seed {SEED}, case {case}: no point") };
            assert!(spaces.iter().all(|space| !space.lacks(best, 1e-9)), "seed {SEED}, case {case}");
            for _ in 0..200 {
                let p = inside + random.vector() * 3.0;
                let common = spaces.iter().all(|space| !space.lacks(p, 0.0));
                assert!(!common || p.length() >= best.length() - 1e-9, "seed {SEED}, case {case}");
            }
        }
    }
}
