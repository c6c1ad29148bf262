//! A path on which one body touches another body at many places. A start pose is enough to compute
//! it for any two bodies.
//!
//! 1. Move from the start toward the nearest point of the other body until they touch (conservative
//!    advancement: a motion by the nearest distance never passes through the surface).
//! 2. Lift off along the normal, move sideways and rotate a little, by random amounts from a seed.
//!    Then move in again to the next place of contact. Reject motions on which the bodies would
//!    collide.
//! 3. At every place, press the probe in by a few tolerances, slide it sideways and lift it.
//!
//! The path is a random walk over the surface, inside a hollow or outside.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Random};
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};

use crate::path::{HandPath, Key};

/// Number of places of contact, for a path of several minutes.
const PLACES: usize = 40;
/// Number of attempts to find the next place before the walk ends.
const TRIES: usize = 30;
/// Height to which the probe is lifted, in tolerances.
const LIFT: f64 = 6.0;
/// Smallest and largest sideways motion, as multiples of the lift height.
const SIDEWAYS: [f64; 2] = [1.0, 6.0];
/// Rotation on the way to the next place, rad.
const TURN: f64 = 0.4;
/// Smallest and largest intended depth, in tolerances.
const PRESS: [f64; 2] = [1.0, 4.0];
/// Length of the sliding motion, in tolerances.
const RUB: f64 = 4.0;
/// Speed of the hand, m/s.
const SPEED: f64 = 0.04;
/// Shortest time between two keys, s.
const SHORTEST: f64 = 0.25;
/// Maximum number of steps of an advance. The advance converges linearly, so a grazing advance may
/// end early.
const MOST_ADVANCES: usize = 200;
/// Gap that counts as contact, in tolerances.
const TOUCHING: f64 = 0.1;
/// Number of intervals at whose ends a motion is tested for collision.
const LOOKS: usize = 6;

/// Returns a path of `a` in b's frame, from `start` over places where the bodies touch. The same
/// seed gives the same path. `None` if `a` does not reach `b` from `start`.
pub fn tour(a: &Arc<Body>, b: &Arc<Body>, start: Pose, tolerance: f64, seed: u64) -> Option<HandPath> {
    let settings = QuerySettings { tolerance: 0.0, capacity: 1 << 14, ..QuerySettings::default() };
    let query = ContactQuery::new(a.clone(), b.clone(), settings);
    let mut walk = Walk { query, tolerance, random: Random::new(seed) };
    let (gap, normal) = walk.nearest(&start)?;
    let first = walk.advance(start, -normal, gap + tolerance)?;
    let mut keys = vec![Key::rest(0.0, start)];
    walk.press(&mut keys, &first);
    let mut place = first;
    for _ in 1..PLACES {
        let Some(next) = (0..TRIES).find_map(|_| walk.next(&place)) else { break };
        walk.press(&mut keys, &next);
        place = next;
    }
    if let Some(last) = keys.last_mut() {
        last.rest = true;
    }
    Some(HandPath::through(&keys))
}

/// Poses at a place of contact.
struct Place {
    touch: Pose,
    lifted: Pose,
    /// Normal from b into a.
    normal: DVec3,
}

struct Walk {
    query: ContactQuery,
    tolerance: f64,
    random: Random,
}

impl Walk {
    /// Returns the nearest distance at a pose, and the normal there.
    fn nearest(&mut self, pose: &Pose) -> Option<(f64, DVec3)> {
        let nearest = self.query.nearest(pose)?;
        Some((nearest.separation, nearest.normal))
    }

    /// Returns the place at which the probe touches when it moves from `from` along `way` (unit
    /// vector).
    fn advance(&mut self, from: Pose, way: DVec3, most: f64) -> Option<Place> {
        let mut travel = 0.0;
        for _ in 0..MOST_ADVANCES {
            let touch = Pose { translation: from.translation + way * travel, ..from };
            let (gap, normal) = self.nearest(&touch)?;
            if gap <= TOUCHING * self.tolerance {
                let lifted = Pose { translation: touch.translation + normal * (LIFT * self.tolerance), ..touch };
                return Some(Place { touch, lifted, normal });
            }
            travel += gap;
            if travel > most {
                return None;
            }
        }
        None
    }

    /// Returns another place near this one.
    fn next(&mut self, place: &Place) -> Option<Place> {
        let lift = LIFT * self.tolerance;
        let aside = place.normal.cross(self.vector()).normalize_or(place.normal.any_orthonormal_vector());
        let far = lift * self.random.between(SIDEWAYS[0], SIDEWAYS[1]);
        let turn = DQuat::from_scaled_axis(self.vector() * TURN);
        let middle = self.query.a().mass().center_of_mass;
        let rotation = (turn * place.lifted.rotation).normalize();
        let center = place.lifted.point(middle) + aside * far;
        let over = Pose { rotation, translation: center - rotation * middle };
        if !self.is_free(&place.lifted, &over) {
            return None;
        }
        let next = self.advance(over, -place.normal, 4.0 * lift)?;
        (self.is_free(&over, &next.lifted) && self.is_free(&place.lifted, &next.lifted)).then_some(next)
    }

    /// Returns true if the bodies are apart on the motion from one pose to another.
    fn is_free(&mut self, from: &Pose, to: &Pose) -> bool {
        (0..=LOOKS).all(|k| {
            let part = k as f64 / LOOKS as f64;
            let rotation = from.rotation.slerp(to.rotation, part);
            let pose = Pose { rotation, translation: from.translation.lerp(to.translation, part) };
            self.nearest(&pose).is_some_and(|(gap, _)| gap > self.tolerance)
        })
    }

    /// Adds keys that move to the place, press the probe in, slide it sideways, and lift it.
    fn press(&mut self, keys: &mut Vec<Key>, place: &Place) {
        let deep = self.tolerance * self.random.between(PRESS[0], PRESS[1]);
        let aside = place.normal.cross(self.vector()).normalize_or(place.normal.any_orthonormal_vector());
        let at = |shift: DVec3| Pose { translation: place.touch.translation + shift, ..place.touch };
        let (inward, rub) = (-place.normal * deep, aside * (RUB * self.tolerance));
        for pose in [place.lifted, at(inward), at(inward + rub), at(inward - rub), place.lifted] {
            let Some(last) = keys.last() else { return };
            let far = last.pose.translation.distance(pose.translation);
            keys.push(Key::through(last.time + (far / SPEED).max(SHORTEST), pose));
        }
    }

    /// Returns a random vector in the cube \[−1, 1)³.
    fn vector(&mut self) -> DVec3 {
        let mut number = || self.random.signed();
        DVec3::new(number(), number(), number())
    }
}

#[cfg(test)]
mod tests {
    use palpus::body::{BodySettings, PolygonSoup};

    use super::*;
    use crate::shape::{sphere, torus};

    const SEED: u64 = 0x70c4;

    fn body(soup: PolygonSoup) -> Arc<Body> {
        Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).expect("a valid shape"))
    }

    #[test]
    fn tour_touches_at_many_places() {
        let body =
            |soup| Arc::new(Body::from_soup(&soup, &BodySettings::default(), &mut |_| ()).expect("a valid shape"));
        let (a, b) = (body(sphere(0.01, 1)), body(torus()));
        let tolerance = 1e-3;
        let start = Pose { translation: DVec3::new(0.04, 0.0, 0.05), ..Pose::IDENTITY };
        let path = tour(&a, &b, start, tolerance, SEED).expect("the sphere reaches the torus");
        assert_eq!(path.pose(0.0), start);
        assert!(path.duration() > 30.0, "{} s, seed {SEED}", path.duration());
        let settings = QuerySettings { tolerance: 0.0, ..QuerySettings::default() };
        let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
        let (mut touches, mut inside) = (0, false);
        for k in 0..(path.duration() / 0.02) as u32 {
            let gap =
                query.nearest(&path.pose(f64::from(k) * 0.02)).map_or(f64::INFINITY, |nearest| nearest.separation);
            touches += u32::from(gap < 0.0 && !inside);
            inside = gap < 0.0 || inside && gap < tolerance;
        }
        assert!(touches > 20, "{touches} touches, seed {SEED}");
        let again = tour(&a, &b, start, tolerance, SEED).expect("the sphere reaches the torus");
        assert_eq!(again.pose(17.0), path.pose(17.0), "seed {SEED}");
    }

    #[test]
    fn tour_reaches_the_rim_from_above_a_hole() {
        let (a, b) = (body(sphere(0.005, 1)), body(torus()));
        let above = Pose { translation: DVec3::new(0.0, 0.0, 0.1), ..Pose::IDENTITY };
        assert!(tour(&a, &b, above, 1e-3, SEED).is_some_and(|path| path.duration() > 30.0), "seed {SEED}");
    }
}
