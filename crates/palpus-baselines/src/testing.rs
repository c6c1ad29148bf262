//! Bodies and cases with known results, for the tests of all methods.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use palpus::algebra::{Pose, Twist};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus_scenes::shape;

use crate::{Baseline, Felt, Settings};

pub(crate) fn body(soup: &PolygonSoup) -> Arc<Body> {
    Arc::new(Body::from_soup(soup, &BodySettings::default(), &mut |_| ()).expect("the shape is a valid mesh"))
}

const RADIUS: f64 = 0.012;
const BOX: DVec3 = DVec3::new(0.060, 0.040, 0.030);
pub(crate) const SETTINGS: Settings =
    Settings { tolerance: 1e-3, stiffness: 500.0, grip_a: DVec3::new(0.004, -0.003, 0.01) };

pub(crate) fn ball() -> Arc<Body> {
    body(&shape::sphere(RADIUS, 2))
}

/// Returns the height of the ball's lowest corner relative to its centre, m, after a rotation.
pub(crate) fn lowest_of_ball(turn: DQuat) -> f64 {
    shape::sphere(RADIUS, 2).vertices.iter().map(|&p| (turn * p).z).fold(f64::INFINITY, f64::min)
}

pub(crate) fn table() -> Arc<Body> {
    body(&shape::table())
}

type Maker<'a> = &'a dyn Fn(Arc<Body>, Arc<Body>, Settings) -> Box<dyn Baseline>;

/// Moves a body down onto the table, so that one corner of its mesh touches first. Calls `judge`
/// with the height of this corner over the table (m), its lever arm from the grip (m), and the
/// result.
fn down(soup: &PolygonSoup, turn: DQuat, make: Maker<'_>, mut judge: impl FnMut(f64, DVec3, &Felt)) {
    let mut method = make(body(soup), table(), SETTINGS);
    let lowest =
        soup.vertices.iter().map(|&p| turn * p).min_by(|p, q| p.z.total_cmp(&q.z)).expect("a mesh has vertices");
    let speed = -0.05;
    let twist = Twist { angular: DVec3::ZERO, linear: DVec3::Z * speed };
    for tick in 0..70 {
        let height = 1.97e-3 + speed * 1e-3 * f64::from(tick);
        let pose = Pose::new(turn, DVec3::new(0.02, -0.01, height - lowest.z));
        let felt = method.step(&pose, &twist, 1e-3);
        judge(height, lowest + pose.translation - pose.point(SETTINGS.grip_a), &felt);
    }
}

/// Tests a ball on its lowest corner: one contact, with known depth and lever arm.
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

/// Tests a box that lies flat on the table. Depth and force are known; the contact point may be
/// anywhere on the face.
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

/// Drags a ball through the groove twice. The results must be identical, also after `clear` and
/// with a new instance.
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
    assert!(first.iter().any(|felt| felt.contacts > 1 && felt.deepest < 0.0), "the ball must touch both walls");
    assert!(first.iter().all(|felt| felt.wrench.is_finite()));
    method.clear();
    assert_eq!(first, drag(&mut *method), "the result must not change after `clear`");
    assert_eq!(first, drag(&mut *make(ball(), groove, SETTINGS)), "the result must not depend on the instance");
}
