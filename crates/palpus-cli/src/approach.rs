//! The path of a simulated hand that a scene gives none: to the environment, and back.

use std::sync::Arc;

use glam::DVec3;
use palpus::algebra::Pose;
use palpus::body::Body;
use palpus::detect::{ContactQuery, QuerySettings};
use palpus_scenes::{HandPath, Key};

/// A hand for a scene without a path: from the start towards the environment until the bodies
/// touch, a little deeper, and back, again and again. It heads for the environment's middle, or if
/// that leads past it, for its nearest point. Poses are those of the probe's mesh, world.
pub(crate) fn approach(a: &Arc<Body>, b: &Arc<Body>, start: Pose, environment: Pose, tolerance: f64) -> HandPath {
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
    let press = (PRESS_TOLERANCES * tolerance).max(LEAST_PRESS.min(LEAST_PRESS_SHARE * a.size().min(b.size())));
    let pressed = at(towards, travel + press);
    let period = (travel / APPROACH_SPEED).max(1.0);
    HandPath::cyclic(&[Key::rest(0.0, start), Key::rest(period, pressed), Key::rest(2.0 * period, start)])
}

/// Steps of the search for first touch; it converges linearly, and a grazing approach may be cut
/// short.
const MOST_ADVANCES: usize = 200;
/// How far the hand presses beyond touch, in contact tolerances.
const PRESS_TOLERANCES: f64 = 3.0;
/// m, and of the smaller body: less is lost in the device's friction.
const LEAST_PRESS: f64 = 3e-3;
const LEAST_PRESS_SHARE: f64 = 0.1;
/// m/s.
const APPROACH_SPEED: f64 = 0.05;
