//! Default path of the simulated hand, for scenes without a path: to the environment and back.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus_io::scene::CouplingMode;
use palpus_scenes::{HandPath, Key};

/// The straight path from a start to first touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WayIn {
    /// Unit vector, world.
    towards: DVec3,
    /// Length of the path, m.
    travel: f64,
    /// Direction in which the hand presses at the end: into the touched surface. Unit vector,
    /// world.
    inward: DVec3,
}

/// Two bodies, and the memory for a search of paths from one to the other.
pub(crate) struct Ways {
    pub(crate) probe: Arc<Body>,
    pub(crate) environment: Arc<Body>,
    /// Created for the first search; large bodies take a tenth of a second.
    query: Option<ContactQuery>,
}

impl Ways {
    pub(crate) fn new(probe: &Arc<Body>, environment: &Arc<Body>) -> Self {
        Self { probe: probe.clone(), environment: environment.clone(), query: None }
    }

    /// Returns the path of the probe from `start` to the environment at `placed` (poses in the
    /// world). The path leads to the environment's centre of mass. If that line misses the
    /// environment, the path leads to the nearest point.
    pub(crate) fn find(&mut self, start: Pose, placed: Pose, tolerance: f64) -> WayIn {
        let Self { probe, environment, query } = self;
        let settings = QuerySettings { tolerance: 0.0, capacity: 1 << 14, ..QuerySettings::default() };
        let query = query.get_or_insert_with(|| ContactQuery::new(probe.clone(), environment.clone(), settings));
        // The result does not depend on earlier searches.
        query.clear();
        let mut nearest = |pose: Pose| query.nearest(&(placed.inverse() * pose));
        let goal = placed.point(environment.mass().center_of_mass) - start.point(probe.mass().center_of_mass);
        let towards = goal.normalize_or(-DVec3::Z);
        // Conservative advancement: a step of the current distance cannot cause overlap.
        let mut way = WayIn { towards, travel: 0.0, inward: towards };
        for _ in 0..MOST_ADVANCES {
            let touched = nearest(way.end(start, 0.0));
            let gap = touched.map_or(f64::INFINITY, |contact| contact.separation);
            if gap <= 0.1 * tolerance {
                // The path may only graze the surface, for example in a hole of a plate.
                let normal = touched.filter(|_| gap > 0.0).map(|contact| placed.vector(-contact.normal));
                return WayIn { inward: normal.unwrap_or(towards), ..way };
            }
            if way.travel > goal.length() {
                break;
            }
            way.travel += gap;
        }
        match nearest(start) {
            Some(contact) => {
                let towards = placed.vector(contact.point_b - contact.point_a).normalize_or(towards);
                WayIn { towards, travel: contact.separation.max(0.0), inward: towards }
            }
            None => way,
        }
    }
}

impl WayIn {
    /// Returns the pose that is `beyond` (m) past the end of the path from `start`.
    fn end(&self, start: Pose, beyond: f64) -> Pose {
        Pose { translation: start.translation + self.towards * (self.travel + beyond), ..start }
    }

    /// Returns the pose on the path at a distance before first touch: the size of the larger body
    /// (`larger`, m), at most [`FARTHEST`]. `None` if `start` is not farther away.
    pub(crate) fn nearer(&self, start: Pose, larger: f64) -> Option<Pose> {
        let farthest = larger.min(FARTHEST);
        (self.travel > farthest).then(|| self.end(start, -farthest))
    }
}

/// Returns a hand for a scene without a path. The hand moves from the start until the bodies
/// touch, a little deeper, presses for a while, goes back, and repeats this motion. Poses place
/// the probe's mesh in the world.
pub(crate) fn approach(ways: &mut Ways, start: Pose, placed: Pose, tolerance: f64, mode: CouplingMode) -> HandPath {
    let way = ways.find(start, placed, tolerance);
    let size = ways.probe.size().min(ways.environment.size());
    // With a coupling, the tool stays outside even if the hand's target is deep inside.
    let least = match mode {
        CouplingMode::Coupled => LEAST_PRESS,
        CouplingMode::Direct => LEAST_PRESS.min(LEAST_PRESS_SHARE * size),
    };
    let press = least.max(PRESS_TOLERANCES * tolerance);
    let touch = way.end(start, 0.0);
    let pressed = Pose { translation: touch.translation + way.inward * press, ..touch };
    let slow = (way.travel / APPROACH_SPEED).clamp(APPROACH_TIME[0], APPROACH_TIME[1]);
    let period = slow.max(way.travel / MOST_SPEED);
    let keys = [
        Key::rest(0.0, start),
        Key::rest(period, pressed),
        Key::rest(period + PRESS_TIME, pressed),
        Key::rest(2.0 * period + PRESS_TIME, start),
    ];
    HandPath::cyclic(&keys)
}

/// Largest number of steps of the search for first touch. The search converges linearly, so the
/// path of a grazing approach may end too early.
const MOST_ADVANCES: usize = 200;
/// Distance by which the hand presses beyond touch, in contact tolerances.
const PRESS_TOLERANCES: f64 = 3.0;
/// Smallest press, m; the device's friction hides a smaller press. Without a coupling, the hand
/// could pass through a small body, so [`LEAST_PRESS_SHARE`] of the smaller body is the limit.
const LEAST_PRESS: f64 = 3e-3;
const LEAST_PRESS_SHARE: f64 = 0.1;
/// Time for which the hand presses, s.
const PRESS_TIME: f64 = 0.4;
/// Mean speed of the hand, m/s.
const APPROACH_SPEED: f64 = 0.05;
/// Duration of the approach, s. For longer or shorter paths the speed changes, so that a person
/// waits less than a second for first touch.
const APPROACH_TIME: [f64; 2] = [0.6, 0.8];
/// Largest mean speed, m/s. The peak speed is then below 3 m/s, at which the safety chain removes
/// the force.
const MOST_SPEED: f64 = 1.0;
/// Largest distance of a chosen start from first touch, m.
const FARTHEST: f64 = 0.2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_touch_comes_within_a_second_on_short_ways() {
        for size in [1e-3, 0.05, 0.8] {
            let points: Vec<DVec3> = (0..8u32)
                .map(|k| {
                    let side = |bit: u32| size * f64::from(k >> bit & 1);
                    DVec3::new(side(0), side(1), side(2))
                })
                .collect();
            let body = Arc::new(Body::from_convex(&points).expect("the box has a hull"));
            let start = Pose::from_translation(DVec3::new(0.0, 0.0, 3.0 * size));
            let path =
                approach(&mut Ways::new(&body, &body), start, Pose::IDENTITY, 0.01 * size, CouplingMode::Coupled);
            // The tolerance ends the way a little beyond 2 sizes.
            let slowest = 2.0 * APPROACH_TIME[1].max(2.01 * size / MOST_SPEED) + PRESS_TIME;
            assert!(path.duration() <= slowest, "{size}: the hand returns only after {} s", path.duration());
            let speed = (0..4000u32).map(|k| path.twist(f64::from(k) * 1e-3).linear.length()).fold(0.0, f64::max);
            assert!(speed < 2.5, "{size}: {speed} m/s");
            let way = Ways::new(&body, &body).find(start, Pose::IDENTITY, 0.01 * size);
            let farthest = body.size().min(FARTHEST);
            let nearer = way.nearer(start, body.size()).map(|nearer| nearer.translation.z - size);
            let is_near = nearer.is_some_and(|gap| (gap - farthest).abs() < 0.02 * size);
            assert!(is_near, "{size}: {nearer:?} for {farthest}");
        }
    }

    #[test]
    fn hand_presses_into_a_surface_that_its_path_grazes() {
        let cuboid = |half: DVec3| {
            let side = |k: usize, bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            let corner = |k: usize| half * DVec3::new(side(k, 0), side(k, 1), side(k, 2));
            Arc::new(Body::from_convex(&(0..8).map(corner).collect::<Vec<_>>()).expect("the box has a hull"))
        };
        let (probe, plate) = (cuboid(DVec3::splat(1e-3)), cuboid(DVec3::new(0.5, 0.5, 5e-3)));
        let start = Pose::from_translation(DVec3::new(-0.6, 0.0, 0.025));
        let way = Ways::new(&probe, &plate).find(start, Pose::IDENTITY, 1e-4);
        assert!(way.towards.z > -0.1 && way.inward.z < -0.99, "{way:?}");
    }

    #[test]
    fn hand_presses_bodies_of_any_size() {
        for size in [1e-5, 1e-3, 0.1] {
            let side = |k: usize, bit: usize| size * (k >> bit & 1) as f64;
            let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
            let body = Arc::new(Body::from_convex(&points).expect("the box has a hull"));
            let start = Pose::from_translation(DVec3::new(0.0, 0.0, 3.0 * size));
            let goes = |mode| {
                let path = approach(&mut Ways::new(&body, &body), start, Pose::IDENTITY, 0.01 * size, mode);
                start.translation.z - path.pose(0.5 * path.duration()).translation.z - 2.0 * size
            };
            let (coupled, direct) = (goes(CouplingMode::Coupled), goes(CouplingMode::Direct));
            assert!(coupled > 0.99 * LEAST_PRESS, "{size}: {coupled}");
            assert!(direct < 0.5 * size && direct > 0.0, "{size}: {direct}");
        }
    }
}
