//! Tests a nut that lies free on the thread of its bolt and is turned by a wrench, in a world with
//! limited work. The meshes are not part of the project.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};
use palpus::algebra::{NoClock, Pose};
use palpus::body::{Body, BodySettings, PolygonSoup};
use palpus::render::{Limits, Object, ProbeState, Settings, WorkLimit, World};
use palpus_io::read_mesh;
use palpus_scenes::shape::sleeve;

const DT: f64 = 1e-3;
/// Rise of the thread in one turn, m.
const PITCH: f64 = 0.002;
/// Height of the nut's middle when its mesh is at the origin, m.
const MIDDLE: f64 = 0.0225;
/// Height of the wrench, m.
const WRENCH_HEIGHT: f64 = 0.008;
/// Height of the nut at the start, m. It lies on the thread.
const START: f64 = 0.00207;
/// Speed at which the hand turns the wrench, degrees per second.
const SPEED: f64 = 20.0;

/// What happens while the hand turns the wrench for 3 s.
#[derive(Debug, Default)]
struct Turning {
    /// Most work of a step.
    most_work: u64,
    /// Largest distance of the nut's axis from the bolt's axis, m.
    sideways: f64,
    /// Lowest and highest position of the nut relative to a nut that turns on the surface of the
    /// thread, m.
    lowest: f64,
    highest: f64,
    /// Angle of the wrench's path minus angle of the nut at the end, degrees.
    behind: f64,
    /// Largest change of the force in a step, N.
    change: f64,
}

fn body(soup: &PolygonSoup) -> Arc<Body> {
    let settings = BodySettings { flatness: BodySettings::HAPTIC, ..BodySettings::default() };
    Arc::new(Body::from_soup(soup, &settings, &mut |_| ()).expect("the mesh is a valid body"))
}

fn nut_and_bolt() -> Option<[Arc<Body>; 2]> {
    let models = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/models/pairs"));
    let read = |name: &str| read_mesh(&models.join(name)).ok();
    Some([body(&read("nut_m16_loose.obj")?), body(&read("bolt_m16_loose.obj")?)])
}

/// Turns the nut with a contact tolerance (m) and a work limit of a step.
fn turn([nut, bolt]: &[Arc<Body>; 2], tolerance: f64, work: u64) -> Turning {
    let settings = Settings::coupled(Limits { force: 8.5, torque: 0.19 }, DT, tolerance).with_friction(0.15, 0.1);
    let mut world = World::new(settings).expect("valid settings");
    world.set_gravity(DVec3::Z * -9.81);
    world.add(Object::fixed(bolt.clone(), Pose::IDENTITY)).expect("a valid pose");
    let start = Pose::from_translation(DVec3::Z * START);
    let nut = world.add(Object::free(nut.clone(), start, 7800.0)).expect("a valid object");
    let wrench = body(&sleeve(DVec3::new(0.04, 0.04, WRENCH_HEIGHT), DVec2::new(0.0243, 0.0286)));
    let wrench = world.add_tool(wrench, settings).expect("valid settings");
    world.allow(WorkLimit::Units(work));
    let (mut last, mut turning) = (DVec3::ZERO, Turning::default());
    for k in 0..3000 {
        let angle = SPEED.to_radians() * DT * f64::from(k - 300).max(0.0);
        let height = MIDDLE + 0.5 * WRENCH_HEIGHT + START + PITCH * angle / TAU;
        let pose = Pose::new(DQuat::from_rotation_z(angle), DVec3::Z * height);
        world.step(&[ProbeState::at(pose)], DT, &NoClock);
        let tick = world.tick(wrench);
        let Pose { translation, rotation } = world.pose(nut);
        let turned = rotation.to_scaled_axis().z;
        let above = translation.z - START - PITCH * turned / TAU;
        turning = Turning {
            most_work: turning.most_work.max(tick.work),
            sideways: turning.sideways.max(translation.truncate().length()),
            lowest: turning.lowest.min(above),
            highest: turning.highest.max(above),
            behind: (angle - turned).to_degrees(),
            change: turning.change.max(tick.commanded.force.distance(last)),
        };
        last = tick.commanded.force;
    }
    turning
}

#[test]
fn wrench_turns_a_free_nut_on_its_bolt() {
    let Some(bodies) = nut_and_bolt() else { return };
    // The tolerance is a hundredth of the wrench. A loop at 1 kHz has time for about 1500 units.
    for work in [800, 1500, 3000] {
        let turning = turn(&bodies, 6e-4, work);
        // Measured: the nut moves down by up to 0.2 mm and sideways by up to 0.5 mm before all
        // pairs are found, and then stays on the thread. It fell through the bolt by 8 mm when the
        // front had no room for all pairs. The most work is in the first steps, which march hulls of
        // many vertices.
        assert!(turning.lowest > -4e-4 && turning.highest < 1e-4 && turning.sideways < 1e-3, "{work}: {turning:?}");
        assert!(turning.behind < 1.5 && turning.change < 0.05, "{work}: {turning:?}");
        assert!(turning.most_work < work + 2000, "{work}: {turning:?}");
    }
}

#[test]
fn nut_with_a_small_tolerance_does_not_exceed_the_work_limit() {
    let Some(bodies) = nut_and_bolt() else { return };
    for work in [800, 1500] {
        let turning = turn(&bodies, 1e-4, work);
        // Measured: 1300 more than the limit. It was 8400 more when each query bounded all due
        // pairs.
        assert!(turning.most_work < work + 2000, "{work}: {turning:?}");
        assert!(turning.lowest > -4e-4 && turning.highest < 1e-4 && turning.sideways < 1e-3, "{work}: {turning:?}");
    }
}
