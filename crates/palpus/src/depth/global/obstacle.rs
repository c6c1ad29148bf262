//! An obstacle: the set of translations at which two convex cells overlap. The set is convex, and
//! is represented by its support points.
//!
//! For a cell P of the moving body and a cell Q of the fixed body, the set is the Minkowski
//! difference {q − p}. The ray query follows G. Snethen, *XenoCollide*, Game Programming Gems 7,
//! 2008:
//!
//! 1. Start from a point inside the set. Find three support points such that the ray passes through
//!    their triangle (the *portal*).
//! 2. Move the portal outward along its normal until no support point lies beyond it.
//!
//! The portal consists of points of the set, so the ray is inside the set up to the portal. The
//! plane through the last support point bounds a half-space that is proven to be outside. Deviation
//! from XenoCollide: the result is always the distance to the portal. So each translation that is
//! reported as blocked is blocked, even if the search stops early.

use glam::DVec3;

use crate::algebra::tolerance::{EXIT_TURNS, PORTAL_ROUNDING, PORTAL_STEPS};

/// A convex set of translations at which two bodies overlap, in b's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Obstacle<'a> {
    /// Corners of a cell of the moving body, at translation zero.
    pub(super) moving: &'a [DVec3],
    /// Corners of a cell of the fixed body.
    pub(super) fixed: &'a [DVec3],
    /// A translation in the set.
    pub(super) center: DVec3,
    /// Radius of a ball around `center` that lies in the set.
    pub(super) inner: f64,
    /// Radius of a ball around `center` that contains the set.
    pub(super) outer: f64,
}

/// The point at which a ray leaves an obstacle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exit {
    /// Distance along the ray up to which the ray is proven to be inside.
    pub(super) distance: f64,
    /// Unit vector that points outward.
    pub(super) normal: DVec3,
    /// Every translation t with `normal · t ≥ offset` lies outside.
    pub(super) offset: f64,
}

/// A support point as a pair of indices: a corner of the moving cell and a corner of the fixed
/// cell.
type Name = [u32; 2];

/// The names of three support points. A ray leaves an obstacle through their triangle.
pub(super) type Gate = [Name; 3];

/// Three support points around a ray, relative to the start of the ray.
struct Portal {
    v: [DVec3; 3],
    names: Gate,
}

impl Obstacle<'_> {
    /// Returns the point of the set that is farthest along `direction`, and its name.
    fn support(&self, direction: DVec3) -> (DVec3, Name) {
        let (moving, p) = farthest(self.moving, -direction);
        let (fixed, q) = farthest(self.fixed, direction);
        (q - p, [moving, fixed])
    }

    /// Returns true if `t` is proven to lie in the interior.
    pub(super) fn holds(&self, t: DVec3) -> bool {
        let away = t - self.center;
        let distance = away.length();
        if distance < self.inner {
            return true;
        }
        if distance >= self.outer || self.moving.is_empty() {
            return false;
        }
        self.passes(self.center, away / distance, distance)
    }

    /// Returns true if the ray from `from`, a point inside, stays inside for more than `distance`.
    fn passes(&self, from: DVec3, along: DVec3, distance: f64) -> bool {
        let Some(portal) = self.portal(from, along) else { return false };
        self.refine(portal, from, along, Some(distance)).is_some_and(|(exit, _)| exit.distance > distance)
    }

    /// Returns the point where the ray from `from` along `along` (unit) leaves the set. `None` if
    /// `from` does not lie inside, or if rounding prevents a result.
    pub(super) fn exit(&self, from: DVec3, along: DVec3) -> Option<Exit> {
        self.exit_by(from, along, &mut None)
    }

    /// Returns the same as [`Self::exit`]. `gate` is the portal of a nearby ray or pose. The search
    /// starts from this portal if the ray passes through it, and stores the last portal in `gate`.
    pub(super) fn exit_by(&self, from: DVec3, along: DVec3, gate: &mut Option<Gate>) -> Option<Exit> {
        if self.moving.is_empty() {
            return self.exit_of_ball(from, along);
        }
        let begin = gate.and_then(|gate| self.portal_at(gate, from, along));
        let found = begin.and_then(|portal| self.refine(portal, from, along, None));
        let (exit, names) = match found {
            Some(found) => found,
            None => self.refine(self.portal(from, along)?, from, along, None)?,
        };
        *gate = Some(names);
        Some(exit)
    }

    /// Returns the portal of these support points. `None` if the ray does not pass through it.
    fn portal_at(&self, names: Gate, from: DVec3, along: DVec3) -> Option<Portal> {
        let v = names.map(|[moving, fixed]| self.fixed[fixed as usize] - self.moving[moving as usize] - from);
        let sides = [v[0].cross(v[1]).dot(along), v[1].cross(v[2]).dot(along), v[2].cross(v[0]).dot(along)];
        let passes = sides.iter().all(|&side| side > 0.0) || sides.iter().all(|&side| side < 0.0);
        passes.then_some(Portal { v, names })
    }

    /// Returns a near exit from `from`, which must lie inside. The exit is a local minimum of the
    /// distance over the normals of the facets.
    pub(super) fn nearest_exit(&self, from: DVec3) -> Option<Exit> {
        let mut best = self.exit(from, (from - self.center).try_normalize().unwrap_or(DVec3::X))?;
        for _ in 0..EXIT_TURNS {
            match self.exit(from, best.normal) {
                Some(exit) if exit.distance < best.distance => best = exit,
                _ => break,
            }
        }
        Some(best)
    }

    fn exit_of_ball(&self, from: DVec3, along: DVec3) -> Option<Exit> {
        let away = from - self.center;
        let half = away.dot(along);
        let root = half * half + self.inner * self.inner - away.length_squared();
        if root <= 0.0 {
            return None;
        }
        let distance = root.sqrt() - half;
        let normal = (away + along * distance) / self.inner;
        Some(Exit { distance, normal, offset: normal.dot(self.center) + self.inner })
    }

    /// Returns three support points such that the ray passes through their triangle. `None` if
    /// `from` does not lie inside.
    fn portal(&self, from: DVec3, along: DVec3) -> Option<Portal> {
        let support = |direction: DVec3| {
            let (point, name) = self.support(direction);
            (point - from, name)
        };
        let (mut v1, mut name1) = support(along);
        if v1.dot(along) <= 0.0 {
            return None;
        }
        let mut aside = v1.cross(along);
        if aside.length_squared() <= PORTAL_ROUNDING * PORTAL_ROUNDING * v1.length_squared() {
            // The ray passes through the support point itself. Any perpendicular direction is
            // valid.
            aside = along.any_orthogonal_vector();
        }
        let (mut v2, mut name2) = support(aside);
        if v2.dot(aside) <= 0.0 {
            return None;
        }
        for _ in 0..PORTAL_STEPS {
            let side = v2.cross(v1);
            let (v3, name3) = support(side);
            if v3.dot(side) <= 0.0 {
                return None;
            }
            if v1.cross(v3).dot(along) < 0.0 {
                (v2, name2) = (v3, name3);
            } else if v3.cross(v2).dot(along) < 0.0 {
                (v1, name1) = (v3, name3);
            } else {
                return Some(Portal { v: [v1, v2, v3], names: [name1, name2, name3] });
            }
        }
        None
    }

    /// Moves the portal outward, and also returns the last portal. If `wanted` is given, stops as
    /// soon as it is known whether the exit is nearer or farther than that distance.
    fn refine(&self, portal: Portal, from: DVec3, along: DVec3, wanted: Option<f64>) -> Option<(Exit, Gate)> {
        let Portal { mut v, mut names } = portal;
        let mut best: Option<Exit> = None;
        for _ in 0..PORTAL_STEPS {
            let mut normal = (v[1] - v[0]).cross(v[2] - v[0]).normalize_or_zero();
            let mut slope = normal.dot(along);
            if slope < 0.0 {
                (normal, slope) = (-normal, -slope);
            }
            if slope <= PORTAL_ROUNDING {
                break;
            }
            let height = normal.dot(v[0]);
            let (next, name) = self.support(normal);
            let next = next - from;
            let beyond = normal.dot(next);
            let exit = Exit { distance: height / slope, normal, offset: beyond + normal.dot(from) };
            if best.is_none_or(|best| exit.distance >= best.distance) {
                best = Some(exit);
            }
            let decided = wanted.is_some_and(|wanted| height > wanted * slope || beyond <= wanted * slope);
            if decided || beyond - height <= PORTAL_ROUNDING * self.outer {
                break;
            }
            let replaced = sub_portal(&v, next, along);
            (v[replaced], names[replaced]) = (next, name);
        }
        best.filter(|exit| exit.distance > 0.0).map(|exit| (exit, names))
    }
}

/// Returns the corner of the portal to replace by `next`, such that the ray still passes through
/// the triangle.
fn sub_portal(v: &[DVec3; 3], next: DVec3, along: DVec3) -> usize {
    let mut best = (f64::NEG_INFINITY, 0);
    for replaced in 0..3 {
        let (p, q) = (v[(replaced + 1) % 3], v[(replaced + 2) % 3]);
        let sides = [p.cross(q).dot(along), q.cross(next).dot(along), next.cross(p).dot(along)];
        let [least, most] = [sides[0].min(sides[1]).min(sides[2]), sides[0].max(sides[1]).max(sides[2])];
        let score = least.max(-most);
        if score > best.0 {
            best = (score, replaced);
        }
    }
    best.1
}

/// Returns the index of the point that is farthest along `direction`, and the point.
fn farthest(points: &[DVec3], direction: DVec3) -> (u32, DVec3) {
    let mut best = (f64::NEG_INFINITY, 0);
    for (k, &p) in points.iter().enumerate() {
        let along = p.dot(direction);
        if along > best.0 {
            best = (along, k);
        }
    }
    (best.1 as u32, points.get(best.1).copied().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Random;

    const SEED: u64 = 0x6a7e_0001;

    #[test]
    fn cached_gate_does_not_change_exit() {
        let mut random = Random::new(SEED);
        let (mut same, mut other) = (0, 0);
        for case in 0..200 {
            let mut cloud = |n: usize| (0..n).map(|_| random.direction()).collect::<Vec<DVec3>>();
            let (moving, fixed) = (cloud(20), cloud(30));
            let obstacle = Obstacle { moving: &moving, fixed: &fixed, center: DVec3::ZERO, inner: 0.1, outer: 2.0 };
            let mut gate = None;
            let along = random.direction();
            if obstacle.exit_by(DVec3::ZERO, along, &mut gate).is_none() {
                continue;
            }
            let first = gate;
            let near = (along + random.vector() * 0.1).normalize();
            let known = obstacle.exit_by(DVec3::ZERO, near, &mut gate).map(|exit| exit.distance);
            let cold = obstacle.exit(DVec3::ZERO, near).map(|exit| exit.distance);
            let (known, cold) = (known.unwrap_or_default(), cold.unwrap_or_default());
            assert!((known - cold).abs() <= 1e-9, "seed {SEED:#x}, case {case}: {known} instead of {cold}");
            *if gate == first { &mut same } else { &mut other } += 1;
        }
        assert!(same > 20 && other > 20, "both cases must occur: {same} and {other}");
    }
}
