//! The path of a simulated hand that a scene gives none: to the environment, and back.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus_io::scene::CouplingMode;
use palpus_scenes::{HandPath, Key};

/// A hand for a scene without a path: from the start towards the environment until the bodies
/// touch, a little deeper, and back, again and again. It heads for the environment's middle, or if
/// that leads past it, for its nearest point. Poses are those of the probe's mesh, world.
pub(crate) fn approach(
    a: &Arc<Body>,
    b: &Arc<Body>,
    start: Pose,
    environment: Pose,
    tolerance: f64,
    mode: CouplingMode,
) -> HandPath {
    let settings = QuerySettings { tolerance: 0.0, capacity: 1 << 14, ..QuerySettings::default() };
    let mut query = ContactQuery::new(a.clone(), b.clone(), settings);
    let mut nearest = |pose: Pose| query.nearest(&(environment.inverse() * pose));
    let goal = environment.point(b.mass().center_of_mass) - start.point(a.mass().center_of_mass);
    let mut towards = goal.normalize_or(-DVec3::Z);
    let at = |towards: DVec3, travel: f64| Pose { translation: start.translation + towards * travel, ..start };
    // Conservative advancement: the nearest distance can always be travelled.
    let (mut travel, mut touches) = (0.0, false);
    for _ in 0..MOST_ADVANCES {
        let gap = nearest(at(towards, travel)).map_or(f64::INFINITY, |contact| contact.separation);
        touches = gap <= 0.1 * tolerance;
        if touches || travel > goal.length() {
            break;
        }
        travel += gap;
    }
    if !touches && let Some(contact) = nearest(start) {
        towards = environment.vector(contact.point_b - contact.point_a).normalize_or(towards);
        travel = contact.separation.max(0.0);
    }
    // Behind a coupling the tool stays outside however deep the hand goes.
    let least = match mode {
        CouplingMode::Coupled => LEAST_PRESS,
        CouplingMode::Direct => LEAST_PRESS.min(LEAST_PRESS_SHARE * a.size().min(b.size())),
    };
    let press = least.max(PRESS_TOLERANCES * tolerance);
    let pressed = at(towards, travel + press);
    let period = (travel / APPROACH_SPEED).max(1.0);
    HandPath::cyclic(&[Key::rest(0.0, start), Key::rest(period, pressed), Key::rest(2.0 * period, start)])
}

/// Steps of the search for first touch; it converges linearly, and a grazing approach may be cut
/// short.
const MOST_ADVANCES: usize = 200;
/// How far the hand presses beyond touch, in contact tolerances.
const PRESS_TOLERANCES: f64 = 3.0;
/// m: less is lost in the device's friction. Without a coupling at most so much of the smaller
/// body, or the hand would go through it.
const LEAST_PRESS: f64 = 3e-3;
const LEAST_PRESS_SHARE: f64 = 0.1;
/// m/s.
const APPROACH_SPEED: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hand_presses_bodies_of_any_size() {
        for size in [1e-5, 1e-3, 0.1] {
            let side = |k: usize, bit: usize| size * (k >> bit & 1) as f64;
            let points: Vec<DVec3> = (0..8).map(|k| DVec3::new(side(k, 0), side(k, 1), side(k, 2))).collect();
            let body = Arc::new(Body::from_convex(&points).expect("a box"));
            let start = Pose::from_translation(DVec3::new(0.0, 0.0, 3.0 * size));
            let goes = |mode| {
                let path = approach(&body, &body, start, Pose::IDENTITY, 0.01 * size, mode);
                start.translation.z - path.pose(0.5 * path.duration()).translation.z - 2.0 * size
            };
            let (coupled, direct) = (goes(CouplingMode::Coupled), goes(CouplingMode::Direct));
            assert!(coupled > 0.99 * LEAST_PRESS, "{size}: {coupled}");
            assert!(direct < 0.5 * size && direct > 0.0, "{size}: {direct}");
        }
    }
}
