//! Bodies and cases with known answers, for the tests of all methods.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus_scenes::shape;

use crate::{Baseline, Felt, Settings};

pub(crate) fn body(soup: &PolygonSoup) -> Arc<Body> {
    Arc::new(Body::from_soup(soup, &BodySettings::default(), &mut |_| ()).expect("a shape of the scenes"))
}

const RADIUS: f64 = 0.012;
const BOX: DVec3 = DVec3::new(0.060, 0.040, 0.030);
pub(crate) const SETTINGS: Settings =
    Settings { tolerance: 1e-3, stiffness: 500.0, grip_a: DVec3::new(0.004, -0.003, 0.01) };

pub(crate) fn ball() -> Arc<Body> {
    body(&shape::sphere(RADIUS, 2))
}

/// Height of the ball's lowest corner over its middle, m, when turned.
pub(crate) fn lowest_of_ball(turn: DQuat) -> f64 {
    shape::sphere(RADIUS, 2).vertices.iter().map(|&p| (turn * p).z).fold(f64::INFINITY, f64::min)
}

pub(crate) fn table() -> Arc<Body> {
    body(&shape::table())
}

type Maker<'a> = &'a dyn Fn(Arc<Body>, Arc<Body>, Settings) -> Box<dyn Baseline>;

/// Lets a body down onto the table, one corner of its mesh lowest, and calls `judge` with the
/// height of that corner over the table, the corner, and what is felt.
fn down(soup: &PolygonSoup, turn: DQuat, make: Maker<'_>, mut judge: impl FnMut(f64, DVec3, &Felt)) {
    let mut method = make(body(soup), table(), SETTINGS);
    let lowest = soup.vertices.iter().map(|&p| turn * p).min_by(|p, q| p.z.total_cmp(&q.z)).expect("vertices");
    let speed = -0.05;
    let twist = Twist { angular: DVec3::ZERO, linear: DVec3::Z * speed };
    for tick in 0..70 {
        let height = 1.97e-3 + speed * 1e-3 * f64::from(tick);
        let pose = Pose::new(turn, DVec3::new(0.02, -0.01, height - lowest.z));
        let felt = method.step(&pose, &twist, 1e-3);
        judge(height, lowest + pose.translation - pose.point(SETTINGS.grip_a), &felt);
    }
}

/// A ball on its lowest corner: one contact, of known depth and lever.
pub(crate) fn ball_on_table(make: impl Fn(Arc<Body>, Arc<Body>, Settings) -> Box<dyn Baseline>) {
    let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -0.8, 0.5));
    down(&shape::sphere(RADIUS, 2), turn, &make, |height, lever, felt| {
        if height >= SETTINGS.tolerance {
            assert_eq!(*felt, Felt::NOTHING, "at {height}");
            return;
        }
        let force = DVec3::Z * SETTINGS.stiffness * (SETTINGS.tolerance - height);
        assert_eq!(felt.contacts, 1, "at {height}");
        assert!((felt.deepest - height).abs() < 1e-9, "{} at {height}", felt.deepest);
        assert!((felt.wrench.force - force).length() < 1e-6, "{} at {height}", felt.wrench.force);
        assert!((felt.wrench.torque - lever.cross(force)).length() < 1e-8, "{} at {height}", felt.wrench.torque);
    });
}

/// A box flat on the table: the depth and the force are known, the point of contact may be any of
/// the face.
pub(crate) fn box_on_table(make: impl Fn(Arc<Body>, Arc<Body>, Settings) -> Box<dyn Baseline>) {
    down(&shape::cuboid(BOX), DQuat::IDENTITY, &make, |height, _, felt| {
        if height >= SETTINGS.tolerance {
            assert_eq!(*felt, Felt::NOTHING, "at {height}");
            return;
        }
        let force = DVec3::Z * SETTINGS.stiffness * (SETTINGS.tolerance - height);
        assert!((felt.deepest - height).abs() < 1e-9, "{} at {height}", felt.deepest);
        assert!((felt.wrench.force - force).length() < 1e-6, "{} at {height}", felt.wrench.force);
        assert!(felt.wrench.torque.truncate().abs().max_element() <= force.z * BOX.max_element(), "at {height}");
    });
}

/// A ball dragged through the groove, felt twice: to the last bit the same, also after forgetting
/// the first time.
pub(crate) fn same_again(make: impl Fn(Arc<Body>, Arc<Body>, Settings) -> Box<dyn Baseline>) {
    let groove = body(&shape::v_groove());
    let drag = |method: &mut dyn Baseline| -> Vec<Felt> {
        let at = |k: f64| DVec3::new(0.002 * (0.05 * k).sin(), 1e-4 * k - 0.02, -1e-4 * k);
        let feel = |k: u32| {
            let k = f64::from(k);
            let pose = Pose::new(DQuat::from_rotation_x(0.02 * k), at(k));
            let twist = Twist { angular: DVec3::X * 20.0, linear: (at(k + 0.5) - at(k - 0.5)) * 1e3 };
            method.step(&pose, &twist, 1e-3)
        };
        (0..80).map(feel).collect()
    };
    let mut method = make(ball(), groove.clone(), SETTINGS);
    let first = drag(&mut *method);
    assert!(first.iter().any(|felt| felt.contacts > 1 && felt.deepest < 0.0), "the ball touches both walls");
    assert!(first.iter().all(|felt| felt.wrench.is_finite()));
    method.clear();
    assert_eq!(first, drag(&mut *method), "after forgetting");
    assert_eq!(first, drag(&mut *make(ball(), groove, SETTINGS)), "by another instance");
}
